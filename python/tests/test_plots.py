"""Plots by Matplotlib: what is drawn of real results, and what is said where nothing can be."""

from __future__ import annotations

import copy
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import grazemap as gm

mpl = pytest.importorskip("matplotlib")
mpl.use("agg")
plt = pytest.importorskip("matplotlib.pyplot")

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

ROOT = Path(__file__).parents[2]
DOTTED_GREY = (":", "#b3b7bc")


@pytest.fixture(scope="module")
def m() -> gm.Map:
    return gm.Scene.catalogue("linear").graze().map()


@pytest.fixture(scope="module")
def codim2() -> gm.Map:
    return gm.Scene.catalogue("mems_codim2").graze().map()


@pytest.fixture(scope="module")
def readme() -> gm.Map:
    (text,) = re.findall(r"```toml\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    return gm.Scene.parse(text, "oscillator.toml").graze().map()


@pytest.fixture(scope="module")
def branch(m: gm.Map) -> gm.Branch:
    return gm.branch(m, "alpha", (-1e-4, 1e-4), itineraries=["1", "0"], observe=["impact_speed"])


@pytest.fixture(scope="module")
def folded(codim2: gm.Map) -> gm.Branch:
    """Give branches with a graze and, beside it, a fold."""
    at = {"omega": 1.5e-6}
    return gm.branch(codim2, "V", (2.9e-7, 3.4e-7), at=at, itineraries=["1", "0"])


@pytest.fixture(scope="module")
def flipped(codim2: gm.Map) -> gm.Branch:
    """Give a branch with a flip, and the orbits of twice the period from there."""
    at = {"omega": -1.5e-6}
    return gm.branch(codim2, "V", (-3.4e-7, -3.3e-7), at=at, itineraries=["1"])


@pytest.fixture(scope="module")
def loci(codim2: gm.Map) -> gm.Loci:
    return gm.loci(codim2, ("omega", "V"), (-2e-6, 2e-6), itineraries=["1"])


@pytest.fixture(scope="module")
def chart(readme: gm.Map) -> gm.Chart:
    ranges = ((-0.2, 0.2), (-0.3, 1.2))
    return gm.chart(readme, ("omega", "alpha"), ranges, points=(14, 10), transient=100, keep=16)


@pytest.fixture(scope="module")
def basin(m: gm.Map) -> gm.Basin:
    return gm.basin(m, ("x", "theta"), ((-2e-3, 10), (-2, 2)), points=(9, 7), at={"alpha": -5e-4})


@pytest.fixture(scope="module")
def impacts(m: gm.Map) -> gm.Trajectory:
    return gm.trajectory(m, at={"alpha": 5e-3}, periods=4, samples=40)


def look(line: Line2D) -> tuple[str, str]:
    """Give the pattern and the colour of a line."""
    return str(line.get_linestyle()), str(line.get_color())


def finite(line: Line2D) -> int:
    """Count the points of a line."""
    return int(np.isfinite(np.asarray(line.get_xdata(), dtype=float)).sum())


def marked(ax: Axes, label: str) -> int:
    """Count the marks of a special point."""
    return sum(finite(line) for line in ax.lines if line.get_label() == label)


def words(ax: Axes) -> list[str]:
    """Give the words of a legend."""
    legend = ax.get_legend()
    return [] if legend is None else [text.get_text() for text in legend.get_texts()]


def keyed(ax: Axes) -> list[str]:
    """Give the words of the key beside an image."""
    (beside,) = (other for other in ax.figure.axes if other is not ax)
    return words(beside)


def at_value(ax: Axes, value: float, *, along: str) -> list[Line2D]:
    """Give the straight lines across the axes at a value."""
    data = "get_xdata" if along == "x" else "get_ydata"
    return [line for line in ax.lines if np.allclose(getattr(line, data)(), value, atol=1e-12)]


def test_a_stable_branch_is_solid_and_an_unstable_one_dashed(branch: gm.Branch) -> None:
    ax = branch.plot()
    patterns = [look(line)[0] for line in ax.lines if finite(line) > 2]
    assert sorted(patterns) == ["-", "--"]
    assert words(ax) == ["itinerary 1", "itinerary 0", "stable", "unstable", "GR"]
    assert ax.get_xlabel().startswith(r"$\alpha - \alpha^*$   ($\alpha^* = 2.247221$)")
    assert ax.get_ylabel() == "$x - x^*$"
    assert at_value(ax, 0.0, along="x")


def test_virtual_orbits_are_hidden_unless_asked_for(branch: gm.Branch) -> None:
    alpha = branch["alpha"][branch["physical"] == 0]
    assert alpha.min() > 0
    plain, all_of_them = branch.plot(), branch.plot(virtual=True)
    assert DOTTED_GREY not in map(look, plain.lines)
    assert "virtual" not in words(plain)
    ends = [float(np.nanmax(line.get_xdata())) for line in plain.lines if finite(line) > 2]
    assert max(ends) < alpha.max() / 2
    assert DOTTED_GREY in map(look, all_of_them.lines)
    assert "virtual" in words(all_of_them)


def test_special_points_are_marked_at_every_return(folded: gm.Branch, flipped: gm.Branch) -> None:
    ax = folded.plot()
    for label in ("GR", "SN"):
        assert marked(ax, label) == (folded["label"] == label).sum() > 0
    assert marked(ax, "PD") == 0
    assert words(ax)[-2:] == ["GR", "SN"]
    ax = flipped.plot(virtual=True)
    expected = sum(len(point["states"]) for point in flipped.special if point["label"] == "PD")
    assert marked(ax, "PD") == expected > 0
    (flips,) = (line for line in ax.lines if line.get_label() == "PD")
    assert flips.get_marker() == "s"


def test_an_orbit_of_period_two_is_drawn_twice(flipped: gm.Branch) -> None:
    (two,) = (line for line in flipped.plot().lines if line.get_label() == "itinerary 10")
    (one,) = (line for line in flipped.plot(y="re1").lines if line.get_label() == "itinerary 10")
    assert finite(two) == 2 * finite(one)


def test_a_branch_shows_other_columns_and_values(branch: gm.Branch, m: gm.Map) -> None:
    ax = branch.plot(y="impact_speed", values=True)
    assert (ax.get_xlabel(), ax.get_ylabel()) == (r"$\alpha$", "impact speed")
    alpha = m.graze.parameters["alpha"]
    assert at_value(ax, alpha, along="x")
    with pytest.raises(gm.InputError, match=r"y: expected a column of numbers \(.*theta.*'speeds'"):
        branch.plot(y="speeds")


def test_loci_are_measured_from_the_graze_on_axes_of_their_own(loci: gm.Loci) -> None:
    ax = loci.plot()
    assert words(ax) == ["graze (GR)", "fold (SN)", "flip (PD)"]
    assert ax.get_ylabel() == r"$V - V_\mathrm{graze}$"
    (graze,) = (line for line in ax.lines if line.get_label() == "graze (GR)")
    assert np.nanmax(np.abs(graze.get_ydata())) == 0
    assert [text.get_text() for text in ax.texts] == [r"$\xi_{1}$"]
    plane = loci.plot(plt.figure().add_subplot())
    assert plane.get_ylabel().startswith("$V - V^*$")
    (graze,) = (line for line in plane.lines if line.get_label() == "graze (GR)")
    assert np.nanmax(np.abs(graze.get_ydata())) > 1e-7
    assert DOTTED_GREY not in map(look, ax.lines)
    assert DOTTED_GREY in map(look, loci.plot(virtual=True).lines)


def test_a_chart_is_an_image_with_the_periods_that_it_holds(chart: gm.Chart) -> None:
    ax = chart.plot()
    (image,) = ax.images
    assert np.asarray(image.get_array()).shape == (10, 14)
    left, right, low, high = image.get_extent()
    assert left < -0.2 < 0.2 < right
    assert low < -0.3 < 1.2 < high
    periods = {int(period) for period in chart["period"] if period > 1}
    found = keyed(ax)
    assert found[:3] == ["no contact", "1", "2"]
    assert [int(word) for word in found if word.isdigit() and word != "1"] == sorted(
        period for period in periods if period <= 8
    )
    # Chaos stands apart, below a gap, in the colour of no period.
    assert found[found.index("") + 1 :] == ["none up to 16"]
    chaotic = np.isnan(chart["period"]) & (chart["converging"] == 0)
    drawn = np.reshape(image.to_rgba(np.asarray(image.get_array())), (-1, 4))
    assert (np.all(drawn == mpl.colors.to_rgba("#f4a582"), axis=1) == chaotic).all()


def test_the_map_alone_and_escaped_orbits_have_their_own_colours(m: gm.Map) -> None:
    ranges = ((-1e-3, 1e-3), (-1e-3, 2e-3))
    ax = gm.chart(m, ("omega", "alpha"), ranges, points=6, method="map").plot()
    assert keyed(ax) == ["no contact", "", "outside the window"]


def test_the_head_of_a_document_is_the_document_without_its_rows(
    m: gm.Map, chart: gm.Chart
) -> None:
    (head,), (document,) = chart._heads, chart.document
    assert head.pop("cells") == []
    assert document.pop("cells")
    assert head == document
    diagram = gm.diagram(m, "alpha", (-1e-5, 1e-5), points=3, transient=10, keep=4)
    (head,), (document,) = diagram._heads, diagram.document
    assert [sweep.pop("points") for sweep in head["sweeps"]] == [[], []]
    assert all(sweep.pop("points") for sweep in document["sweeps"])
    assert head == document


def test_a_chart_of_exponents_has_a_scale_around_zero(readme: gm.Map) -> None:
    ranges = ((-0.2, 0.2), (-0.3, 1.2))
    plane = ("omega", "alpha")
    counts: dict[str, Any] = {"points": 4, "transient": 50, "keep": 16}
    ax = gm.chart(readme, plane, ranges, observe="lyapunov", **counts).plot(values=True)
    low, high = ax.images[-1].get_clim()
    assert low == -high < 0
    assert (ax.get_xlabel(), ax.get_ylabel()) == (r"$\omega$", r"$\alpha$")
    ax = gm.chart(readme, plane, ranges, observe="itinerary", **counts).plot()
    assert keyed(ax)[:2] == ["0", "1"]


def test_an_overlay_lies_on_the_chart(m: gm.Map) -> None:
    ranges = ((-1e-3, 1e-3), (-1e-3, 2e-3))
    chart = gm.chart(m, ("omega", "alpha"), ranges, points=4, overlay=["graze"])
    ax = chart.plot()
    assert words(ax) == ["graze (GR)"]
    assert ax.get_xlim() == tuple(ax.images[0].get_extent()[:2])
    with pytest.raises(gm.InputError, match="number: expected a chart from 1 to 1, found 2"):
        chart.plot(number=2)


def test_a_basin_is_an_image_with_its_attractors(basin: gm.Basin) -> None:
    ax = basin.plot()
    (image,) = ax.images
    assert np.asarray(image.get_array()).shape == (7, 9)
    (attractor,) = basin.attractors
    assert keyed(ax) == ["1: period 1 (1)"]
    (ring,) = ax.lines
    assert np.allclose(ring.get_xydata(), attractor["states"])
    assert [text.get_text() for text in ax.texts] == ["1"]


def test_a_trajectory_is_a_line_with_stops_and_impacts(impacts: gm.Trajectory) -> None:
    ax = impacts.plot()
    assert words(ax) == ["free flight", "stop", "impact"]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time $t$", "$x$")
    assert look(ax.lines[0])[0] == "-"
    (stop,) = (line for line in at_value(ax, 1.0, along="y") if line.get_linestyle() == "-")
    assert stop.get_color() == "#1f2328"
    struck = impacts["event"] == "impact"
    assert finite(ax.lines[-1]) == struck.sum() > 2
    portrait = impacts.plot(x="x", y="v")
    assert ":" in [look(line)[0] for line in portrait.lines]
    assert [line.get_color() for line in at_value(portrait, 1.0, along="x")].count("#1f2328") == 1
    (turning,) = (line for line in impacts.plot(y="theta").lines if line.get_linestyle() == "-")
    angles = np.asarray(turning.get_ydata(), dtype=float)
    assert np.isnan(angles).sum() > 2
    assert np.nanmin(np.diff(angles)) >= 0


def test_a_soft_contact_has_its_own_colour() -> None:
    scene = gm.Scene.catalogue("soft_a")
    series = gm.trajectory(scene, start={"u": 0.2}, periods=2, samples=60)
    assert "contact" in set(series["event"])
    ax = series.plot()
    assert words(ax) == ["free flight", "contact", "stop", "begin of contact"]
    assert len({line.get_color() for line in ax.lines if line.get_linestyle() == "-"}) == 3


def test_few_points_are_shapes_and_many_are_pixels(m: gm.Map) -> None:
    ax = gm.diagram(m, "alpha", (-1e-4, 2e-4), points=12, transient=100, keep=10).plot()
    clouds = [line for line in ax.lines if line.get_marker() == "o"]
    assert words(ax) == ["up", "down"]
    assert len(clouds) == 2
    assert not any(cloud.get_rasterized() for cloud in clouds)
    assert len({cloud.get_color() for cloud in clouds}) == 2
    assert ax.get_ylabel() == "gap $h$ at the section"
    assert at_value(ax, 0.0, along="x")
    chaos = gm.Scene.catalogue("mems_scenario3").graze().map()
    counts: dict[str, Any] = {"points": 25, "transient": 50, "keep": 200}
    diagram = gm.diagram(chaos, "V", (0, 5e-5), direction="up", **counts)
    assert diagram.points()[0].size > 4000
    (cloud,) = (line for line in diagram.plot().lines if line.get_marker() == "o")
    assert cloud.get_rasterized()
    assert finite(cloud) == diagram.points()[0].size


def test_a_diagram_says_what_left_and_what_is_outside(m: gm.Map) -> None:
    diagram = gm.diagram(
        m, "alpha", (-1e-4, 2e-4), points=12, transient=50, keep=5, method=["guarded", "map"]
    )
    left = np.isin(diagram["end"], ["escaped", "no image"])
    ax = diagram.plot()
    assert {"guarded, up", "guarded, down"} < set(words(ax))
    assert ("escaped" in words(ax)) == bool(left.any())
    assert left.any() or (diagram["end"] == "outside").any()
    assert finite(ax.lines[-2 if at_value(ax, 0.0, along="x") else -1]) == left.sum()


def test_a_logarithmic_sweep_has_a_logarithmic_axis(m: gm.Map) -> None:
    keys: dict[str, Any] = {"points": 6, "scale": "log", "transient": 50, "keep": 5}
    assert gm.diagram(m, "alpha", (1e-6, 1e-3), **keys).plot().get_xscale() == "log"
    assert gm.diagram(m, "alpha", (-1e-3, -1e-6), **keys).plot().get_xscale() == "symlog"


def test_a_grazing_curve_has_rings_where_a_condition_vanishes() -> None:
    curve = gm.curve(gm.Scene.catalogue("mems_codim2"), "omega", (0.4876, 0.488))
    ax = curve.plot()
    assert words(ax) == ["stable without the stop"]
    assert (ax.get_xlabel(), ax.get_ylabel()) == (r"$\omega$", "$V$")
    assert [finite(line) for line in ax.lines[1:]] == [1]
    assert [text.get_text() for text in ax.texts] == [r"$\xi_{1} = 0$"]
    ax = curve.plot(y="xi_1")
    assert [float(np.ravel(line.get_ydata())[0]) for line in ax.lines[1:]] == [0, 0]


def test_noise_is_an_image_and_images_are_points(m: gm.Map) -> None:
    spread = gm.noise(m, {"alpha": 1e-6}, at={"alpha": -1e-4}, orbits=5, keep=10, cells=8, seed=1)
    ax = spread.plot()
    assert np.asarray(ax.images[0].get_array()).shape == (8, 8)
    assert len(ax.figure.axes) == 2
    ax = gm.image(m, [[1e-5, 0.0]], None, 4).plot()
    assert words(ax) == ["outside the window", "inside the window"]
    assert sum(map(finite, ax.lines)) == 4


def test_a_fit_is_drawn_with_its_confidence(m: gm.Map) -> None:
    rng = np.random.default_rng(1)
    starts = rng.uniform(-1e-5, 1e-5, (20, 2))
    truth = [-2e-6, 1e-6]
    series = np.concatenate([starts[:, None], m.iterate(starts, truth, 2)], axis=1)
    series += rng.normal(size=series.shape) * 1e-9
    found = gm.fit(m, series, ["alpha", "omega"])
    ax = found.plot()
    assert words(ax) == ["68 % confidence", "95 % confidence", "fit"]
    inner, outer, centre = ax.lines
    assert np.ptp(outer.get_xdata()) > np.ptp(inner.get_xdata()) > 0
    half = np.sqrt(-2 * np.log(1 - 0.95)) * found.errors["alpha"]
    assert np.ptp(outer.get_xdata()) == pytest.approx(2 * half, rel=1e-3)
    assert np.ravel(centre.get_xydata()) == pytest.approx(found["offset"])
    assert found.plot(x="omega").get_ylabel() == r"$\alpha - \alpha^*$"
    with pytest.raises(gm.InputError, match=r"x: expected a fitted parameter \(alpha, omega\)"):
        found.plot(x="delta")


def test_a_plot_of_safety_has_a_row_for_every_parameter_and_attractor() -> None:
    found = gm.Scene.catalogue("linear").replace(alpha=2.0).safe({"alpha": 0.05}, points=4)
    names = [one["orbit"] for one in found.attractors]
    assert "(1,1)" in names
    assert all(one["from"] and one["to"] for one in found.attractors)
    ax = found.plot()
    assert [row.get_text() for row in ax.get_yticklabels()] == [r"$\alpha$", r"$\omega$", *names]
    assert words(ax) == ["without contact", "tolerance", r"attractor, along $\alpha$"]
    graze = 100 * (found["graze above"][0] / 2.0 - 1)
    assert any(graze == pytest.approx(np.asarray(line.get_xdata())[-1]) for line in ax.lines)
    assert finite(found.plot(x="value", y="graze above").lines[0]) == 2


@pytest.mark.parametrize("name", ["branch", "loci", "chart", "basin", "impacts"])
def test_a_plot_is_drawn_on_given_axes(name: str, request: pytest.FixtureRequest) -> None:
    table = request.getfixturevalue(name)
    figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3), layout="constrained")
    assert table.plot(right) is right
    assert table.plot(ax=left, alpha=0.5) is left
    figure.canvas.draw()
    for ax in (left, right):
        box, room = ax.get_window_extent(), figure.bbox
        assert room.x0 < box.x0 < box.x1 < room.x1
        assert box.width > 0.2 * room.width


@pytest.mark.parametrize(
    "made",
    [
        lambda m: gm.orbits(m, {"alpha": 1e-6}, itineraries=["1"]),
        lambda m: gm.nearest(m, ["alpha"]),
        lambda m: m.polynomials,
    ],
    ids=["orbits", "nearest", "polynomials"],
)
def test_a_table_without_a_plot_names_its_columns(
    m: gm.Map, made: Callable[[gm.Map], gm.Table]
) -> None:
    table = made(m)
    known = [name for name, column in table.items() if column.dtype != object]
    with pytest.raises(gm.InputError, match=re.escape(f"({', '.join(known)})")) as caught:
        table.plot()
    assert "no plot of its own" in str(caught.value)
    assert not plt.get_fignums()
    if len(known) > 1:
        ax = table.plot(x=known[0], y=known[1])
        assert finite(ax.lines[0]) <= table[known[0]].size


def test_nothing_is_drawn_of_an_empty_result(m: gm.Map, branch: gm.Branch, loci: gm.Loci) -> None:
    empty = gm.branch(m, "alpha", (1e-5, 1e-4), itineraries=["0"], on_empty="return")
    assert empty.ended is not None
    with pytest.raises(gm.NoResult, match="nothing to plot: no branch with a physical orbit"):
        empty.plot()
    virtual = copy.deepcopy(branch)
    virtual["physical"][:] = 0
    with pytest.raises(gm.NoResult, match="all orbits are virtual; virtual=True draws them"):
        virtual.plot()
    assert virtual.plot(virtual=True).lines
    left = gm.diagram(m, "alpha", (1e-5, 1e-4), points=3, transient=5, keep=3, direction="up")
    for name in left:
        if name.startswith("value_"):
            left[name][:] = np.nan
    left["end"][:] = "escaped"
    with pytest.raises(gm.NoResult, match=r"all 3 orbits ended early \(escaped\)"):
        left.plot()
    folds = gm.loci(m, ("omega", "alpha"), kind="fold", itineraries=["1"], on_empty="return")
    with pytest.raises(gm.NoResult, match="nothing to plot: no fold"):
        folds.plot()
    flat = copy.deepcopy(loci)
    flat._text = flat._text.replace('"kind": "graze"', '"kind": "torus"')
    with pytest.raises(gm.InputError, match="from_graze: these loci hold no graze"):
        flat.plot(from_graze=True)
    assert len(plt.get_fignums()) == 1
