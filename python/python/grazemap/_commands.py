"""The program's commands as functions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from . import _lib, _toml
from ._progress import Progress, shown
from ._table import Basin, Chart, Diagram

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from ._pipeline import Map


def diagram(
    m: Map,
    parameter: str,
    range: tuple[float, float] | None = None,  # noqa: A002
    *,
    values: Sequence[float] | None = None,
    points: int | None = None,
    scale: str | None = None,
    start: Sequence[Mapping[str, float]] | None = None,
    starts: int | None = None,
    transient: int | None = None,
    keep: int | None = None,
    observe: str | None = None,
    direction: str | None = None,
    using: str | Sequence[str] = "guarded",
    progress: Progress | bool | None = None,
) -> Diagram:
    """Make a bifurcation diagram over offsets of a parameter.

    The arguments are the keys of ``[[diagram]]`` in a scene, with its defaults; ``using`` is its
    ``with``. The numbers are those that ``grazemap diagram`` writes.

    >>> from grazemap import Scene
    >>> m = Scene.catalogue("linear").graze().map()
    >>> diagram(m, "alpha", (-1e-4, 1e-4), points=20)["offset"].shape
    (40,)
    """
    keys = {
        "parameter": parameter,
        "range": range,
        "values": values,
        "points": points,
        "scale": scale,
        "start": start,
        "starts": starts,
        "transient": transient,
        "keep": keep,
        "observe": observe,
        "direction": direction,
        "with": using,
    }
    return Diagram(_drawn(m, "diagram", keys, progress))


def chart(
    m: Map,
    parameters: tuple[str, str],
    ranges: tuple[tuple[float, float], tuple[float, float]],
    *,
    points: int | tuple[int, int] | None = None,
    cells: str | None = None,
    start: Sequence[Mapping[str, float]] | None = None,
    starts: int | None = None,
    attractors: int | None = None,
    transient: int | None = None,
    keep: int | None = None,
    observe: str | None = None,
    overlay: str | Sequence[str] | None = None,
    itineraries: Sequence[str] | None = None,
    using: str | Sequence[str] = "guarded",
    progress: Progress | bool | None = None,
) -> Chart:
    """Make a two-parameter chart over offsets, the horizontal parameter first.

    The arguments are the keys of ``[[chart]]`` in a scene, with its defaults; ``using`` is its
    ``with``. The numbers are those that ``grazemap chart`` writes.
    """
    keys = {
        "parameters": parameters,
        "ranges": ranges,
        "points": points,
        "cells": cells,
        "start": start,
        "starts": starts,
        "attractors": attractors,
        "transient": transient,
        "keep": keep,
        "observe": observe,
        "overlay": overlay,
        "itineraries": itineraries,
        "with": using,
    }
    return Chart(_drawn(m, "chart", keys, progress))


def basin(
    m: Map,
    axes: tuple[str, str] | None = None,
    ranges: tuple[tuple[float, float], tuple[float, float]] | None = None,
    *,
    points: int | tuple[int, int] | None = None,
    at: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    manifolds: int | None = None,
    using: str = "guarded",
    progress: Progress | bool | None = None,
) -> Basin:
    """Find the attractors and their basins in a plane of the section.

    The arguments are the keys of ``[[basin]]`` in a scene, with its defaults; ``using`` is its
    ``with``. The numbers are those that ``grazemap basin`` writes.
    """
    keys = {
        "axes": axes,
        "ranges": ranges,
        "points": points,
        "at": at,
        "start": start,
        "manifolds": manifolds,
        "with": using,
    }
    return Basin(_drawn(m, "basin", keys, progress))


def _drawn(
    m: Map, kind: str, keys: Mapping[str, object], progress: Progress | bool | None
) -> _lib.Computed:
    """Compute what one table of a kind with these keys asks for."""
    with shown(progress, kind) as seen:
        return _lib.draw(m._inner, _toml.table(kind, keys), seen)
