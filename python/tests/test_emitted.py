"""Emitted Python under Numba: the same bits."""

from __future__ import annotations

import importlib.util
import inspect
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import grazemap as gm

if TYPE_CHECKING:
    from pathlib import Path
    from types import ModuleType

numba: Any = pytest.importorskip("numba")


def module(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def numbers(result: object) -> list[np.ndarray[Any, Any]]:
    if isinstance(result, tuple):
        return [number for part in result for number in numbers(part)]
    return [np.asarray(result)]


def test_every_function_has_the_same_bits_under_numba(tmp_path: Path) -> None:
    low = {"expansion.smooth_order": 2, "expansion.contact_weight": 3}
    m = gm.Scene.catalogue("linear").with_(**low).graze().map()
    m.emit(tmp_path, target="python")
    path = tmp_path / "map_linear.py"
    plain, compiled = module(path), module(path)
    for name, function in list(vars(compiled).items()):
        if inspect.isfunction(function):
            setattr(compiled, name, numba.njit(function))

    rng = np.random.default_rng(1)
    states = rng.uniform(-1, 1, (1000, 2)) * [2e-3, 0.1]
    parameters = rng.uniform(-2e-3, 2e-3, (1000, 2))
    inside = 0
    for point in zip(states, parameters, strict=True):
        for name in ("step", "step_jacobian", "step_derivatives", "inside"):
            ours, expected = getattr(compiled, name)(*point), getattr(plain, name)(*point)
            pairs = zip(numbers(ours), numbers(expected), strict=True)
            assert all(a.tobytes() == b.tobytes() for a, b in pairs), name
        inside += plain.inside(*point)
    assert 0 < inside < len(states)
