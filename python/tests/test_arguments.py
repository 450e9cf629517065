"""Arguments: one name for one thing, and errors that name them."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import pytest

import grazemap as gm

if TYPE_CHECKING:
    from collections.abc import Callable

#: Functions whose first argument is a scene, a graze or a map.
COMMANDS = [
    "basin",
    "branch",
    "chart",
    "contact",
    "converge",
    "curve",
    "derivatives",
    "diagram",
    "fit",
    "image",
    "loci",
    "nearest",
    "noise",
    "orbits",
    "report",
    "safe",
    "trajectory",
]


@pytest.fixture(scope="module")
def m() -> gm.Map:
    return gm.Scene.catalogue("linear").graze().map()


RANGES = ((-1e-4, 1e-4), (-1e-4, 1e-4))

#: Wrong calls, and the beginning of the message.
WRONG: list[tuple[Callable[[Any], object], str]] = [
    (lambda m: m.diagram("zta", (-1e-4, 1e-4)), "along: no active parameter `zta`"),
    (lambda m: m.diagram("zeta", (-1e-4, 1e-4)), "along: `zeta` is not active in this map"),
    (lambda m: m.diagram("alpha"), "span: expected the first and the last"),
    (lambda m: m.diagram("alpha", (1e-4, -1e-4)), "span: expected a smaller number and a larger"),
    (lambda m: m.diagram("alpha", (0, 1, 2)), "span: expected two numbers"),
    (lambda m: m.diagram("alpha", (float("nan"), 1)), "span: expected a finite number"),
    (lambda m: m.diagram("alpha", (-1, 1), points=-5), "points: expected a whole number from 1"),
    (lambda m: m.diagram("alpha", (-1, 1), points=2.5), "points: expected a whole number from 1"),
    (lambda m: m.diagram("alpha", values=[1, "x"]), r"values\[1\]: expected a finite number"),
    (lambda m: m.diagram("alpha", (-1, 1), start=0), "start: expected a whole number from 1"),
    (lambda m: m.diagram("alpha", (-1, 1), start={"q": 1}), "start: no coordinate of the section"),
    (lambda m: m.diagram("alpha", (-1, 1), scale="lug"), "scale is one of linear, log, .* `log`"),
    (lambda m: m.diagram("alpha", (-1, 1), direction="sideways"), "direction is one of both"),
    (lambda m: m.diagram("alpha", (-1e-4, 1e-4), observe="vv"), "observe: unknown variable `vv`"),
    (lambda m: m.chart(("alpha", "x"), RANGES), "plane: no active parameter `x`"),
    (lambda m: m.chart(("alpha", "alpha"), RANGES), "plane: expected two different names"),
    (lambda m: m.chart(("alpha", "omega"), (0, 1)), r"spans\[0\]: expected two numbers"),
    (lambda m: m.chart(("alpha", "omega"), RANGES, points=(1, 2, 3)), "points: expected a whole"),
    (lambda m: m.chart(("alpha", "omega"), RANGES, device="tpu"), "device is one of cpu, cuda"),
    (lambda m: m.basin(("x", "q")), "plane: no coordinate of the section `q`"),
    (lambda m: m.basin(at={"alpha": "x"}), r"at\['alpha'\]: expected a finite number"),
    (lambda m: m.basin(at=3), "at: expected numbers by name"),
    (lambda m: m.branch(["alpha", "omega"]), "along: expected a text"),
    (lambda m: m.diagram(["alpha"], (-1, 1)), "along: expected a text"),
    (
        lambda m: m.diagram("alpha", (-1e-5, 1e-5), scale="log"),
        "diagram: a logarithmic scale needs both ends of `span` on one side of 0",
    ),
    (lambda m: m.branch("alhpa"), r"along: the map has no variable `alhpa`.*`alpha`"),
    (lambda m: m.branch("alpha", method="magic"), "method is one of map, direct"),
    (lambda m: m.branch("alpha", itineraries=1), "itineraries: expected a text or a list"),
    (lambda m: m.branch("alpha", period=300), "period: expected a whole number from 1 to 12"),
    (lambda m: m.branch("alpha", (1e-5, -1e-5)), "span: expected a smaller number and a larger"),
    (lambda m: m.branch("alpha", (0, 0)), "span: expected a smaller number and a larger"),
    (lambda m: m.branch("alpha", at={"alpha": 1e-5}), "at names `alpha`, which varies"),
    (lambda m: m.loci(("omega", "alpha"), (1e-5, -1e-5)), "span: expected a smaller number"),
    (lambda m: m.loci(("omega", "alpha"), at={"omega": 0}), "at names `omega`, which varies"),
    (lambda m: m.orbits(itineraries="1", period=2), "period and itineraries are both given"),
    (lambda m: m.orbits(plane="alpha"), "plane needs folds or flips to find"),
    (lambda m: m.orbits(kind="fold", span=(0, 1)), "span: that of the first of two parameters"),
    (lambda m: m.orbits(kind="fold", points=1), "points: expected a whole number from 2"),
    (lambda m: m.chart(("alpha", "omega"), RANGES, itineraries="1"), "itineraries: those of loci"),
    (lambda m: m.basin(start={"x": 1e-3}), "start names `x`, which varies"),
    (lambda m: m.trajectory(itinerary="1", start={"x": 0}), "start and itinerary are both given"),
    (lambda m: m.derivatives(parameters=["r", "r"]), "parameters names `r` twice"),
    (lambda m: m.derivatives(at=1.0, returns=2), "at and returns are both given"),
    (lambda m: m.noise({"alpha": -1e-6}), "deviations must not be negative"),
    (lambda m: m.noise({"alpha": 1e-6}, progress="bar"), "progress: expected a truth value or a"),
    (lambda m: m.branch("alpha", client="here"), "client: expected a Dask client, found 'here'"),
    (lambda m: m.branch("alpha", observe="gap"), "observe is one of h, impact_speed"),
    (lambda m: m.loci(("omega", "alpha"), kind="foldd"), "kind is one of graze, .* `fold`"),
    (lambda m: m.orbits(kind="graze"), "kind is one of fold, flip"),
    (lambda m: m.orbits(on_empty="shrug"), "on_empty is one of raise, return"),
    (lambda m: m.curve("omgea", (1.7, 1.9)), "along: no parameter of the scene `omgea`.*`omega`"),
    (lambda m: m.nearest("q"), "parameters: no parameter of the scene `q`"),
    (lambda m: m.nearest("alpha", scale={"q": 1}), "scale: no parameter of the scene `q`"),
    (lambda m: m.contact("hard"), "restitution: expected a finite number"),
    (lambda m: m.contact(1.5), "restitution must be from 0.01 to 1, found 1.5"),
    (lambda m: m.contact(0.8, time=1, stiffness=1), "time and stiffness are both given"),
    (lambda m: m.safe({"q": 0.1}), "tolerance: no parameter of the scene `q`"),
    (lambda m: m.safe(points=-1), "points: expected a whole number from 0"),
    # Beyond these sizes the process ended without an exception.
    (lambda m: m.safe(points=10**9), "points: expected a whole number from 0 to 1000"),
    (lambda m: m.converge(fresh=10**9), "fresh: expected a whole number from 0 to 10000000"),
    (lambda m: m.trajectory(itinerary=10), "itinerary: expected a text"),
    (lambda m: m.trajectory(samples=-1), "samples: expected a whole number"),
    (lambda m: m.iterate([0, 0], iterations=-1), "iterations: expected a whole number from 1"),
    (lambda m: m.iterate([0, "x"]), "states: expected an array of numbers"),
    (lambda m: m.iterate([0, 0, 0]), "states: a state has 2 coordinates"),
    (lambda m: m([0, 0], [1]), "parameters: expected one row of 2 parameters"),
    (lambda m: m.noise({"q": 1}), "deviations: no active parameter `q`"),
    (lambda m: m.noise({"alpha": 1e-6}, spans={"q": (0, 1)}), "spans: no coordinate"),
    (lambda m: m.noise({"alpha": 1e-6}, seed=-1), "seed: expected a whole number from 0"),
    (lambda m: m.fit([[0, 0]], "alpha", piece=-1), "piece: expected a whole number from 0"),
    (lambda m: m.fit([[0]], "alpha"), "data: a series has rows of 2 coordinates"),
    (lambda m: m.fit([[0, 0]], "alpha", controls={"omega": [1, 2]}), r"controls\['omega'\]: "),
    (lambda m: m.fit([["a", "b"]], "alpha"), "data: expected an array of numbers"),
    (lambda m: m.fit([[0, 0]], "alpha", controls={"omega": "x"}), r"controls\['omega'\]: "),
    (lambda m: m.graze.scene.replace(alpha=m), "alpha: expected a number, text, list or mapping"),
    (lambda _: cast("Any", gm.diagram)("linear", "alpha"), "source: expected a Scene, a Graze or"),
    (lambda _: gm.Scene.catalogue("linaer"), "name: no scene `linaer`.*did you mean `linear`"),
]


@pytest.mark.parametrize(("call", "message"), WRONG)
def test_an_error_names_the_argument(
    m: gm.Map, call: Callable[[gm.Map], object], message: str
) -> None:
    with pytest.raises(gm.InputError, match=f"^{message}"):
        call(m)


@pytest.mark.parametrize("kind", [gm.Scene, gm.Graze, gm.Map])
def test_every_command_is_a_method(kind: type) -> None:
    for name in COMMANDS:
        assert getattr(kind, name) is getattr(gm, name)
        assert next(iter(inspect.signature(getattr(gm, name)).parameters)) == "source"


@pytest.mark.parametrize("name", [*COMMANDS, "gallery", "scenes"])
def test_a_docstring_has_every_argument(name: str) -> None:
    function = getattr(gm, name)
    text = inspect.getdoc(function) or ""
    for section in ("Returns", "Examples"):
        assert f"\n{section}\n---" in text
    for argument in inspect.signature(function).parameters:
        assert f"\n{argument}\n" in text, argument


def test_no_argument_shadows_a_builtin() -> None:
    import builtins

    for name in COMMANDS:
        assert not set(inspect.signature(getattr(gm, name)).parameters) & set(dir(builtins))


def test_a_scene_and_a_graze_serve_as_well_as_a_map(m: gm.Map) -> None:
    scene = gm.Scene.catalogue("linear")
    call = ("alpha", (-1e-4, 1e-4))
    expected = m.diagram(*call, points=3)
    for source in (scene, scene.graze()):
        assert np.array_equal(source.diagram(*call, points=3)["value_1"], expected["value_1"])
    assert scene.graze() is scene.graze()
    assert scene.map() is scene.graze().map()
    # Of a scene a parameter is made active.
    assert scene.diagram("delta", (-1e-5, 1e-5), points=2)["parameter"][0] == "delta"


def test_one_text_is_a_list_of_one(m: gm.Map) -> None:
    one, several = (m.branch("alpha", (-1e-5, 1e-5), itineraries=way) for way in ("1", ["1"]))
    assert np.array_equal(one["x"], several["x"])
    assert m.nearest("alpha").document == m.nearest(["alpha"]).document
    assert set(m.loci(("omega", "alpha"), (-1e-5, 1e-5), kind="graze")["kind"]) == {"graze"}


def test_starts_are_a_number_or_offsets(m: gm.Map) -> None:
    call = ("alpha", (-1e-4, 1e-4))
    spread = m.diagram(*call, points=2, start=2)
    assert np.array_equal(
        cast("Any", gm.diagram)(m, *call, points=2, starts=2)["offset"], spread["offset"]
    )
    assert len(set(spread["start"])) == 2
    one = m.diagram(*call, points=2, start={"x": -1e-4}, direction="up")
    assert len(one["offset"]) == 2


def test_results_answer_the_question_of_an_engineer() -> None:
    scene = gm.Scene.catalogue("linear")
    near = scene.nearest("alpha")
    assert near.margin < 0
    assert not near.clears
    assert set(near.sensitivities) == set(near.parameters) == set(scene.parameters)
    assert scene.replace(alpha=2.2).nearest("alpha").clears
    branch = scene.branch("alpha", (-1e-4, 1e-4), itineraries="1")
    (stable,) = branch.stable_ranges
    assert (stable.name, stable.first, stable.last_label) == ("(0,1)", -1e-4, "GR")
    assert abs(stable.last) < 1e-12
    assert abs(stable.last_value - scene.graze().parameters["alpha"]) < 1e-12
    assert gm.__version__
    with pytest.raises(AttributeError):
        gm.nothing  # noqa: B018
