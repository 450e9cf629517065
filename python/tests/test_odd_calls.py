"""Odd calls: every argument of every function with values that nobody means."""

from __future__ import annotations

import inspect
import resource
import signal
import time
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import grazemap as gm

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

#: Seconds of processor time after which a call is interrupted; it is long, and no fault.
LONG = 1.0
#: Seconds of processor time that an interrupted call may still take.
SPENT = 0.25
#: Memory beyond which a call ends with an exception, in bytes.
MEMORY = 4 << 30

RANGES = ((-1e-5, 1e-5), (-1e-5, 1e-5))

#: Small calls. Each argument of the function is replaced in turn.
CALLS: dict[str, dict[str, Any]] = {
    "basin": {"plane": ("x", "theta"), "spans": RANGES, "points": 3},
    "branch": {"along": "alpha", "span": (-1e-6, 1e-6), "itineraries": "1"},
    "chart": {"plane": ("omega", "alpha"), "spans": RANGES, "points": 2, "transient": 5, "keep": 4},
    "contact": {"restitution": 0.8},
    "converge": {"fresh": 1},
    "curve": {"along": "omega", "span": (1.8, 1.81)},
    "derivatives": {"start": {"v": 3.0}, "at": 1.0},
    "diagram": {"along": "alpha", "span": (-1e-6, 1e-6), "points": 2, "transient": 5, "keep": 4},
    "fit": {"data": np.zeros((4, 2)), "parameters": "alpha"},
    "image": {"states": np.zeros((1, 2))},
    "loci": {"plane": ("omega", "alpha"), "span": (-1e-6, 1e-6), "kind": "graze"},
    "nearest": {"parameters": "alpha"},
    "noise": {"deviations": {"alpha": 1e-6}, "orbits": 2, "keep": 2, "transient": 2},
    "orbits": {"at": {"alpha": 1e-6}, "itineraries": "1"},
    "safe": {"points": 0},
    "trajectory": {"samples": 3},
}

ODD: list[Any] = [
    None,
    True,
    -1,
    0,
    1.5,
    float("nan"),
    float("inf"),
    1e300,
    10**30,
    2**63,
    "",
    "nothing",
    "\0",
    "[1]\nx = 2",
    "a" * 10_000,
    b"x",
    (),
    [None],
    [float("nan")],
    (1e-5, -1e-5),
    (1e-5, 1e-5),
    (1, 2, 3),
    {},
    {"q": 1.0},
    {"alpha": float("nan")},
    {1: 2},
    np.zeros((2, 2)),
    np.zeros((0, 2)),
    np.array(["x"]),
    object(),
    lambda *_: None,
]


@pytest.fixture(scope="module")
def m() -> gm.Map:
    return gm.Scene.catalogue("linear").graze().map()


@pytest.fixture
def _limits() -> Iterator[None]:
    """Limit the memory, and let the timer of processor time interrupt."""
    memory = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, memory[1]))
    handler = signal.signal(signal.SIGVTALRM, signal.default_int_handler)
    yield
    signal.signal(signal.SIGVTALRM, handler)
    resource.setrlimit(resource.RLIMIT_AS, memory)


def faults(name: str, argument: str, odd: object, call: Callable[[], object]) -> Iterator[str]:
    """Make one odd call and tell what is wrong with its end."""
    what = f"{name}({argument}={odd!r:.60})"
    signal.setitimer(signal.ITIMER_VIRTUAL, LONG)
    began = time.process_time()
    try:
        call()
    except (gm.GrazemapError, MemoryError) as error:
        words = str(error)
        if any(word in words for word in ("panic", "at line", " --", "invalid type")):
            yield f"{what}: {words:.200}"
    except KeyboardInterrupt:
        pass
    except BaseException as error:  # noqa: BLE001
        yield f"{what}: {type(error).__name__}: {error!s:.200}"
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
    spent = time.process_time() - began
    if spent > LONG + SPENT:
        yield f"{what}: took {spent:.1f} s"


@pytest.mark.campaign
@pytest.mark.usefixtures("_limits")
@pytest.mark.parametrize("name", CALLS)
def test_odd_calls_end_with_an_error_of_the_package(
    m: gm.Map, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    function, usual = getattr(gm, name), CALLS[name]
    found: list[str] = []
    calls = 0
    monkeypatch.chdir(tmp_path)
    function(m, **usual)
    for argument in inspect.signature(function).parameters:
        for odd in ODD:
            keys = {"source": m, **usual, argument: odd}
            found += faults(name, argument, odd, partial(function, **keys))
            calls += 1
    assert not list(tmp_path.iterdir())
    assert calls > len(ODD)
    assert not found, "\n".join(found)
