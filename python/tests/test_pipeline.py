"""From scene to map: values, errors, arrays."""

from __future__ import annotations

import copy
import pickle
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import grazemap as gm

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(scope="module")
def m() -> gm.Map:
    return gm.Scene.catalogue("linear").graze().map()


def test_the_catalogue_is_named() -> None:
    assert {"linear", "mems", "foale"} <= set(gm.scenes())
    assert gm.catalogue() == gm.scenes()
    assert gm.catalogue("linear") == gm.Scene.catalogue("linear")
    with pytest.raises(gm.InputError, match=r"no scene `lineer` .*did you mean `linear`"):
        gm.Scene.catalogue("lineer")


def test_a_fault_has_its_place(tmp_path: Path) -> None:
    text = gm.Scene.catalogue("linear").text.replace("parameters", "parametres", 1)
    line = next(i for i, row in enumerate(text.splitlines(), 1) if "parametres" in row)
    with pytest.raises(gm.SceneError, match="parametres") as caught:
        gm.Scene.parse(text, "mine.toml")
    assert (caught.value.file, caught.value.line) == ("mine.toml", line)
    assert pickle.loads(pickle.dumps(caught.value)).line == line  # noqa: S301
    with pytest.raises(gm.SceneError, match=r"none\.toml"):
        gm.Scene.load(tmp_path / "none.toml")


def test_overrides_are_parameters_and_keys() -> None:
    scene = gm.Scene.catalogue("linear").replace(zeta=0.1, **{"expansion.smooth_order": 3})
    assert scene == gm.Scene.catalogue("linear").with_(zeta=0.1, **{"expansion.smooth_order": 3})
    assert scene.parameters["zeta"] == 0.1
    assert scene.graze().map().orders[0] == 3
    with pytest.raises(gm.SceneError, match="zta"):
        scene.replace(zta=0.1)


def test_no_orbit_is_no_wrong_input() -> None:
    text = gm.Scene.catalogue("linear").text
    scene = gm.Scene.parse(text, "linear.toml").with_(**{"grazing.periods": 2})
    with pytest.raises(gm.GrazemapError):
        scene.graze()


def test_a_graze_is_data() -> None:
    graze = gm.Scene.catalogue("linear").graze()
    assert set(graze.parameters) == set(graze.scene.parameters)
    assert np.abs(np.prod(graze.multipliers) - np.linalg.det(graze.document["monodromy"])) < 1e-12
    assert graze.xi.shape == (6,)
    assert "xi" in graze.verdict or "contact" in graze.verdict


def test_values_are_pickled_compared_and_shown(m: gm.Map) -> None:
    for value in (m.graze.scene, m.graze, m):
        again = pickle.loads(pickle.dumps(value))  # noqa: S301
        assert again == value
        assert hash(again) == hash(value)
        assert copy.deepcopy(value) == value
        assert "linear" in repr(value)
    assert m != gm.Scene.catalogue("linear").with_(zeta=0.1).graze().map()
    states = np.array([[1e-6, 2e-6], [0.0, -1e-6]])
    assert np.array_equal(pickle.loads(pickle.dumps(m))(states), m(states))  # noqa: S301


def test_images_have_the_shape_of_the_states(m: gm.Map) -> None:
    rng = np.random.default_rng(1)
    states = rng.uniform(-1e-5, 1e-5, (4, 5, 2))
    parameters = rng.uniform(-1e-7, 1e-7, (4, 5, 2))
    images = m(states, parameters)
    assert images.shape == (4, 5, 2)
    for place in np.ndindex(4, 5):
        assert np.array_equal(m(states[place], parameters[place]), images[place])
    assert np.array_equal(m(states), m(states, [0.0, 0.0]))
    assert m(states[:0]).shape == (0, 5, 2)
    with pytest.raises(gm.InputError, match="2 coordinates"):
        m([1.0, 2.0, 3.0])
    with pytest.raises(gm.InputError, match="2 parameters"):
        m(states, [1.0])


def test_the_jacobian_is_that_of_differences(m: gm.Map) -> None:
    state, step = np.array([3e-5, 1e-5]), 1e-10
    assert m.depths(state)[0] > 0
    for parameters in ([1e-7, -1e-7], [[1e-7, -1e-7]]):
        derivatives = m.jacobian(state, parameters)
        assert derivatives.shape == (2, 4)
    own = np.array([1e-7, -1e-7])
    for column in range(4):
        shift = np.eye(4)[column] * step
        ahead = m(state + shift[:2], own + shift[2:])
        behind = m(state - shift[:2], own - shift[2:])
        difference = (ahead - behind) / (2 * step)
        assert np.allclose(derivatives[:, column], difference, rtol=1e-4, atol=1e-5)


def test_the_map_is_direct_simulation_inside_its_window(m: gm.Map) -> None:
    rng = np.random.default_rng(2)
    widths = np.array([m.window[name] for name in m.coordinates])
    bounds = np.array([m.window[name] for name in m.parameters])
    assert np.isfinite(widths).all()
    states = rng.uniform(-widths, widths, (50, 2))
    parameters = rng.uniform(-bounds, bounds, (50, 2))
    held = m.inside(states, parameters)
    assert held.any()
    by_map = m(states, parameters)[held]
    direct = m.iterate(states[held], parameters[held], method="direct")[:, 0]
    errors = np.nanmax(np.abs(by_map - direct), axis=0)
    allowed = [m.error[name] for name in m.coordinates]
    assert (errors <= 2 * np.array(allowed)).all()
    assert not m.inside([1e3, 0.0])


def test_orbits_are_images_of_images(m: gm.Map) -> None:
    states = np.array([[1e-6, 0.0], [2e-6, 1e-6], [0.0, 0.0]])
    orbits = m.iterate(states, [1e-7, 0.0], 5)
    assert orbits.shape == (3, 5, 2)
    for iterate in range(5):
        states = m(states, [1e-7, 0.0])
        assert np.array_equal(orbits[:, iterate], states)
    assert m.iterate([1e-6, 0.0], None, 4, method="guarded").shape == (4, 2)
    with pytest.raises(gm.InputError, match="method is one of map, guarded"):
        m.iterate(states, method="magic")  # type: ignore[arg-type]


def test_coefficients_have_names(m: gm.Map) -> None:
    table = m.polynomials
    assert len(table) > 3
    assert len({column.size for column in table.values()}) == 1


def test_a_map_is_saved_as_the_program_does(m: gm.Map, tmp_path: Path) -> None:
    m.save(tmp_path / "map.json")
    assert gm.Map.load(tmp_path / "map.json") == m
    with pytest.raises(gm.InputError, match="no saved orbit or map"):
        gm.Map.from_json("{}")


def test_emitted_code_gives_the_same_numbers(m: gm.Map, tmp_path: Path) -> None:
    (path,) = m.emit(tmp_path, "python", measure=False)
    names: dict[str, Any] = {}
    exec(compile(path.read_text(), path, "exec"), names)  # noqa: S102
    rng = np.random.default_rng(3)
    states = rng.uniform(-1e-5, 1e-5, (100, 2))
    parameters = rng.uniform(-1e-7, 1e-7, (100, 2))
    image, depths = names["step"](states.T, parameters.T)
    assert np.array_equal(np.stack(image, axis=1), m(states, parameters))
    assert np.array_equal(depths[0], m.depths(states, parameters)[:, 0])
    assert names["MEASURED_ERROR"] is None
    with pytest.raises(gm.InputError, match="target is one of rust"):
        m.emit(tmp_path, "cobol")
    path.write_text("mine")
    with pytest.raises(gm.InputError, match="not emitted by grazemap"):
        m.emit(tmp_path, "python", measure=False)


def test_notebooks_show_scenes_orbits_and_maps(m: gm.Map) -> None:
    scene = gm.Scene.parse(gm.Scene.catalogue("linear").text + "\n# <script>", "a.toml")
    shown = scene._repr_html_()
    assert "&lt;script&gt;" in shown
    assert "<script>" not in shown
    for value, word in ((m.graze, "theory"), (m, "error in x")):
        shown = value._repr_html_()
        assert shown.startswith("<svg")
        assert word in shown
