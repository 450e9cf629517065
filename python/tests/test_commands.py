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
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import pytest

import grazemap as gm

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

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
    return {name: [row[place] for row in rows] for place, name in enumerate(header)}


def assert_same(table: Mapping[str, np.ndarray], csv_columns: dict[str, list[str]]) -> None:
    assert list(table) == list(csv_columns)
    for name, cells in csv_columns.items():
        column = table[name]
        if column.dtype == object:
            assert list(column) == cells
        elif column.dtype == bool:
            # A flag that is not known is empty in CSV.
            assert column.tolist() == [cell == "1" for cell in cells], name
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
            m, "alpha", (-1e-4, 2e-4), points=30, observe="x", method=["guarded", "map"]
        )
    elif kind == "basin":
        ranges = ((-1e-3, 1e-3), (-2e-3, 2e-3))
        table = gm.basin(m, ("x", "theta"), ranges, points=20, at={"alpha": -5e-4})
        assert table.attractors
    else:
        ranges = ((-1e-4, 1e-4), (-1e-4, 2e-4))
        table = gm.chart(m, ("alpha", "omega"), ranges, points=(12, 9))
    assert_same(table, written(output))


def of_program(folder: Path, command: str, *arguments: str) -> tuple[dict[str, list[str]], str]:
    """Give table and document of a command of the program."""
    table, document = folder / "out.csv", folder / "out.json"
    words = [program(), command, *arguments, "-q", "--csv", str(table), "--json", str(document)]
    subprocess.run(words, check=False, cwd=folder, stdout=subprocess.DEVNULL)  # noqa: S603
    return written(table), document.read_text()


COMMANDS: list[tuple[str, str, list[str], Callable[[gm.Map], gm.Table]]] = [
    (
        "foale",
        "branch",
        ["--along", "omega", "--itinerary", "1", "--from", "-1e-3", "--observe", "h,impact_speed"],
        lambda m: gm.branch(
            m, "omega", (-1e-3, None), itineraries=["1"], observe=["h", "impact_speed"]
        ),
    ),
    (
        "linear",
        "loci",
        ["--in", "omega,alpha", "--kind", "graze,fold", "--itinerary", "1"],
        lambda m: gm.loci(m, ("omega", "alpha"), kind=["graze", "fold"], itineraries=["1"]),
    ),
    (
        "linear",
        "orbits",
        ["--at", "alpha=-1e-4", "--at", "alpha=1e-4,omega=1e-5", "--period", "2"],
        lambda m: gm.orbits(m, [{"alpha": -1e-4}, {"alpha": 1e-4, "omega": 1e-5}], period=2),
    ),
    (
        "mems_scenario3",
        "orbits",
        ["--fold", "--in", "omega,V", "--itinerary", "1", "--points", "5"],
        lambda m: gm.orbits(m, kind="fold", plane=["omega", "V"], itineraries=["1"], points=5),
    ),
    (
        "linear",
        "curve",
        ["--with", "omega", "--from", "1.75", "--to", "1.85", "--xi", "2"],
        lambda m: gm.curve(m, "omega", (1.75, 1.85), xi=2),
    ),
    (
        "linear",
        "curve",
        ["--nearest", "alpha,omega"],
        lambda m: gm.nearest(m.graze.scene, ["alpha", "omega"]),
    ),
    (
        "linear",
        "contact",
        ["--restitution", "0.8", "--time", "0.01"],
        lambda m: gm.contact(m, 0.8, time=0.01),
    ),
    (
        "linear",
        "trajectory",
        ["--start", "x=1e-3", "--at", "alpha=1e-4", "--periods", "3", "--samples", "40"],
        lambda m: gm.trajectory(m, start={"x": 1e-3}, at={"alpha": 1e-4}, periods=3, samples=40),
    ),
]


@pytest.mark.parametrize(("scene", "command", "arguments", "made"), COMMANDS)
def test_commands_give_the_numbers_of_the_program(
    tmp_path: Path,
    scene: str,
    command: str,
    arguments: list[str],
    made: Callable[[gm.Map], gm.Table],
) -> None:
    columns, document = of_program(tmp_path, command, scene, *arguments)
    table = made(gm.Scene.catalogue(scene).graze().map())
    assert_same(table, columns)
    assert table._text == document
    assert len(next(iter(columns.values()))) > 0


def test_images_are_those_of_the_program(m: gm.Map, tmp_path: Path) -> None:
    # Numbers that are the same in decimal and in binary.
    a, b = 2.0**-17, 2.0**-23
    (tmp_path / "in.csv").write_text(f"x,theta,alpha\n{a!r},{2 * a!r},{b!r}\n-0.00390625,0,0\n")
    states = [[a, 2 * a], [-0.00390625, 0.0]]
    parameters = [[b, 0.0], [0.0, 0.0]]
    kinds: list[Any] = [("map", "dd"), ("guarded", "f64"), ("smooth", "f32")]
    for using, precision in kinds:
        options = ["--iterations", "3", "--using", using, "--precision", precision]
        columns, document = of_program(tmp_path, "image", "linear", "--states", "in.csv", *options)
        table = gm.image(m, states, parameters, 3, method=using, precision=precision)
        assert_same(table, columns)
        assert table._text == document
    with pytest.raises(gm.InputError, match="method is one of map, guarded"):
        cast("Any", gm.image)(m, states, method="magic")


def test_a_study_has_the_orders_and_errors_of_the_program(tmp_path: Path) -> None:
    scene = gm.Scene.catalogue("linear").with_(**{"expansion.smooth_order": 3})
    (tmp_path / "linear.toml").write_text(scene.text)
    columns, _ = of_program(tmp_path, "converge", "linear.toml", "--fresh", "20")
    study = gm.converge(scene, fresh=20)
    assert list(study) == list(columns)
    assert any(name.startswith("convergence") for name in study.figures)
    for name in ("N", "W", "largest error", "coefficients"):
        numbers = np.array([float(cell or "nan") for cell in columns[name]])
        assert np.array_equal(study[name], numbers, equal_nan=True), name


def test_a_report_has_the_files_of_the_program(tmp_path: Path) -> None:
    tables = '[[diagram]]\nparameter = "alpha"\nrange = [-1e-4, 2e-4]\npoints = 10\n'
    text = gm.Scene.catalogue("linear").text.split("[[diagram]]")[0].split("[[chart]]")[0] + tables
    (tmp_path / "mine.toml").write_text(text)
    page = gm.report(gm.Scene.load(tmp_path / "mine.toml"), tmp_path / "own")
    command = [program(), "run", "mine.toml", "-q", "-o", "out"]
    subprocess.run(command, check=True, cwd=tmp_path, stdout=subprocess.DEVNULL)  # noqa: S603
    assert page == tmp_path / "own" / "report.html"

    def files(folder: str) -> dict[str, bytes]:
        paths = (path for path in (tmp_path / folder).rglob("*") if path.is_file())
        return {str(path.relative_to(tmp_path / folder)): path.read_bytes() for path in paths}

    own, out = files("own"), files("out")
    assert own.keys() == out.keys()
    # Times, and the command that emits the crate again, are not the same.
    own_to_a_run = {"report.html", "timings.json", "crate/src/mine.rs"}
    timed = {name for name in own if "speed" in name} | own_to_a_run
    assert {name for name in own if own[name] != out[name]} <= timed


def test_the_gallery_has_the_numbers_of_the_program(tmp_path: Path) -> None:
    entry = "thota2006/fig1"
    found = gm.gallery(entry, tmp_path / "own", small=True)
    of_program = tmp_path / "program"
    words = [program(), "gallery", entry, "--small", "-q", "-o", str(of_program)]
    subprocess.run(words, check=True)  # noqa: S603
    with (of_program / "numbers.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert found.document == rows
    assert [str(word) for word in found["computed"]] == [row["computed"] for row in rows]
    assert found.ended is None
    assert found.page.exists()
    assert found.figures[f"{entry}/curve/curve"].startswith("<svg")
    with pytest.raises(gm.InputError, match="thota2007"):
        gm.gallery("thota2007", tmp_path / "own")


def test_nothing_found_is_an_exception_unless_it_is_wanted(m: gm.Map) -> None:
    with pytest.raises(gm.NoResultError, match="no periodic orbit") as caught:
        m.orbits({"alpha": -1e-6}, itineraries="11")
    assert caught.value.result is not None
    assert caught.value.result.is_empty
    assert gm.NoResult is gm.NoResultError
    none = m.orbits({"alpha": -1e-6}, itineraries=["11"], on_empty="return")
    assert none.is_empty
    assert "no periodic orbit" in str(none.ended)
    assert m.branch("alpha", (-1e-4, 1e-4), itineraries="1").ended is None
    assert gm.branch(m, "alpha", (1e-9, 2e-9), itineraries="11", on_empty="return").is_empty


def test_an_early_end_is_a_warning(m: gm.Map) -> None:
    with pytest.warns(gm.GrazemapWarning, match="did not reach delta") as seen:
        short = gm.curve(m, "delta", (1.0, -1.0))
    assert short.ended is not None
    assert "did not reach" in repr(short)
    assert all(one.filename == __file__ for one in seen)


def test_remarks_are_warnings_at_the_line_of_the_call(m: gm.Map) -> None:
    with pytest.warns(gm.GrazemapWarning) as seen:
        found = m.image([1e-5, 0.0], iterations=2)
    (remark,) = found.remarks
    (told,) = seen
    assert remark == f"warning: {told.message}"
    assert told.filename == __file__
    assert told.category is gm.GrazemapWarning
    contradicting = {"window.depth": 1e-2, "window.state.x": 1e-6}
    narrow = gm.Scene.catalogue("linear").replace(**contradicting)
    with pytest.warns(gm.GrazemapNote, match="its bounds contradict each other"):
        narrow.diagram("alpha", (-1e-8, 1e-8), points=3)


def test_a_table_goes_to_other_libraries(m: gm.Map) -> None:
    diagram = gm.diagram(m, "alpha", (-1e-4, 1e-4), points=20)
    frame = diagram.to_pandas()
    assert list(frame.columns) == list(diagram)
    assert np.array_equal(frame["offset"].to_numpy(), diagram["offset"])
    assert diagram._ipython_key_completions_() == list(diagram)
    offsets, values = diagram.points()
    assert offsets.shape == values.shape
    assert diagram._repr_html_().startswith("<svg")
    assert diagram.figures["diagram"].startswith("<svg")


def test_progress_is_told(m: gm.Map) -> None:
    seen: list[tuple[int, int]] = []
    gm.diagram(m, "alpha", (-1e-4, 1e-4), points=50, progress=lambda *told: seen.append(told))
    assert seen[-1][0] == seen[-1][1] > 0


def test_an_interrupt_ends_the_call_at_once(m: gm.Map) -> None:
    # A shell's background jobs ignore interrupts, and Python leaves it at that.
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    sent = []

    def interrupt() -> None:
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.3, interrupt)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        gm.diagram(m, "alpha", (-1e-4, 1e-4), points=100_000, method="direct")
    assert time.monotonic() - sent[0] < 0.5
    timer.join()
    signal.signal(signal.SIGINT, handler)


def test_an_exception_of_progress_ends_the_call(m: gm.Map) -> None:
    def refuse(_done: int, _expected: int) -> None:
        raise RuntimeError

    with pytest.raises(RuntimeError):
        gm.diagram(m, "alpha", (-1e-4, 1e-4), points=100_000, method="direct", progress=refuse)


def test_an_atlas_draws_what_direct_simulation_does(m: gm.Map) -> None:
    direct, atlas = (
        gm.diagram(m, "alpha", (-0.3, 1.2), points=100, observe="x", method=method)
        for method in ("direct", "atlas")
    )
    for name in ("offset", "period", "orbit (stop,periods)"):
        np.testing.assert_array_equal(atlas[name], direct[name])
    assert atlas["by_map"].mean() > 0.9
    with pytest.raises(gm.GrazemapError, match="method"):
        gm.noise(m, {"alpha": 1e-6}, method=cast("Any", "atlas"))


def test_older_names_of_arguments_are_taken(m: gm.Map) -> None:
    diagram, branch = cast("Any", gm.diagram), cast("Any", gm.branch)
    older = diagram(m, parameter="alpha", range=(-1e-4, 1e-4), points=3, using="map")
    newer = gm.diagram(m, "alpha", (-1e-4, 1e-4), points=3, method="map")
    assert np.array_equal(older["offset"], newer["offset"])
    with pytest.raises(TypeError, match="older name"):
        branch(m, "alpha", method="map", using="map")


def test_a_fit_finds_parameters_and_says_what_it_needs(m: gm.Map) -> None:
    rng = np.random.default_rng(1)
    truth = {"alpha": 3e-7, "omega": -2e-7}
    starts = np.array([-6e-6, 0.0]) + rng.uniform(-4e-6, 4e-6, (30, 2))
    # Orbits leave the window, where the map alone is not the oscillator.
    orbits = m.iterate(starts, list(truth.values()), 3, method="guarded")
    points = np.concatenate([starts[:, None], orbits], axis=1)
    noisy = points + 1e-9 * rng.normal(size=points.shape)
    found = gm.fit(m, noisy, list(truth), noise={"x": 1e-9, "theta": 1e-9})
    for name, value in truth.items():
        assert abs(found.parameters[name] - value) < 4 * found.errors[name]
    assert np.allclose(np.sqrt(np.diag(found.covariance)), found["standard_error"])
    # A control that is known is not fitted, a list of series is what an array is.
    controls = {"alpha": [truth["alpha"]] * 30}
    one = gm.fit(m, list(noisy), ["omega"], controls=controls, noise={"x": 1e-9, "theta": 1e-9})
    assert one.errors["omega"] < found.errors["omega"]
    again = gm.fit(gm.Scene.catalogue("linear"), points, ["alpha"], controls={"omega": -2e-7})
    assert abs(again.parameters["alpha"] - truth["alpha"]) < 1e-12
    with pytest.raises(gm.InputError, match="parameters: no active parameter `zta`"):
        gm.fit(m, noisy, ["zta"])
    with pytest.raises(gm.InputError, match="2 coordinates"):
        gm.fit(m, points[..., :1], ["alpha"])
    with pytest.raises(gm.InputError, match="4 numbers were measured, and 4 are unknown"):
        gm.fit(m, points[0, :2], ["alpha", "omega"])


def test_a_fit_leaves_a_false_minimum_and_says_what_it_misses(m: gm.Map) -> None:
    rng = np.random.default_rng(1)
    truth = [3e-7, -2e-7]
    # Starts less deep than the noise.
    starts = np.array([-6e-6, 0.0]) + rng.uniform(-1, 1, (30, 2)) * [4e-6, 1e-4]
    orbits = m.iterate(starts, truth, 3, method="guarded")
    points = np.concatenate([starts[:, None], orbits], axis=1)
    noisy = points + 1e-8 * rng.normal(size=points.shape)
    found = gm.fit(m, noisy, ["alpha", "omega"], noise={"x": 1e-8, "theta": 1e-8})
    assert found.document["end"] == "converged"
    for name, value in zip(["alpha", "omega"], truth, strict=True):
        assert abs(found.parameters[name] - value) < 5 * found.errors[name]
    # Noise stated a hundredth of what it is.
    found = gm.fit(m, noisy, ["alpha", "omega"], noise={"x": 1e-10, "theta": 1e-10})
    assert found.document["end"] == "misfit"
    assert any("larger than the noise makes it" in remark for remark in found.remarks)


def test_noise_is_drawn_by_its_seed(m: gm.Map) -> None:
    def drawn(seed: int) -> gm.Noise:
        return gm.noise(m, {"alpha": 1e-6}, orbits=20, transient=5, keep=30, seed=seed)

    found = drawn(3)
    assert np.array_equal(found["count"], drawn(3)["count"])
    assert found.document["mean"] != drawn(4).document["mean"]
    across, up, density = found.density()
    assert density.shape == (up.size - 1, across.size - 1)
    with pytest.raises(gm.InputError, match="orbits: expected a whole number from 1"):
        gm.noise(m, {"alpha": 1e-6}, orbits=0)
