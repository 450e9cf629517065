"""Interruptions of every function, forked processes, and sizes beyond memory."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

import grazemap as gm

if TYPE_CHECKING:
    from collections.abc import Callable

#: Seconds of processor time that an abandoned computation may still take, on all threads.
SPENT = 0.25


@pytest.fixture(scope="module")
def m() -> gm.Map:
    return gm.Scene.catalogue("linear").graze().map()


def measured(m: gm.Map) -> np.ndarray:
    starts = np.random.default_rng(1).uniform(-4e-6, 4e-6, (2000, 2))
    orbits = m.iterate(starts, None, 40, method="guarded")
    return np.concatenate([starts[:, None], orbits], axis=1)


#: Calls that last for many seconds.
LONG: dict[str, Callable[[gm.Map], object]] = {
    "basin": lambda m: gm.basin(m, points=2000, method="direct"),
    "branch": lambda m: gm.branch(m, "alpha", (-1e-3, 2e-2), period=8, method="direct"),
    "chart": lambda m: gm.chart(
        m, ("alpha", "omega"), ((-1e-4, 1e-4), (-1e-4, 1e-4)), points=1000, method="direct"
    ),
    "converge": lambda m: gm.converge(m, fresh=1_000_000),
    "call": lambda m: m(np.zeros((20_000_000, 2))),
    "curve": lambda m: gm.curve(m, "omega", (1.8, 0.01), xi=3),
    "derivatives": lambda m: m.graze.scene.replace(alpha=0.5).derivatives({}, returns=1_000_000),
    "diagram": lambda m: gm.diagram(m, "alpha", (-1e-4, 1e-4), points=100_000, method="direct"),
    "fit": lambda m: gm.fit(m, measured(m), ["alpha", "omega"], method="direct"),
    "image": lambda m: gm.image(m, np.zeros((2000, 2)), iterations=1000, method="direct"),
    "iterate": lambda m: m.iterate(np.zeros((4000, 2)), iterations=1000, method="direct"),
    "loci": lambda m: gm.loci(m, ("omega", "alpha"), method="direct"),
    "map": lambda _: (
        gm.Scene.catalogue("mems")
        .with_(**{"expansion.smooth_order": 20, "expansion.contact_weight": 20})
        .graze()
        .map()
    ),
    "noise": lambda m: gm.noise(m, {"alpha": 1e-6}, orbits=5000, keep=5000, method="direct"),
    "orbits": lambda m: gm.orbits(m, {"alpha": 1e-3}, period=10, method="direct"),
    "safe": lambda m: gm.safe(m, {"omega": 0.1, "alpha": 0.1}, points=1000),
    "trajectory": lambda m: gm.trajectory(
        m, settle=1_000_000, at={"alpha": 1e-3}, start={"x": 1e-3}
    ),
}


#: Calls that are interrupted for every change; the others are in the campaign.
SOON = ("branch", "diagram", "iterate")


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in SOON else pytest.mark.campaign) for name in LONG],
)
def test_what_is_interrupted_ends_and_computes_no_more(m: gm.Map, name: str) -> None:
    # A shell's background jobs ignore interrupts, and Python leaves it at that.
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            LONG[name](m)
    finally:
        timer.cancel()
        timer.join()
        signal.signal(signal.SIGINT, handler)
    spent = time.process_time()
    time.sleep(0.8)
    assert time.process_time() - spent < SPENT


def images(m: gm.Map) -> float:
    return float(m(np.full((5000, 2), 1e-6)).sum())


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_children_of_a_process_that_has_computed_compute_too(m: gm.Map) -> None:
    expected = images(m)
    gm.diagram(m, "alpha", (-1e-4, 1e-4), points=3)
    with multiprocessing.get_context("fork").Pool(2) as pool:
        found = pool.map_async(images, [m] * 4).get(timeout=60)
    assert found == [expected] * 4


@pytest.mark.parametrize(
    ("call", "words"),
    [
        ("m.iterate(np.zeros(2), iterations=2**63)", "memory"),
        ("m.iterate(np.zeros(2), iterations=10**10)", "memory"),
        ("gm.image(m, np.zeros((1, 2)), iterations=10**9)", "memory"),
        ("gm.fit(m, np.full((5, 4, 2), 1e300), ['alpha'])", "at most 1e100"),
        ("gm.branch(m, 'alpha', (float('nan'), 1.0))", "span"),
        ("gm.orbits(m, {'alpha': float('inf')})", "alpha"),
        ("m.iterate(np.zeros(2), iterations=-1)", ""),
        ("gm.trajectory(m, periods=-1)", "periods: expected"),
        ("gm.trajectory(m, periods=10**30)", "periods: expected"),
    ],
)
def test_numbers_that_are_too_much_are_errors_in_words(call: str, words: str) -> None:
    # In a process of its own: what was wrong once ended the interpreter.
    script = f"""
import resource
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
import numpy as np
import grazemap as gm
m = gm.Scene.catalogue("linear").graze().map()
try:
    {call}
except (gm.GrazemapError, MemoryError, OverflowError, ValueError) as error:
    print(type(error).__name__, error)
"""
    ran = subprocess.run(  # noqa: S603
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).parent,
    )
    assert ran.returncode == 0, ran.stderr
    assert words in ran.stdout
    assert ran.stdout
    assert "line 1" not in ran.stdout
    assert "panic" not in ran.stdout.lower() + ran.stderr.lower()
