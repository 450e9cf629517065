"""Measure what the package costs; each figure is one command.

python benchmarks/measure.py import       first import, in a fresh interpreter, beside NumPy's
python benchmarks/measure.py map          m(x, p) on a million points against its lanes
python benchmarks/measure.py interrupt    from Ctrl-C to the prompt
python benchmarks/measure.py fit          1000 noisy section points, three parameters; coverage
python benchmarks/measure.py plot         a chaotic diagram of 1000 x 200 points as a PDF
python benchmarks/measure.py cluster      a chart of 1000 x 1000 on two workers, one of them killed
python benchmarks/measure.py wheel        size of the wheel, and what it takes to install
"""

from __future__ import annotations

import os
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

PACKAGE = Path(__file__).parents[1]


def say(what: str, value: str) -> None:
    """Write a figure."""
    sys.stdout.write(f"{what:<46} {value}\n")


def seconds(work: Callable[[], object], times: int) -> float:
    """Give the least time of some runs."""

    def once() -> float:
        start = time.perf_counter()
        work()
        return time.perf_counter() - start

    return min(once() for _ in range(times))


def measure_import() -> None:
    """Time imports in fresh interpreters, the interpreter's own start taken off."""

    def start(code: str) -> float:
        command = [sys.executable, "-c", code]
        return seconds(lambda: subprocess.run(command, check=True), 10)  # noqa: S603

    bare, numpy, own = start("pass"), start("import numpy"), start("import grazemap")
    say("import numpy", f"{1e3 * (numpy - bare):.0f} ms")
    say("import grazemap, NumPy included", f"{1e3 * (own - bare):.0f} ms")


def measure_map() -> None:
    """Time a million points, and the call of the module in Rust alone: lanes on all cores."""
    import numpy as np

    import grazemap as gm

    rng = np.random.default_rng(1)
    for name in ("linear", "mems"):
        m = gm.Scene.catalogue(name).graze().map()
        states = rng.uniform(-1e-5, 1e-5, (1_000_000, len(m.coordinates)))
        for what, rows in (("one row of parameters", 1), ("a row for each point", len(states))):
            parameters = rng.uniform(-1e-7, 1e-7, (rows, len(m.parameters)))
            inner = m._inner
            lanes = seconds(lambda: inner.batch(states, parameters, False), 7)  # noqa: B023
            called = seconds(lambda: m(states, parameters), 7)  # noqa: B023
            words = f"{1e3 * called:.1f} ms, {called / lanes:.2f} times {1e3 * lanes:.1f} ms"
            say(f"m(x, p), 1e6 points, {name}, {what}", words)


def measure_interrupt() -> None:
    """Time from a signal to the exception."""
    import grazemap as gm

    m = gm.Scene.catalogue("linear").graze().map()
    sent = 0.0

    def interrupt() -> None:
        nonlocal sent
        sent = time.perf_counter()
        os.kill(os.getpid(), signal.SIGINT)

    delays = []
    for _ in range(10):
        timer = threading.Timer(0.2, interrupt)
        timer.start()
        try:
            gm.diagram(m, "alpha", (-1e-4, 1e-4), points=100_000, method="direct")
        except KeyboardInterrupt:
            delays.append(time.perf_counter() - sent)
        timer.join()
    say("Ctrl-C", f"{1e3 * statistics.median(delays):.0f} ms, at most {1e3 * max(delays):.0f} ms")


def measure_fit() -> None:
    """Fit a hundred times: how long, and how often the truth is within one and two errors."""
    import numpy as np

    import grazemap as gm

    names, truth = ["V", "omega", "r"], np.array([-1e-5, -1e-5, 4e-3])
    keys = {
        "expansion.active": names,
        "expansion.smooth_order": 7,
        "expansion.contact_weight": 10,
        "window.depth": 6e-3,
        "window.state": {"x": 6e-3, "theta": 0.1},
        "window.parameter": {"V": 3e-4, "omega": 3e-4, "r": 1e-2},
    }
    m = gm.Scene.catalogue("mems").replace(**keys).graze().map()
    rng, noise = np.random.default_rng(1), np.array([3e-7, 1e-5])
    within, times = np.zeros(2), []
    trials = 100
    for _ in range(trials):
        starts = np.array([8e-6, 0]) + rng.uniform(-1, 1, (333, 2)) * [4e-6, 1e-3]
        points = np.concatenate([starts[:, None], m.iterate(starts, truth, 2)], axis=1)
        points += noise * rng.normal(size=points.shape)
        start = time.perf_counter()
        found = gm.fit(m, points, names, noise=dict(zip(m.coordinates, noise, strict=True)))
        times.append(time.perf_counter() - start)
        error = np.abs(found["offset"] - truth) / found["standard_error"]
        within += [(error < 1).mean(), (error < 1.96).mean()]  # noqa: PLR2004
    say("fit, 1000 points of mems, 3 parameters", f"{1e3 * statistics.median(times):.0f} ms")
    say("truth within 1 standard error (68.3 % expected)", f"{within[0] / trials:.1%}")
    say("truth within 1.96 standard errors (95 % expected)", f"{within[1] / trials:.1%}")


def measure_cluster() -> None:
    """Compare a chart of a million cells with that of two workers of Dask, one killed half-way."""
    import distributed

    import grazemap as gm

    m = gm.Scene.catalogue("cantilever_0_09").graze().map()

    def chart(client: distributed.Client | None = None) -> gm.Chart:
        plane, spans = ("Q", "beta"), ((-1e-4, 8e-4), (-1e-3, 1e-3))
        size = (1000, 1000)
        return gm.chart(m, plane, spans, points=size, cells="all", method="map", client=client)

    start = time.perf_counter()
    alone = chart()
    say("chart of 1000 x 1000, one process", f"{time.perf_counter() - start:.1f} s")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as two,
        distributed.Client(two) as client,
    ):
        workers = client.run(os.getpid)

        def kill() -> None:
            # Each share finished is a result held by a worker: half of the eight.
            while sum(map(len, client.has_what().values())) < 4:  # noqa: PLR2004
                time.sleep(0.01)
            os.kill(next(iter(workers.values())), signal.SIGKILL)

        killer = threading.Thread(target=kill)
        start = time.perf_counter()
        killer.start()
        together = chart(client)
        took = time.perf_counter() - start
        killer.join()
        died = set(workers.values()) - set(client.run(os.getpid).values())
    differ = sum(
        list(together[name]) != list(column)
        if column.dtype == object
        else together[name].tobytes() != column.tobytes()
        for name, column in alone.items()
    )
    say("on two workers, one killed half-way", f"{took:.1f} s, {len(died)} died")
    say("columns that differ in a byte", f"{differ} of {len(alone)}")
    say("documents", "equal" if together.document == alone.document else "differ")


def measure_plot() -> None:
    """Draw a chaotic diagram of 1000 x 200 points and write it as a PDF of 300 dots an inch."""
    import matplotlib as mpl

    import grazemap as gm

    mpl.use("pdf")
    m = gm.Scene.catalogue("mems_scenario3").graze().map()
    counts = {"points": 1000, "transient": 200, "keep": 200}
    diagram = gm.diagram(m, "V", (0, 5e-5), direction="up", **counts)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "diagram.pdf"
        took = seconds(lambda: diagram.plot().figure.savefig(path, dpi=300), 3)
        size = path.stat().st_size / 1e6
    say(f"PDF of {diagram.points()[0].size} points", f"{took:.2f} s, {size:.2f} MB")


def measure_wheel() -> None:
    """Build a wheel by maturin, and install it into an empty environment."""
    maturin = shutil.which("maturin", path=Path(sys.executable).parent) or "maturin"
    with tempfile.TemporaryDirectory() as folder:
        command = [maturin, "build", "--profile", "wheel", "--out", folder]
        built = seconds(
            lambda: subprocess.run(command, check=True, cwd=PACKAGE),  # noqa: S603
            1,
        )
        (wheel,) = Path(folder).glob("*.whl")
        say("wheel", f"{wheel.stat().st_size / 2**20:.2f} MB, built in {built:.0f} s")
        place = Path(folder) / "venv"
        subprocess.run([sys.executable, "-m", "venv", str(place)], check=True)  # noqa: S603
        install = [str(place / "bin" / "pip"), "install", "-q", str(wheel)]
        took = seconds(lambda: subprocess.run(install, check=True), 1)  # noqa: S603
        say("pip install of the wheel, NumPy included", f"{took:.1f} s")


MEASURES = {
    "import": measure_import,
    "map": measure_map,
    "interrupt": measure_interrupt,
    "fit": measure_fit,
    "plot": measure_plot,
    "cluster": measure_cluster,
    "wheel": measure_wheel,
}

if __name__ == "__main__":
    for name in sys.argv[1:] or MEASURES:
        MEASURES[name]()
