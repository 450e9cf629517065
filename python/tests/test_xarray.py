"""Results as datasets of xarray, and flags."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np
import pytest

import grazemap as gm

xr: Any = pytest.importorskip("xarray")


@pytest.fixture(scope="module")
def m() -> gm.Map:
    return gm.Scene.catalogue("linear").graze().map()


def saved(dataset: Any) -> Any:
    """Write a dataset to a file, and read it."""
    pytest.importorskip("scipy")
    return xr.load_dataset(io.BytesIO(bytes(dataset.to_netcdf())), engine="scipy")


def test_a_diagram_has_sweep_parameter_and_iterate(m: gm.Map) -> None:
    table = m.diagram("alpha", (-1e-4, 2e-4), points=7, keep=5, method=["map", "guarded"])
    ds = table.to_xarray()
    assert ds.value.dims == ("sweep", "alpha", "iterate")
    assert ds.sizes["sweep"] == 4
    up = ds.sel(heading="up").sel({"method": "guarded"})
    rows = (table["heading"] == "up") & (table["method"] == "guarded")
    assert np.array_equal(up.alpha, table["offset"][rows])
    assert np.array_equal(up.period, table["period"][rows], equal_nan=True)
    down = ds.sel(heading="down").sel({"method": "guarded"})
    rows = (table["heading"] == "down") & (table["method"] == "guarded")
    assert np.array_equal(down.value[:, 0], table["value_1"][rows][::-1], equal_nan=True)
    assert np.allclose(ds.alpha_value - ds.alpha, m.graze.parameters["alpha"])
    assert saved(ds).value.identical(saved(ds).value)


def test_a_chart_has_its_parameters_as_dimensions(m: gm.Map) -> None:
    table = m.chart(("omega", "alpha"), ((-1e-4, 1e-4), (-1e-4, 2e-4)), points=(4, 3))
    ds = table.to_xarray()
    assert ds.period.dims == ("alpha", "omega")
    assert np.array_equal(ds.period.values.ravel(), table["period"], equal_nan=True)
    assert np.array_equal(ds.omega, table["offset_1"][:4])
    nearest = ds.period.sel(alpha=6e-5, method="nearest")
    assert float(nearest.alpha) == table["offset_2"][4]
    assert nearest.attrs["units"] == "returns"
    assert ds.computed.dtype == bool
    assert ds.attrs["scene"] == "linear"
    assert ds.attrs["digest"] == table.document[0]["digest"]
    assert json.loads(ds.attrs["window"]) == m.window
    assert ds.attrs["units"] == "those of the scene"
    assert set(saved(ds).variables) == set(ds.variables)


def test_methods_and_starts_of_charts_are_dimensions(m: gm.Map) -> None:
    ranges = ((-1e-4, 1e-4), (-1e-4, 2e-4))
    table = m.chart(("omega", "alpha"), ranges, points=(3, 2), start=2, method=["map", "guarded"])
    ds = table.to_xarray()
    assert ds.end.dims == ("method", "start", "alpha", "omega")
    for method in ("map", "guarded"):
        own = table["end"][table["method"] == method]
        assert ds.end.sel({"method": method}).values.ravel().tolist() == own.tolist()
    assert ds.start_x.dims == ("start",)


def test_a_basin_has_its_coordinates_as_dimensions(m: gm.Map) -> None:
    ranges = ((-1e-3, 1e-3), (-2e-3, 2e-3))
    table = m.basin(("x", "theta"), ranges, points=(5, 4), at={"alpha": -5e-4})
    ds = table.to_xarray()
    assert ds.attractor.dims == ("theta", "x")
    assert ds.attractor.values.ravel().astype(str).tolist() == table["attractor"].tolist()
    assert float(ds.fraction.sum()) == pytest.approx(1)
    assert float(ds.alpha) == -5e-4
    assert np.allclose(ds.x_value, 1 + ds.x)
    assert set(saved(ds).variables) == set(ds.variables)


def test_a_branch_is_a_dataset_with_its_special_points(m: gm.Map) -> None:
    table = m.branch("alpha", (-1e-4, 1e-4), itineraries="1", observe="h")
    branches = table.to_xarray()
    assert [ds.attrs["itinerary"] for ds in branches] == ["1", "0"]
    for number, ds in enumerate(branches, 1):
        own = table["branch"] == number
        assert np.array_equal(ds.alpha, table["alpha"][own])
        assert ds.stable.dtype == ds.physical.dtype == bool
        assert np.array_equal(ds.h, table["h"][own], equal_nan=True)
        assert ds.special_label.values.tolist() == ["GR"]
        place = int(ds.special_point[0])
        assert ds.label.values[place] == "GR"
        assert float(ds.special_alpha[0]) == float(ds.alpha[place])
    contact, _ = branches
    assert contact.speed.dims == ("point", "contact")


def test_loci_orbits_and_curves_are_datasets(m: gm.Map) -> None:
    (locus,) = m.loci(("omega", "alpha"), (-1e-4, 1e-4), kind="graze").to_xarray()
    assert (locus.attrs["kind"], locus.omega.dims) == ("graze", ("point",))
    assert json.loads(locus.attrs["window"]) == m.window
    assert m.orbits({"alpha": -1e-6}, itineraries="1").to_xarray().stable.dims == ("orbit",)
    curve = m.curve("omega", (1.79, 1.81)).to_xarray()
    assert {"alpha", "omega"} <= set(curve.coords)
    assert m.nearest("alpha").to_xarray().change.sel(parameter="alpha").size == 1
    assert m.trajectory(samples=10).to_xarray().x.dims == ("t",)
    image = m.image([[-1e-6, 0.0], [-2e-6, 0.0]], iterations=2).to_xarray()
    assert image.x.shape == (2, 2)
    assert image.inside.all()


def test_noise_has_a_density_of_two_dimensions(m: gm.Map) -> None:
    table = m.noise({"alpha": 1e-6}, at={"alpha": -1e-4}, orbits=10, keep=20, cells=5)
    ds = table.to_xarray()
    _, _, density = table.density()
    assert ds.density.dims == ("theta", "x")
    assert np.array_equal(ds.density, density)
    area = (ds.x_to - ds.x_from) * (ds.theta_to - ds.theta_from)
    assert float((ds.density * area).sum()) == pytest.approx(1)
    assert set(saved(ds).variables) == set(ds.variables)


def test_flags_are_booleans(m: gm.Map) -> None:
    table = m.branch("alpha", (-1e-4, 1e-4), itineraries="1")
    assert table["x"][table["stable"] & table["physical"]].size > 0
    assert m.image([-1e-6, 0.0])["inside"].tolist() == [True]
    assert table.to_pandas()["physical"].dtype == bool
