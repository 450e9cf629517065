"""Commands as functions: the numbers of the program, progress, interruption, other libraries."""

from __future__ import annotations

import csv
import os
import shutil
import signal
import subprocess
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

import grazemap as gm

if TYPE_CHECKING:
    from collections.abc import Mapping

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def m() -> gm.Map:
    return gm.Scene.catalogue("linear").graze().map()


def program() -> str:
    """Find the program: as named, or built beside the package."""
    named = os.environ.get("GRAZEMAP_PROGRAM") or shutil.which("grazemap")
    built = (ROOT / "target" / profile / "grazemap" for profile in ("debug", "release"))
    found = named or next((str(path) for path in built if path.exists()), None)
    if found is None:
        pytest.skip("the program is not built")
    return found


def written(path: Path) -> dict[str, list[str]]:
    with path.open(newline="") as file:
        header, *rows = list(csv.reader(file))
    return dict(zip(header, map(list, zip(*rows, strict=True)), strict=True))


def assert_same(table: Mapping[str, np.ndarray], csv_columns: dict[str, list[str]]) -> None:
    assert list(table) == list(csv_columns)
    for name, cells in csv_columns.items():
        column = table[name]
        if column.dtype == object:
            assert list(column) == cells
        else:
            numbers = np.array([float(cell or "nan") for cell in cells])
            assert column.tobytes() == numbers.tobytes(), name


@pytest.mark.parametrize("kind", ["diagram", "chart", "basin"])
def test_numbers_are_those_of_the_program(tmp_path: Path, kind: str) -> None:
    scene = gm.Scene.catalogue("linear").with_(**{"expansion.smooth_order": 4})
    tables = {
        "diagram": '[[diagram]]\nparameter = "alpha"\nrange = [-1e-4, 2e-4]\npoints = 30\n'
        'observe = "x"\nwith = ["guarded", "map"]\n',
        "chart": '[[chart]]\nparameters = ["alpha", "omega"]\n'
        "ranges = [[-1e-4, 1e-4], [-1e-4, 2e-4]]\npoints = [12, 9]\n",
        "basin": '[[basin]]\naxes = ["x", "theta"]\nranges = [[-1e-3, 1e-3], [-2e-3, 2e-3]]\n'
        "points = 20\nat = { alpha = -5e-4 }\n",
    }
    text = scene.text.split("[[diagram]]")[0].split("[[chart]]")[0] + tables[kind]
    path = tmp_path / "mine.toml"
    path.write_text(text)
    output = tmp_path / "out.csv"
    command = [program(), kind, str(path), "-q", "--csv", str(output)]
    subprocess.run(command, check=True, cwd=tmp_path, stdout=subprocess.DEVNULL)  # noqa: S603
    m = gm.Scene.load(path).graze().map()
    table: gm.Table
    if kind == "diagram":
        table = gm.diagram(
            m, "alpha", (-1e-4, 2e-4), points=30, observe="x", using=["guarded", "map"]
        )
    elif kind == "basin":
        ranges = ((-1e-3, 1e-3), (-2e-3, 2e-3))
        table = gm.basin(m, ("x", "theta"), ranges, points=20, at={"alpha": -5e-4})
        assert table.attractors
    else:
        ranges = ((-1e-4, 1e-4), (-1e-4, 2e-4))
        table = gm.chart(m, ("alpha", "omega"), ranges, points=(12, 9))
    assert_same(table, written(output))


def test_wrong_keys_are_faults_of_the_scene(m: gm.Map) -> None:
    with pytest.raises(gm.SceneError, match="zta"):
        gm.diagram(m, "zta", (-1e-4, 1e-4))
    with pytest.raises(gm.SceneError, match="sideways"):
        gm.diagram(m, "alpha", (-1e-4, 1e-4), direction="sideways")


def test_a_table_goes_to_other_libraries(m: gm.Map) -> None:
    diagram = gm.diagram(m, "alpha", (-1e-4, 1e-4), points=20)
    frame = diagram.to_pandas()
    assert list(frame.columns) == list(diagram)
    assert np.array_equal(frame["offset"].to_numpy(), diagram["offset"])
    assert diagram.to_xarray()["offset"].dims == ("row",)
    offsets, values = diagram.points()
    assert offsets.shape == values.shape
    assert diagram._repr_html_().startswith("<svg")
    assert diagram.figures["diagram"].startswith("<svg")


def test_figures_are_drawn(m: gm.Map) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("agg")
    ax = gm.diagram(m, "alpha", (-1e-4, 1e-4), points=20).plot()
    (line,) = ax.get_lines()
    assert np.size(line.get_xdata()) > 0
    chart = gm.chart(m, ("alpha", "omega"), ((-1e-4, 1e-4), (-1e-4, 1e-4)), points=5)
    assert chart.grid()[2].shape == (5, 5)
    chart.plot(ax)


def test_progress_is_told(m: gm.Map) -> None:
    seen: list[tuple[int, int]] = []
    gm.diagram(m, "alpha", (-1e-4, 1e-4), points=50, progress=lambda *told: seen.append(told))
    assert seen[-1][0] == seen[-1][1] > 0


def test_an_interrupt_ends_the_call_at_once(m: gm.Map) -> None:
    sent = []

    def interrupt() -> None:
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.3, interrupt)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        gm.diagram(m, "alpha", (-1e-4, 1e-4), points=100_000, using="direct")
    assert time.monotonic() - sent[0] < 0.5
    timer.join()


def test_an_exception_of_progress_ends_the_call(m: gm.Map) -> None:
    def refuse(_done: int, _expected: int) -> None:
        raise RuntimeError

    with pytest.raises(RuntimeError):
        gm.diagram(m, "alpha", (-1e-4, 1e-4), points=100_000, using="direct", progress=refuse)
