"""Returns as functions that JAX and PyTorch differentiate: their own checks of gradients."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import grazemap as gm
from grazemap._differentiable import DirectReturn, MapReturn

#: Start and parameters of `linear` from which the stop is hit once in a period.
START, VALUES, NAMES = [0.0, 3.0, 0.0], [0.8, 2.2], ["r", "alpha"]
#: Offsets from which the passage of `linear` is a contact.
STATE, OFFSETS = [1e-6, 1e-5], [1e-6, 0.0]


@pytest.fixture(scope="module")
def scene() -> gm.Scene:
    return gm.Scene.catalogue("linear")


#: PyTorch warns of its own use of what it deprecates.
deprecated = pytest.mark.filterwarnings("ignore:.torch.jit.script. is deprecated:FutureWarning")


def with_jax() -> Any:
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    return jax


def test_derivatives_by_parameters_are_in_the_order_asked_for(scene: gm.Scene) -> None:
    rows = np.array([[*START, *VALUES], [*START, 0.7, 2.2]])
    values, gradients, hessians = DirectReturn(scene, NAMES, 1, None).jets(rows, 2)
    assert (values.shape, gradients.shape, hessians.shape) == ((2, 3), (2, 3, 5), (2, 3, 5, 5))
    swapped = DirectReturn(scene, NAMES[::-1], 1, None).jets(rows[:, [0, 1, 2, 4, 3]], 2)
    order = np.array([0, 1, 2, 4, 3])
    assert np.array_equal(swapped[0], values)
    assert np.array_equal(swapped[1][..., order], gradients)
    assert np.array_equal(swapped[2][..., order, :][..., order], hessians)
    # Differences of the values at another restitution.
    assert np.allclose(values[0] - values[1], 0.1 * gradients[0, :, 3], rtol=0.1)


def test_the_map_and_simulation_have_the_same_derivatives(scene: gm.Scene) -> None:
    fixed = scene.replace(**{"section.kind": "stroboscopic", "section.phase": 0.5})
    by_map = MapReturn(fixed)
    graze = fixed.graze()
    point = [*fixed.map().graze.document["section"]["point"], 0.5]
    names = by_map.parameters
    origin = np.array([*point, *(graze.parameters[name] for name in names)])
    for offsets, hits in (([-1e-5, 0.0, 0.0, 0.0], False), ([1e-5, 0.0, 2e-6, 0.0], True)):
        row = np.array(offsets)
        assert (fixed.map().depths(row[:2], row[2:]) > 0).all() == hits
        images, jacobian = by_map.jets(row, 1)
        by_simulation = DirectReturn(fixed, names, 1, None)
        values, gradients = by_simulation.jets(origin + np.insert(row, 2, 0.0), 1)
        assert np.allclose(images + point[:2], values[:2], rtol=0, atol=1e-9)
        own = gradients[:2][:, [0, 1, 3, 4]]
        assert np.allclose(jacobian, own, rtol=1e-5, atol=1e-6)


def test_a_value_and_its_derivative_cost_one_flight(
    scene: gm.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    flights = []
    whole = gm.Scene.derivatives

    def counted(*given: Any, **keys: Any) -> gm.Derivatives:
        flights.append(keys["order"])
        return whole(*given, **keys)

    monkeypatch.setattr(gm.Scene, "derivatives", counted)
    direct = DirectReturn(scene, NAMES, 1, None)
    row = np.array([*START, *VALUES])
    for order in (0, 1, 0):
        direct.jets(row, order)
    assert flights == [1]


@pytest.mark.parametrize(
    ("order", "row", "error", "message"),
    [
        (1, [0.0] * 4, gm.NoResultError, r"states: passage 1 grazes \(its depth is 0\)"),
        (2, [0.0] * 4, gm.InputError, "derivatives of this return exist to order 1, not to 2"),
    ],
)
def test_a_map_refuses_derivatives_that_do_not_exist(
    scene: gm.Scene, order: int, row: list[float], error: type[gm.GrazemapError], message: str
) -> None:
    with pytest.raises(error, match=message):
        MapReturn(scene).jets(np.array(row), order)


def test_a_value_that_the_scene_refuses_is_that_of_a_parameter(scene: gm.Scene) -> None:
    with pytest.raises(gm.InputError, match=r"^parameters: restitution -0.2 of surface `stop`"):
        DirectReturn(scene, "r", 1, None).jets(np.array([*START, -0.2]), 1)


def test_a_trajectory_that_grazes_has_no_derivative(scene: gm.Scene) -> None:
    graze = scene.graze()
    # A quarter of a period before the graze, on the grazing orbit.
    before = scene.replace(
        **{"section.kind": "stroboscopic", "section.phase": graze.state["theta"] - np.pi / 2}
    )
    section = before.map().graze.document["section"]
    row = np.array([*section["point"], section["phase"], graze.parameters["alpha"]])
    with pytest.raises(gm.NoResultError, match="the trajectory grazes `stop` at t = "):
        DirectReturn(before, "alpha", 1, None).jets(row, 1)
    start = dict(zip(["x", "v", "theta"], row[:3], strict=True))
    found = scene.replace(alpha=graze.parameters["alpha"]).derivatives(start, at=3.0, sides=True)
    assert found.graze is not None
    assert found.graze["surface"] == "stop"
    assert abs(found.graze["gap"]) < 1e-12
    assert found.graze["root"]["v"]["value"] != 0
    assert scene.replace(alpha=1.0).derivatives(start, at=1.0, sides=True).graze is None


@pytest.mark.parametrize("library", ["jax", "torch"])
def test_a_shape_that_does_not_fit_is_refused(scene: gm.Scene, library: str) -> None:
    pytest.importorskip(library)
    returned = getattr(gm, library).map_return(scene)
    with pytest.raises(gm.InputError, match=r"^states: expected an array of shape \(\.\.\., 2\)"):
        returned(np.zeros(3))
    with pytest.raises(gm.InputError, match=r"^parameters: expected an array of shape"):
        returned(np.zeros(2), np.zeros(1))
    with pytest.raises(gm.InputError, match=r"^parameters: rows of shape \(3,\) do not go with"):
        returned(np.zeros((2, 2)), np.zeros((3, 2)))
    with pytest.raises(gm.InputError, match=r"^parameters: no parameter of the scene `q`"):
        getattr(gm, library).direct_return(scene, "q")


def test_gradients_of_the_map_pass_the_check_of_jax(scene: gm.Scene) -> None:
    jax = with_jax()
    from jax.test_util import check_grads

    returned = gm.jax.map_return(scene)
    given = (np.array(STATE), np.array(OFFSETS))
    assert np.array_equal(returned(*given), scene.map()(*given))
    for function in (returned, jax.jit(returned)):
        check_grads(function, given, order=1, modes=["fwd", "rev"], eps=1e-9, rtol=1e-3)


def test_gradients_of_simulation_pass_the_check_of_jax_twice(scene: gm.Scene) -> None:
    jax = with_jax()
    from jax.test_util import check_grads

    returned = gm.jax.direct_return(scene, NAMES)
    given = (np.array(START), np.array(VALUES))
    for function in (returned, jax.jit(returned)):
        check_grads(function, given, order=2, modes=["fwd", "rev"], eps=1e-5)
    exact = scene.replace(r=0.8, alpha=2.2).derivatives(
        dict(zip(scene.states, START, strict=True)), order=2, parameters=NAMES
    )
    assert np.array_equal(jax.hessian(returned)(*given), exact.hessian[:, :3, :3])


def test_jax_maps_over_rows(scene: gm.Scene) -> None:
    jax = with_jax()
    returned = gm.jax.direct_return(scene, NAMES)
    starts = np.array([START, [0.0, 3.1, 0.0]])
    rows = returned(starts, np.array(VALUES))
    mapped = jax.jit(jax.vmap(returned, (0, None)))(starts, np.array(VALUES))
    assert np.array_equal(mapped, rows)
    hessians = jax.vmap(jax.hessian(returned), (0, None))(starts, np.array(VALUES))
    assert np.array_equal(hessians[1], jax.hessian(returned)(starts[1], np.array(VALUES)))


def test_an_error_in_jax_is_that_of_the_package(scene: gm.Scene) -> None:
    jax = with_jax()
    gradient = jax.jacobian(gm.jax.map_return(scene))
    with pytest.raises(gm.NoResultError, match=r"^states: passage 1 grazes"):
        gradient(np.zeros(2))
    # A compiled function can only raise the exception of JAX, which holds the words.
    with pytest.raises(jax.errors.JaxRuntimeError, match="NoResultError: states: passage 1 grazes"):
        jax.jit(gradient)(np.zeros(2))


@deprecated
def test_gradients_of_the_map_pass_the_check_of_torch(scene: gm.Scene) -> None:
    torch = pytest.importorskip("torch")
    returned = gm.torch.map_return(scene)
    given = [torch.tensor(one, dtype=torch.float64) for one in (STATE, OFFSETS)]
    assert np.array_equal(returned(*given).numpy(), scene.map()(STATE, OFFSETS))
    for one in given:
        one.requires_grad_()
    assert torch.autograd.gradcheck(returned, given, eps=1e-10, check_forward_ad=True)
    with pytest.raises(gm.NoResultError, match=r"^states: passage 1 grazes"):
        torch.func.jacrev(returned)(torch.zeros(2))


@deprecated
def test_gradients_of_simulation_pass_the_check_of_torch_twice(scene: gm.Scene) -> None:
    torch = pytest.importorskip("torch")
    returned = gm.torch.direct_return(scene, NAMES)
    given = [torch.tensor(one, dtype=torch.float64, requires_grad=True) for one in (START, VALUES)]
    both = {"check_batched_grad": True}
    assert torch.autograd.gradcheck(returned, given, check_forward_ad=True, **both)
    assert torch.autograd.gradgradcheck(returned, given, check_fwd_over_rev=True, **both)


def test_torch_maps_over_rows(scene: gm.Scene) -> None:
    torch = pytest.importorskip("torch")
    returned = gm.torch.direct_return(scene, NAMES)
    starts = torch.tensor([START, [0.0, 3.1, 0.0]], dtype=torch.float64)
    values = torch.tensor(VALUES, dtype=torch.float64)
    rows = returned(starts, values)
    for dim, given in ((0, starts), (1, starts.T)):
        assert torch.equal(torch.func.vmap(returned, (dim, None))(given, values), rows)
    assert returned(starts.float(), values.float()).dtype == torch.float32
    # Values that are not tensors have the precision of those that are.
    assert torch.equal(returned(starts, VALUES), rows)
