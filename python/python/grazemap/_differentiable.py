"""Returns with their derivatives, for libraries that differentiate functions."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import _check
from ._commands import MOST_ORDERS, MOST_RETURNS, map_of, of_scene, scene_of
from ._errors import InputError, NoResultError, SceneError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ._commands import Source
    from ._pipeline import Map

Array: TypeAlias = NDArray[np.float64]

#: Number of rows whose derivatives are kept.
_KEPT = 1024


class Return:
    """Return as a function of rows of variables: states, then parameters.

    Attributes
    ----------
    states, parameters
        Names of the variables.
    values
        Values of the parameters where none are given.
    highest
        Highest order of derivatives.

    """

    states: tuple[str, ...]
    parameters: tuple[str, ...]
    values: tuple[float, ...]
    highest: int

    def jets(self, rows: Array, order: int) -> list[Array]:
        """Give the values and the derivatives up to an order.

        Shapes are ``(..., states)``, ``(..., states, variables)`` and so on, of rows of the shape
        ``(..., variables)``.

        Raises :class:`NoResultError` where a derivative does not exist.
        """
        raise NotImplementedError

    def check(self, states: tuple[int, ...], parameters: tuple[int, ...]) -> tuple[int, ...]:
        """Accept the shapes of states and parameters; give the shape of rows without its end."""
        for argument, shape, names in (
            ("states", states, self.states),
            ("parameters", parameters, self.parameters),
        ):
            if not shape or shape[-1] != len(names):
                message = f"{argument}: expected an array of shape (..., {len(names)}): "
                message += f"{', '.join(names) or 'none'}; found one of shape {shape}"
                raise InputError(message)
        try:
            return np.broadcast_shapes(states[:-1], parameters[:-1])
        except ValueError:
            message = f"parameters: rows of shape {parameters[:-1]} do not go with states of shape "
            raise InputError(message + str(states[:-1])) from None

    def order(self, order: int) -> int:
        """Accept an order of derivatives."""
        if order > self.highest:
            message = f"derivatives of this return exist to order {self.highest}, not to {order}"
            raise InputError(message)
        return order

    def shapes(self, order: int) -> list[tuple[int, ...]]:
        """Give the shapes of the values and the derivatives of one row up to an order."""
        variables = len(self.states) + len(self.parameters)
        return [(len(self.states), *[variables] * one) for one in range(self.order(order) + 1)]


class MapReturn(Return):
    """Return by a local map, in offsets."""

    highest = 1

    def __init__(self, source: Source) -> None:
        """Take the map of a source."""
        self._map: Map = map_of(source)
        self.states, self.parameters = self._map.coordinates, self._map.parameters
        self.values = (0.0,) * len(self.parameters)

    def jets(self, rows: Array, order: int) -> list[Array]:
        """Give the images and the first derivatives."""
        states, parameters = np.split(rows, [len(self.states)], axis=-1)
        if self.order(order) == 0:
            return [self._map(states, parameters)]
        images, depths, derivatives = self._map._jets(states, parameters)
        grazes = np.argwhere(depths == 0)
        if len(grazes):
            *row, passage = map(int, grazes[0])
            message = f"states: passage {passage + 1} " + (f"of row {row} " if row else "")
            message += "grazes (its depth is 0), and a derivative does not exist; near a graze it "
            raise NoResultError(message + "grows as the reciprocal of the depth's root")
        return [images, derivatives]


class DirectReturn(Return):
    """Return by direct simulation, in values of the full state."""

    highest = MOST_ORDERS

    def __init__(
        self,
        source: Source,
        parameters: str | Iterable[str] | None,
        returns: int,
        at: float | None,
    ) -> None:
        """Take the scene of a source, and the duration."""
        self._scene = scene_of(source)
        self.states = self._scene.states
        self.parameters = (
            self._scene.active
            if parameters is None
            else tuple(of_scene("parameters", source, parameters))
        )
        self.values = tuple(self._scene.parameters[name] for name in self.parameters)
        self._returns = _check.count("returns", returns, 1, MOST_RETURNS)
        self._at = _check.given(_check.number, "at", at)
        # A value and its derivatives are often asked for one after the other.
        self._kept = functools.lru_cache(_KEPT)(self._of_row)

    def jets(self, rows: Array, order: int) -> list[Array]:
        """Give the states at the end and the derivatives."""
        shapes = self.shapes(order)
        flat = rows.reshape(-1, rows.shape[-1]).tolist()
        found = [self._kept(tuple(row), max(order, 1)) for row in flat]
        return [
            np.array([one[place] for one in found]).reshape((*rows.shape[:-1], *shape))
            for place, shape in enumerate(shapes)
        ]

    def _of_row(self, row: tuple[float, ...], order: int) -> list[Array]:
        """Give the state at the end and the derivatives of one row."""
        start, changes = row[: len(self.states)], row[len(self.states) :]
        try:
            scene = self._scene.replace(**dict(zip(self.parameters, changes, strict=True)))
        except SceneError as fault:
            message = f"parameters: {fault.words}"
            raise InputError(message) from None
        found = scene.derivatives(
            dict(zip(self.states, start, strict=True)),
            at=self._at,
            returns=self._returns,
            order=order,
            parameters=self.parameters,
        )
        value = np.array([found.value[name] for name in self.states])
        return [value, *(found.tensor(one) for one in range(1, order + 1))]


def along(tensor: Any, change: Any, order: int) -> Any:
    """Give the change of a derivative: one of the next order, applied to a change of the rows.

    Arrays are those of a library; ``order`` is that of ``tensor``.

    >>> along(np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([1.0, 10.0]), 1).tolist()
    [21.0, 43.0]
    """
    *ahead, variables = change.shape
    return (tensor * change.reshape((*ahead, *[1] * order, variables))).sum(-1)
