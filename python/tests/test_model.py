"""Scenes from Python values."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import grazemap as gm

PARAMETERS = {"zeta": 0.05, "delta": 1.0, "r": 0.8, "alpha": 2.25, "omega": 1.8}


def made(**changes: Any) -> gm.Scene:
    """Make the scene `linear` of the catalogue."""
    values: dict[str, Any] = {
        "states": ["x", "v"],
        "flow": {"x": "v", "v": "alpha*cos(theta) - 2*zeta*v - x"},
        "stops": gm.Rigid("delta - x", restitution="r"),
        "phase": gm.Phase("theta", rate="omega"),
        "parameters": PARAMETERS,
        "solve_for": "alpha",
        "guess": {"x": 1.0, "v": 0.0, "theta": 3.061},
        "active": ["alpha", "omega"],
        "smooth_order": 5,
        "contact_weight": 6,
        "window": {"depth": 1e-3, "x": 1e-3, "theta": 0.05, "alpha": 1e-3, "omega": 1e-3},
        "name": "made",
    }
    return gm.Scene(**{**values, **changes})


def test_a_scene_from_values_is_the_scene_of_the_file() -> None:
    scene, expected = made(), gm.Scene.catalogue("linear")
    assert scene.name == "made"
    assert scene.parameters == expected.parameters
    assert scene.graze().state == expected.graze().state
    states = np.random.default_rng(1).uniform(-1e-5, 1e-5, (20, 2))
    assert np.array_equal(scene.map()(states), expected.map()(states))
    assert scene.map().window == expected.map().window
    assert gm.Scene.parse(scene.text, "made.toml") == scene


def test_a_scene_from_values_can_be_saved(tmp_path: Any) -> None:
    made().save(tmp_path / "made.toml")
    assert gm.Scene.load(tmp_path / "made.toml").text == made().text


def test_a_soft_stop_a_moving_stop_and_several_stops_are_written() -> None:
    soft = made(
        stops=gm.Compliant("delta - x", contact={"v": "free - 33*(x - delta)"}), window=None
    )
    assert 'contact = { v = "free - 33*(x - delta)" }' in soft.text
    wall = {"wall": "delta + 0.1*cos(theta)", "speed": "-0.1*omega*sin(theta)"}
    moving = made(let=wall, stops=gm.Rigid("wall - x", restitution="r", velocity="speed"))
    assert 'impact = { v = "-r*v + (1 + r)*speed" }' in moving.text
    both = made(
        stops=[
            gm.Rigid("delta - x", restitution="(r + r)/2", name="right"),
            gm.Rigid("delta + x", impact={"v": "-r*v"}),
        ],
        surface="right",
    )
    assert 'impact = { v = "-((r + r)/2)*v" }' in both.text
    assert 'name = "stop2"' in both.text


WRONG: list[tuple[dict[str, Any], type[Exception], str]] = [
    ({"flow": {"x": "v", "v": "vv"}}, gm.SceneError, r"flow\['v'\]: unknown variable `vv`"),
    ({"flow": {"x": "v"}}, gm.SceneError, "flow"),
    ({"flow": "v"}, gm.InputError, "flow: expected expressions by name"),
    ({"parameters": {**PARAMETERS, "r": "1/"}}, gm.SceneError, r"parameters\['r'\]: "),
    ({"solve_for": "alhpa"}, gm.SceneError, "solve_for: unknown parameter `alhpa`.*`alpha`"),
    ({"active": ["zta"]}, gm.SceneError, "active: unknown parameter `zta`"),
    ({"section": "tangential"}, gm.SceneError, "section: "),
    ({"stops": gm.Rigid("delta - y", restitution="r")}, gm.InputError, r"stops\[0\].restitution"),
    ({"stops": gm.Rigid("delta - x")}, gm.InputError, r"stops\[0\]: expected `restitution` or"),
    ({"stops": ["delta - x"]}, gm.InputError, r"stops\[0\]: expected a grazemap.Rigid"),
    (
        {"stops": gm.Rigid("delta + cos(theta) - x", restitution="r")},
        gm.InputError,
        r"stops\[0\].velocity: the stop moves",
    ),
    (
        {"stops": gm.Rigid("delta - x", impact={"v": "-q*v"})},
        gm.SceneError,
        r"stops\[0\].impact: unknown variable `q`",
    ),
    ({"phase": "theta"}, gm.InputError, "phase: expected a grazemap.Phase"),
]


@pytest.mark.parametrize(("changes", "kind", "message"), WRONG)
def test_a_fault_names_the_argument(
    changes: dict[str, Any], kind: type[Exception], message: str
) -> None:
    with pytest.raises(kind, match=f"^{message}"):
        made(**changes)


def test_expressions_of_sympy_are_those_of_text() -> None:
    sympy = pytest.importorskip("sympy")
    x, v, theta, delta, r = sympy.symbols("x v theta delta r")
    zeta, alpha, omega = sympy.symbols("zeta alpha omega")
    scene = made(
        states=[x, v],
        flow={x: v, v: alpha * sympy.cos(theta) - 2 * zeta * v - x},
        stops=gm.Rigid(delta - x, restitution=r),
        phase=gm.Phase(theta, rate=omega, period=2 * sympy.pi),
        solve_for=alpha,
        active=[alpha, omega],
        parameters={zeta: sympy.Rational(1, 20), delta: 1, r: 0.8, alpha: 2.25, omega: 1.8},
    )
    assert scene.map()([1e-6, 0.0]).tolist() == pytest.approx(made().map()([1e-6, 0.0]).tolist())
    time, position = sympy.Symbol("t"), sympy.Function("x")
    force = alpha * sympy.cos(theta) + sympy.Max(x, v, delta) - abs(x) ** 3 / 7
    force += sympy.exp(1) + 0.1 * sympy.sqrt(r) - position(time) ** 2
    text = made(flow={"x": "v", "v": force}).text
    assert "abs(x)^3/7" in text
    assert "0.1*sqrt(r)" in text
    assert "max(" in text
    assert "- x^2" in text
