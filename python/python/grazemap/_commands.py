"""The program's commands as functions, and as methods of scenes, grazes and maps."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypeVar

import numpy as np

from . import _check, _lib, _toml
from ._cluster import Client, shares
from ._errors import GrazemapError, InputError, NoResultError, SceneError
from ._names import older
from ._progress import Progress, shown
from ._remarks import warn
from ._table import (
    Basin,
    Branch,
    Chart,
    Curve,
    Derivatives,
    Diagram,
    Fit,
    Gallery,
    Image,
    Loci,
    Nearest,
    Noise,
    Orbits,
    Safety,
    SoftStops,
    Study,
    Table,
    Trajectory,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from os import PathLike

    from numpy.typing import ArrayLike, NDArray

    from ._pipeline import Graze, Map, Scene

    #: Input of a command. Missing steps (the orbit and the map of a scene) are computed.
    Source: TypeAlias = Scene | Graze | Map

#: Methods and number formats of images, and languages of emitted maps.
IMAGE_METHODS, PRECISIONS, TARGETS = map(tuple, _lib.words())
#: Methods of iteration, and those of periodic orbits.
METHODS, ORBIT_METHODS = ("map", "guarded", "direct", "atlas"), ("map", "direct")
#: Methods of returns whose parameters vary.
RETURN_METHODS = METHODS[:3]
LOCI, BIFURCATIONS = ("graze", "fold", "flip", "torus", "crisis"), ("fold", "flip")
OBSERVABLES = ("h", "impact_speed", "contact_time", "amplitude")

Method: TypeAlias = Literal["map", "guarded", "direct", "atlas"]
ReturnMethod: TypeAlias = Literal["map", "guarded", "direct"]
OrbitMethod: TypeAlias = Literal["map", "direct"]
ImageMethod: TypeAlias = Literal["map", "guarded", "direct", "smooth", "discontinuity"]
Precision: TypeAlias = Literal["f64", "f32", "dd"]
Device: TypeAlias = Literal["cpu", "cuda"]
Locus: TypeAlias = Literal["graze", "fold", "flip", "torus", "crisis"]
Bifurcation: TypeAlias = Literal["fold", "flip"]
Observable: TypeAlias = Literal["h", "impact_speed", "contact_time", "amplitude"]
#: Choice between an exception and an empty result where nothing is found.
OnEmpty: TypeAlias = Literal["raise", "return"]

#: Exit codes of the program.
_ENDED_OTHERWISE, _WRONG_INPUT = 1, 2
#: Largest counts.
_MOST_POINTS, _MOST_CELLS, _MOST_ITERATES, _MOST_STARTS = 10_000_000, 4_000_000, 10**9, 1000
MOST_RETURNS, MOST_ORDERS = 1_000_000, 8
_MOST_PERIOD, _MOST_STEPS, _MOST_XI, _MOST_SIZE = 12, 10_000, 64, 2**64 - 1

#: Arguments whose keys in a scene have other names.
_KEYS = {"range": "span", "ranges": "spans", "parameter": "along", "parameters": "plane"}
_KEYS |= {"axes": "plane", "starts": "start", "with": "method"}

T = TypeVar("T", bound=Table)


@older(using="method", parameter="along", range="span", starts="start", m="source")
def diagram(
    source: Source,
    along: str,
    span: Sequence[float] | None = None,
    *,
    values: Sequence[float] | None = None,
    points: int = 1000,
    scale: Literal["linear", "log"] = "linear",
    start: int | Mapping[str, float] | Sequence[Mapping[str, float]] | None = None,
    transient: int = 1000,
    keep: int = 200,
    observe: str = "h",
    direction: Literal["both", "up", "down"] = "both",
    method: Method | Sequence[Method] = "guarded",
    progress: Progress | bool | None = None,
    client: Client | None = None,
) -> Diagram:
    """Compute a bifurcation diagram: the points on which orbits settle, over one parameter.

    Sweeps carry their last state from one value of the parameter to the next.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`.
    along
        Active parameter that is swept. Of a scene it is made active.
    span
        First and last offset of the parameter from its grazing value, the first one smaller.
    values
        Offsets to compute instead of ``span``, ``points`` and ``scale``.
    points
        Number of values, 1 to 10 000 000.
    scale
        ``"linear"``: equal differences; ``"log"``: equal ratios, on one side of 0.
    start
        Offsets of section coordinates by name, at which a sweep starts (others 0); a list of
        them makes several sweeps; a number spreads so many starts over the window. Default:
        beside the fixed point of the smooth map.
    transient
        Number of iterates dropped at each value, 0 to 1e9.
    keep
        Number of iterates kept at each value, 1 to 1e9; 20 million at all values together.
    observe
        Observable: ``"h"`` (gap), ``"impact_speed"``, or an expression of states such as
        ``"x + 2*v"``.
    direction
        Direction of the sweeps; ``"both"`` makes one up and one down.
    method
        ``"guarded"``: the map inside its window, direct simulation outside; ``"map"``;
        ``"direct"``; ``"atlas"``: polynomials on boxes wherever orbits come. A list makes sweeps
        by each.
    progress
        ``True`` shows a bar of tqdm; a function is called with the work done and expected.
    client
        Dask client: workers of its cluster compute shares, with identical results.

    Returns
    -------
    Diagram
        Table with a row for each value in each sweep. :meth:`Diagram.to_xarray` has the
        dimensions ``(sweep, along, iterate)``.

    Raises
    ------
    InputError
        Wrong argument; the message names it.
    NoResultError
        The scene has no grazing orbit.
    TooLargeError
        The result exceeds the memory of the machine.

    Warns
    -----
    GrazemapWarning
        Each remark on accuracy, for example orbits that leave the window of the map.

    Examples
    --------
    >>> import grazemap as gm
    >>> scene = gm.Scene.catalogue("linear")
    >>> scene.diagram("alpha", (-1e-4, 1e-4), points=20)["offset"].shape
    (40,)

    """
    m = map_of(source, _check.texts("along", along))
    by_points = values is None
    keys = {
        "parameter": _active("along", m, _check.text("along", along))[0],
        "range": _check.given(_check.rising, "span", span),
        "values": _check.given(_list_of_offsets, "values", values),
        "points": _check.count("points", points, 1, _MOST_POINTS) if by_points else None,
        "scale": _check.choice("scale", scale, ("linear", "log")) if by_points else None,
        **_starts(m, start),
        "transient": _check.count("transient", transient, 0, _MOST_ITERATES),
        "keep": _check.count("keep", keep, 1, _MOST_ITERATES),
        "observe": _check.text("observe", observe),
        "direction": _check.choice("direction", direction, ("both", "up", "down")),
        "with": _check.choices("method", method, METHODS),
    }
    if (span is None) == by_points:
        message = "span: expected the first and the last offset of the parameter, or `values`"
        raise InputError(message)
    return _told(Diagram(_drawn(m, "diagram", keys, progress, client)))


@older(using="method", parameters="plane", ranges="spans", starts="start", m="source")
def chart(
    source: Source,
    plane: Sequence[str],
    spans: Sequence[Sequence[float]],
    *,
    points: int | Sequence[int] = 200,
    cells: Literal["all", "borders"] | None = None,
    start: int | Mapping[str, float] | Sequence[Mapping[str, float]] | None = None,
    attractors: int | None = None,
    transient: int = 1000,
    keep: int = 32,
    observe: Literal["period", "itinerary", "lyapunov", "attractors"] = "period",
    overlay: str | Sequence[str] = (),
    itineraries: str | Sequence[str] = (),
    method: Method | Sequence[Method] = "guarded",
    device: Device = "cpu",
    progress: Progress | bool | None = None,
    client: Client | None = None,
) -> Chart:
    """Compute a chart: the periods of the orbits that are settled on, over two parameters.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`.
    plane
        Two active parameters, the horizontal one first. Of a scene they are made active.
    spans
        First and last offset of each parameter from its grazing value.
    points
        Number of values along both axes, or two numbers; at most 4 000 000 cells.
    cells
        ``"all"`` computes every cell, ``"borders"`` those along borders of regions and probes of
        the blocks between; a region that holds no computed cell is missed. Default:
        ``"all"`` up to 10 000 cells.
    start
        Offsets of section coordinates by name, at which every cell starts (others 0); a list of
        them makes several charts; a number spreads so many starts over the window. Default:
        beside the fixed point of the smooth map.
    attractors
        Largest number of attractors told apart in a cell, 1 to 16, from all starts together.
        Default: 1; 4 with ``observe="attractors"``.
    transient
        Number of iterates dropped in each cell, 0 to 1e9.
    keep
        Longest period looked for, 1 to 1e9.
    observe
        ``"period"``, ``"itinerary"``, ``"lyapunov"`` or ``"attractors"``.
    overlay
        Curves of the figure: ``"graze"``, ``"loci"`` or both. Default: none.
    itineraries
        Itineraries of the orbits of these loci, as digits (1 contact, 0 none); for
        ``overlay="loci"``.
    method
        ``"guarded"``: the map inside its window, direct simulation outside; ``"map"``;
        ``"direct"``; ``"atlas"``: polynomials on boxes wherever orbits come. A list makes a chart
        by each.
    device
        ``"cpu"``, or ``"cuda"`` for an NVIDIA GPU, with identical results.
    progress
        ``True`` shows a bar of tqdm; a function is called with the work done and expected.
    client
        Dask client: workers of its cluster compute shares, with identical results.

    Returns
    -------
    Chart
        Table with a row for each cell. :meth:`Chart.to_xarray` has the two parameters as
        dimensions.

    Raises
    ------
    InputError
        Wrong argument; the message names it.
    NoResultError
        The scene has no grazing orbit.
    TooLargeError
        The result exceeds the memory of the machine.

    Warns
    -----
    GrazemapWarning
        Each remark on accuracy.

    Examples
    --------
    >>> import grazemap as gm
    >>> m = gm.Scene.catalogue("linear").graze().map()
    >>> chart = m.chart(("omega", "alpha"), ((-1e-4, 1e-4), (-1e-4, 2e-4)), points=(4, 3))
    >>> chart["period"].shape
    (12,)

    """
    m = map_of(source, _check.texts("plane", plane))
    keys = {
        "parameters": _check.pair(
            "plane", _active("plane", m, plane), m.parameters, "active parameter"
        ),
        "ranges": _check.spans("spans", spans),
        "points": _check.counts("points", points, 1, _MOST_CELLS),
        "cells": _check.given(_check.choice, "cells", cells, ("all", "borders")),
        **_starts(m, start),
        "attractors": _check.given(_check.count, "attractors", attractors, 1, 16),
        "transient": _check.count("transient", transient, 0, _MOST_ITERATES),
        "keep": _check.count("keep", keep, 1, _MOST_ITERATES),
        "observe": _check.choice(
            "observe", observe, ("period", "itinerary", "lyapunov", "attractors")
        ),
        "overlay": _check.choices("overlay", overlay, ("graze", "loci")) or None,
        "itineraries": _check.texts("itineraries", itineraries) or None,
        "with": _check.choices("method", method, METHODS),
    }
    if keys["itineraries"] and "loci" not in (keys["overlay"] or ()):
        message = "itineraries: those of loci; expected overlay='loci' as well"
        raise InputError(message)
    device = _device(device)
    return _told(Chart(_drawn(m, "chart", keys, progress, client, device=device)))


@older(using="method", axes="plane", ranges="spans", m="source")
def basin(
    source: Source,
    plane: Sequence[str] | None = None,
    spans: Sequence[Sequence[float]] | None = None,
    *,
    points: int | Sequence[int] = 400,
    at: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    cells: Literal["all", "borders"] = "borders",
    manifolds: int | None = None,
    method: Method = "guarded",
    progress: Progress | bool | None = None,
    client: Client | None = None,
) -> Basin:
    """Find the attractors and their basins in a plane of the section.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`.
    plane
        Two coordinates of the section, the horizontal one first (default: its first two).
    spans
        First and last offset of each coordinate (default: the window).
    points
        Number of cells along both axes, or two numbers; at most 4 000 000 cells.
    at
        Offsets of active parameters by name (others 0).
    start
        Offsets of the section's other coordinates by name (others 0).
    cells
        ``"borders"`` computes cells along borders and probes of the blocks between, and fills
        the others: a region that holds no computed cell is missed. ``"all"`` computes every cell.
    manifolds
        Longest period, 1 to 12, of saddles with their manifolds, on a section of two
        coordinates. Default: no manifolds.
    method
        ``"guarded"``: the map inside its window, direct simulation outside; ``"map"``;
        ``"direct"``; ``"atlas"``: polynomials on boxes wherever orbits come.
    progress
        ``True`` shows a bar of tqdm; a function is called with the work done and expected.
    client
        Dask client: workers of its cluster compute shares, with identical results.

    Returns
    -------
    Basin
        Table with a row for each cell; ``attractors`` lists the attractors.
        :meth:`Basin.to_xarray` has the two coordinates as dimensions.

    Raises
    ------
    InputError
        Wrong argument; the message names it.
    NoResultError
        The scene has no grazing orbit.
    TooLargeError
        The result exceeds the memory of the machine.

    Warns
    -----
    GrazemapWarning
        Each remark on accuracy.

    Examples
    --------
    >>> import grazemap as gm
    >>> m = gm.Scene.catalogue("linear").graze().map()
    >>> basin = m.basin(("x", "theta"), ((-1e-3, 1e-3), (-2e-3, 2e-3)), points=20)
    >>> len(basin.attractors) > 0
    True

    """
    m = map_of(source, _named("at", at))
    coordinates, kind = m.coordinates, "coordinate of the section"
    keys = {
        "axes": _check.given(_check.pair, "plane", plane, coordinates, kind),
        "ranges": _check.given(_check.spans, "spans", spans),
        "points": _check.counts("points", points, 1, _MOST_CELLS),
        "at": _check.given(_check.numbers, "at", at, m.parameters),
        "start": _check.given(_check.numbers, "start", start, coordinates, kind),
        "cells": _check.choice("cells", cells, ("all", "borders")),
        "manifolds": _check.given(_check.count, "manifolds", manifolds, 1, 12),
        "with": _check.choice("method", method, METHODS),
    }
    for name in start or ():
        if name in (keys["axes"] or coordinates[:2]):
            message = f"start names `{name}`, which varies"
            raise InputError(message)
    return _told(Basin(_drawn(m, "basin", keys, progress, client)))


@older(using="method", range="span", starts="start")
def branch(
    source: Source,
    along: str,
    span: Sequence[float | None] | None = None,
    *,
    at: Mapping[str, float] | None = None,
    itineraries: str | Sequence[str] = (),
    period: int | None = None,
    method: OrbitMethod = "map",
    start: Mapping[str, float] | Sequence[Mapping[str, float]] = (),
    observe: Observable | Sequence[Observable] = (),
    iterates: bool = False,
    on_empty: OnEmpty = "raise",
    progress: Progress | bool | None = None,
    client: Client | None = None,
) -> Branch:
    """Follow branches of periodic orbits in one parameter, through folds, flips and grazes.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`.
    along
        Active parameter in which branches are followed. Of a scene it is made active.
    span
        First and last offset of the parameter; ``None`` is an edge of the window (default: the
        window).
    at
        Offsets of other active parameters by name (others 0).
    itineraries
        Itineraries as digits, one for each passage (1 contact, 0 none), or one of them.
        Default: all with periods up to ``period``.
    period
        Longest period in returns, 1 to 12, of itineraries that are not named and of branches that
        double. Default: 4 passages.
    method
        ``"map"``, or ``"direct"`` for direct simulation.
    start
        Offsets of section coordinates by name, once or several times, from which direct
        simulation searches in addition.
    observe
        Quantities added as columns: ``"h"`` (gap), ``"impact_speed"``, ``"contact_time"``,
        ``"amplitude"``.
    iterates
        Whether the figures show the iterates of the scene's diagram in the same parameter.
    on_empty
        ``"raise"``: an exception if no branch is found; ``"return"``: an empty table.
    progress
        ``True`` shows a bar of tqdm; a function is called with the work done and expected.
    client
        Dask client: workers of its cluster compute shares, with identical results.

    Returns
    -------
    Branch
        Table with a row for each point of each branch; ``special`` lists grazes, folds and
        flips, ``stable_ranges`` the ranges of stable orbits.

    Raises
    ------
    InputError
        Wrong argument; the message names it.
    NoResultError
        No branch was found, or the scene has no grazing orbit.

    Warns
    -----
    GrazemapWarning
        Each remark on accuracy or completeness.

    Examples
    --------
    >>> import grazemap as gm
    >>> m = gm.Scene.catalogue("linear").graze().map()
    >>> found = m.branch("alpha", (-1e-4, 1e-4), itineraries="1")
    >>> [point["label"] for point in found.special]
    ['GR', 'GR']

    """
    source = _searched(source, [_check.text("along", along), *_named("at", at)], method)
    first, last = _check.rising("span", span, is_open=True) if span is not None else (None, None)
    keys = {
        "along": _check.text("along", along),
        "from": first,
        "to": last,
        "at": _check.given(_check.numbers, "at", at),
        "itineraries": _check.texts("itineraries", itineraries),
        "period": _check.given(_check.count, "period", period, 1, _MOST_PERIOD),
        "method": method,
        "starts": _check.list_of_numbers("start", start),
        "observe": _check.choices("observe", observe, OBSERVABLES),
        "iterates": _check.flag("iterates", iterates),
    }
    on_empty = _on_empty(on_empty)
    return _found(Branch(_answered(source, "branch", keys, progress, client)), on_empty)


@older(using="method", parameters="plane", range="span")
def loci(
    source: Source,
    plane: Sequence[str],
    span: Sequence[float | None] | None = None,
    *,
    kind: Locus | Sequence[Locus] = (),
    at: Mapping[str, float] | None = None,
    itineraries: str | Sequence[str] = (),
    method: OrbitMethod = "map",
    chart: bool = False,
    on_empty: OnEmpty = "raise",
    progress: Progress | bool | None = None,
) -> Loci:
    """Follow loci of periodic orbits in two parameters, with their points of codimension two.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`.
    plane
        Two active parameters; the second is solved for. Of a scene they are made active.
    span
        First and last offset of the first parameter; ``None`` is an edge of the window (default:
        the window).
    kind
        ``"graze"``, ``"fold"``, ``"flip"``, ``"torus"``, ``"crisis"``, or several of them.
        Default: all but crises.
    at
        Offsets of other active parameters by name (others 0).
    itineraries
        Itineraries as digits, one for each passage (1 contact, 0 none), or one of them.
        Default: all of up to two passages.
    method
        ``"map"``, or ``"direct"`` for direct simulation.
    chart
        Whether the figure shows the scene's chart in these parameters below the loci.
    on_empty
        ``"raise"``: an exception if no locus is found; ``"return"``: an empty table.
    progress
        ``True`` shows a bar of tqdm; a function is called with the work done and expected.

    Returns
    -------
    Loci
        Table with a row for each point of each locus; ``special`` lists the points of
        codimension two.

    Raises
    ------
    InputError
        Wrong argument; the message names it.
    NoResultError
        No locus was found, or the scene has no grazing orbit.

    Warns
    -----
    GrazemapWarning
        Each remark on accuracy or completeness.

    Examples
    --------
    >>> import grazemap as gm
    >>> m = gm.Scene.catalogue("linear").graze().map()
    >>> set(m.loci(("omega", "alpha"), (-1e-4, 1e-4), kind="graze")["kind"])
    {'graze'}

    """
    named = _check.texts("plane", plane)
    source = _searched(source, [*named, *_named("at", at)], method)
    first, last = _check.rising("span", span, is_open=True) if span is not None else (None, None)
    keys = {
        "plane": named,
        "from": first,
        "to": last,
        "kind": _check.choices("kind", kind, LOCI),
        "at": _check.given(_check.numbers, "at", at),
        "itineraries": _check.texts("itineraries", itineraries),
        "method": method,
        "chart": _check.flag("chart", chart),
    }
    on_empty = _on_empty(on_empty)
    found = Loci(_answered(source, "loci", keys, progress))
    return _found(_of_map(found, source), on_empty)


@older(using="method", parameters="plane", range="span")
def orbits(
    source: Source,
    at: Mapping[str, float] | Sequence[Mapping[str, float]] = (),
    *,
    itineraries: str | Sequence[str] = (),
    period: int | None = None,
    method: OrbitMethod = "map",
    kind: Bifurcation | Sequence[Bifurcation] = (),
    plane: str | Sequence[str] = (),
    span: Sequence[float | None] | None = None,
    points: int = 21,
    on_empty: OnEmpty = "raise",
    progress: Progress | bool | None = None,
) -> Orbits:
    """Find periodic orbits by itinerary, or their folds and flips.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`.
    at
        Offsets of active parameters by name, once or several times (default: a tenth of the
        window, on both sides of the graze).
    itineraries
        Itineraries as digits, one for each passage (1 contact, 0 none), or one of them.
        Default: all with periods up to ``period``.
    period
        Longest period in returns, 1 to 12, in the place of ``itineraries``. Default: 4 passages.
    method
        ``"map"``, or ``"direct"`` for direct simulation.
    kind
        ``"fold"``, ``"flip"`` or both: the rows are these bifurcations. Default: the orbits.
    plane
        Parameter that bifurcations are solved for; of two the first is stepped through.
        Default: the first parameter adjusted to graze.
    span
        First and last offset of the parameter stepped through; ``None`` is an edge of the window
        (default: the window).
    points
        Number of offsets of the parameter stepped through, 2 to 10 000.
    on_empty
        ``"raise"``: an exception if no orbit is found; ``"return"``: an empty table.
    progress
        ``True`` shows a bar of tqdm; a function is called with the work done and expected.

    Returns
    -------
    Orbits
        Table with a row for each orbit or bifurcation.

    Raises
    ------
    InputError
        Wrong argument; the message names it.
    NoResultError
        No orbit was found, or the scene has no grazing orbit.

    Warns
    -----
    GrazemapWarning
        Each remark on accuracy or completeness.

    Examples
    --------
    >>> import grazemap as gm
    >>> m = gm.Scene.catalogue("linear").graze().map()
    >>> [str(word) for word in m.orbits({"alpha": -1e-6}, itineraries="1")["itinerary"]]
    ['1']

    """
    offsets, named = _check.list_of_numbers("at", at), _check.texts("plane", plane)
    source = _searched(source, [*named, *(name for one in offsets for name in one)], method)
    first, last = _check.rising("span", span, is_open=True) if span is not None else (None, None)
    keys = {
        "at": offsets,
        "itineraries": _check.texts("itineraries", itineraries),
        "period": _check.given(_check.count, "period", period, 1, _MOST_PERIOD),
        "method": method,
        "kind": _check.choices("kind", kind, BIFURCATIONS),
        "plane": named,
        "from": first,
        "to": last,
        "points": _check.count("points", points, 2, _MOST_STEPS),
    }
    if span is not None and len(named) != 2:  # noqa: PLR2004
        message = "span: that of the first of two parameters; expected two in `plane`"
        raise InputError(message)
    on_empty = _on_empty(on_empty)
    return _found(Orbits(_answered(source, "orbits", keys, progress)), on_empty)


@older(range="span")
def curve(
    source: Source,
    along: str,
    span: Sequence[float],
    *,
    xi: int = 1,
    on_empty: OnEmpty = "raise",
    progress: Progress | bool | None = None,
) -> Curve:
    """Follow the grazing curve in a second parameter, with ``xi_1`` to ``xi_N`` and their zeros.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`.
    along
        Parameter of the scene.
    span
        First and last value of the parameter; values, not offsets.
    xi
        Number of functions ``xi_n``, 1 to 64.
    on_empty
        ``"raise"``: an exception if every orbit passes through a surface; ``"return"``: the
        table of these orbits.
    progress
        ``True`` shows a bar of tqdm; a function is called with the work done and expected.

    Returns
    -------
    Curve
        Table with a row for each grazing orbit; ``special`` lists the zeros of ``xi_n``.

    Raises
    ------
    InputError
        Wrong argument; the message names it.
    NoResultError
        No physical orbit grazes.

    Warns
    -----
    GrazemapWarning
        A curve that ends before the last value, and each remark.

    Examples
    --------
    >>> import grazemap as gm
    >>> traced = gm.Scene.catalogue("linear").curve("omega", (1.75, 1.85))
    >>> traced.ended is None
    True

    """
    first, last = _check.span("span", span)
    keys = {
        "along": of_scene("along", source, _check.text("along", along))[0],
        "from": first,
        "to": last,
        "xi": _check.count("xi", xi, 1, _MOST_XI),
    }
    on_empty = _on_empty(on_empty)
    return _found(Curve(_answered(source, "curve", keys, progress)), on_empty)


def nearest(
    source: Source,
    parameters: str | Sequence[str],
    *,
    scale: Mapping[str, float] | None = None,
    progress: Progress | bool | None = None,
) -> Nearest:
    """Find the smallest change of one or two parameters at which the orbit grazes.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`; the values are those of the scene.
    parameters
        One or two parameters of the scene that may change.
    scale
        Unit in which a change of each parameter is measured (default: the absolute value of the
        parameter, 1 where that is 0).
    progress
        ``True`` shows a bar of tqdm; a function is called with the work done and expected.

    Returns
    -------
    Nearest
        Table with a row for each parameter; ``margin`` is the length of the change, negative
        where the orbit already goes beyond the stop, and ``clears`` whether it stays clear.

    Raises
    ------
    InputError
        Wrong argument; the message names it.
    NoResultError
        No orbit grazes.

    Warns
    -----
    GrazemapWarning
        Each remark on completeness.

    Examples
    --------
    >>> import grazemap as gm
    >>> found = gm.Scene.catalogue("linear").nearest("alpha")
    >>> found.clears, round(found.margin, 6)
    (False, -0.001235)

    """
    known = scene_of(source).parameters
    kind = "parameter of the scene"
    keys = {
        "nearest": of_scene("parameters", source, parameters),
        "scale": _check.given(_check.numbers, "scale", scale, known, kind),
    }
    return _told(Nearest(_answered(source, "nearest", keys, progress)))


def safe(
    source: Source,
    tolerance: Mapping[str, float] | None = None,
    *,
    points: int = 16,
    progress: Progress | bool | None = None,
) -> Safety:
    """Tell whether the orbit is clear of every stop, and how far parameters may go.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`; the values are those of the scene.
    tolerance
        Tolerances of parameters relative to their values (0.05 is 5 %); the whole box is looked
        at. Default: no box.
    points
        Number of starts along each axis of a plane of states, 0 to 1000, from which direct
        simulation looks for other attractors; 0: none are looked for.
    progress
        ``True`` shows a bar of tqdm; a function is called with the work done and expected.

    Returns
    -------
    Safety
        Table with a row for each parameter: the grazes below and above its value; ``clears``,
        and ``attractors`` with the interval of a parameter in which each exists.

    Raises
    ------
    InputError
        Wrong argument; the message names it.
    NoResultError
        No orbit grazes.

    Warns
    -----
    GrazemapWarning
        Each remark on completeness.

    Examples
    --------
    >>> import grazemap as gm
    >>> found = gm.Scene.catalogue("linear").safe({"alpha": 0.01}, points=0)
    >>> found.clears, [str(name) for name in found["parameter"]]
    (False, ['alpha', 'omega'])

    """
    known = scene_of(source).parameters
    kind = "parameter of the scene"
    keys = {
        "tolerance": _check.given(_check.numbers, "tolerance", tolerance, known, kind),
        "points": _check.count("points", points, 0, _MOST_STARTS),
    }
    return _told(Safety(_answered(source, "safe", keys, progress)))


def trajectory(
    source: Source,
    *,
    at: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    itinerary: str | None = None,
    settle: int = 0,
    periods: int = 1,
    samples: int = 400,
    progress: Progress | bool | None = None,
) -> Trajectory:
    """Simulate a time series directly, from a section point or on a periodic orbit.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`.
    at
        Offsets of active parameters by name (others 0). Of a scene they are made active.
    start
        Offsets of section coordinates by name (others 0: the grazing orbit).
    itinerary
        Periodic orbit to start on instead, as digits (1 contact, 0 none).
    settle
        Number of returns that are simulated first, without rows.
    periods
        Number of periods of that orbit; of returns to the section without one.
    samples
        Number of rows per return, evenly spaced in time; events add rows.
    progress
        ``True`` shows a bar of tqdm; a function is called with the work done and expected.

    Returns
    -------
    Trajectory
        Table with a row for each moment: time, phase, states, gaps, events.

    Raises
    ------
    InputError
        Wrong argument; the message names it.
    NoResultError
        The scene has no grazing orbit, or no orbit has the itinerary.

    Warns
    -----
    GrazemapWarning
        A simulation that ends early, and each remark.

    Examples
    --------
    >>> import grazemap as gm
    >>> series = gm.Scene.catalogue("linear").trajectory(periods=2, samples=50)
    >>> bool(series["t"][-1] > series["t"][0])
    True

    """
    keys = {
        "at": _check.given(_check.numbers, "at", at),
        "start": _check.given(_check.numbers, "start", start),
        "itinerary": _check.given(_check.text, "itinerary", itinerary),
        "settle": _check.count("settle", settle),
        "periods": _check.count("periods", periods),
        "samples": _check.count("samples", samples),
    }
    source = _activated(source, _named("at", at))
    return _told(Trajectory(_answered(source, "trajectory", keys, progress)))


def converge(
    source: Source, *, fresh: int = 1000, progress: Progress | bool | None = None
) -> Study:
    """Compare maps of all truncation orders with direct simulation.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`.
    fresh
        Number of new points, 0 to 10 000 000, at which the chosen map is compared.
    progress
        ``True`` shows a bar of tqdm; a function is called with the work done and expected.

    Returns
    -------
    Study
        Table with a row for each pair of orders: its largest error, its cost.

    Raises
    ------
    InputError
        Wrong argument; the message names it.
    NoResultError
        The scene has no grazing orbit.

    Warns
    -----
    GrazemapWarning
        Each remark on accuracy.

    Examples
    --------
    >>> import grazemap as gm
    >>> small = {"expansion.smooth_order": 2, "expansion.contact_weight": 3}
    >>> study = gm.Scene.catalogue("linear").replace(**small).converge(fresh=10)
    >>> "largest error" in study
    True

    """
    keys = {"fresh": _check.count("fresh", fresh, 0, _MOST_POINTS)}
    return _told(Study(_answered(source, "converge", keys, progress)))


@older(using="method", m="source")
def image(
    source: Source,
    states: ArrayLike,
    parameters: ArrayLike | None = None,
    iterations: int = 1,
    *,
    method: ImageMethod = "map",
    precision: Precision = "f64",
) -> Image:
    """List iterated images of states, with their contacts and whether they lie in the window.

    :meth:`Map.iterate` gives the same images as an array.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`.
    states
        Offsets of states, shape ``(..., coordinates)``.
    parameters
        Offsets of active parameters: one row for all states, or a row for each (default: 0).
    iterations
        Number of iterations, at least 1.
    method
        ``"map"``; ``"guarded"``: direct simulation outside the window; ``"direct"``;
        ``"smooth"`` and ``"discontinuity"``: one part of the map alone.
    precision
        ``"f64"``, ``"f32"`` or ``"dd"`` (double-double).

    Returns
    -------
    Image
        Table with a row for each state and iteration.

    Raises
    ------
    InputError
        Wrong argument; the message names it.

    Warns
    -----
    GrazemapWarning
        Points outside the window, and a point that has no image.

    Examples
    --------
    >>> import grazemap as gm
    >>> m = gm.Scene.catalogue("linear").graze().map()
    >>> m.image([[-1e-6, 0.0], [-2e-6, 0.0]], iterations=2)["iteration"].tolist()
    [1.0, 2.0, 1.0, 2.0]

    """
    m = map_of(source)
    rows, own, _ = m._points(states, parameters)
    check_images(iterations, method, precision)
    found = Image(m._inner.image(np.atleast_2d(rows), own, iterations, method, precision))
    return _told(_of_map(found, m))


@older(using="method")
def fit(
    source: Source,
    data: ArrayLike | Sequence[ArrayLike],
    parameters: str | Sequence[str],
    *,
    at: Mapping[str, float] | None = None,
    controls: Mapping[str, float | Sequence[float]] | None = None,
    noise: Mapping[str, float] | None = None,
    piece: int = 10,
    withheld: int = 0,
    method: ReturnMethod = "guarded",
    progress: Progress | bool | None = None,
) -> Fit:
    """Fit parameters to measured section points, by least squares with exact derivatives.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`.
    data
        One series of points, shape ``(returns, coordinates)``, several of equal length, shape
        ``(series, returns, coordinates)``, or a list of series. Points are offsets; NaN marks a
        coordinate that was not measured.
    parameters
        Active parameters to fit. Of a scene they are made active.
    at
        Initial offsets of parameters by name (others 0).
    controls
        Known offsets of parameters by name: one number, or one for each series.
    noise
        Standard deviation of the measurement by coordinate (default: that of the residuals).
    piece
        Number of returns after which a series is given a new start; 0 leaves it whole.
    withheld
        Number of points at the end of every series that are predicted instead of fitted.
    method
        ``"guarded"``: the map inside its window, direct simulation outside; ``"map"``;
        ``"direct"``.
    progress
        ``True`` shows a bar of tqdm; a function is called with the work done and expected.

    Returns
    -------
    Fit
        Table with a row for each parameter; ``parameters``, ``errors``, ``covariance``.

    Raises
    ------
    InputError
        Wrong argument, or too few measured numbers.

    Warns
    -----
    GrazemapWarning
        A fit that may have ended in a false minimum, and each remark.

    Examples
    --------
    >>> import numpy as np
    >>> import grazemap as gm
    >>> m = gm.Scene.catalogue("linear").graze().map()
    >>> starts = np.linspace(-6e-6, -2e-6, 20)[:, None] * [1, 0]
    >>> orbits = m.iterate(starts, [3e-7, 0.0], 3, method="guarded")
    >>> found = m.fit(np.concatenate([starts[:, None], orbits], axis=1), "alpha")
    >>> abs(found.parameters["alpha"] - 3e-7) < 1e-12
    True

    """
    named = _check.texts("parameters", parameters)
    m = map_of(source, [*named, *_named("at", at), *_named("controls", controls)])
    width = len(m.coordinates)
    series = _series(data, width)
    added = np.zeros((len(series), len(m.parameters)))
    _check.names("controls", controls or (), m.parameters)
    for name, values in (controls or {}).items():
        column = _check.array(f"controls[{name!r}]", values)
        if column.shape not in ((), (len(series),)) or not np.isfinite(column).all():
            message = f"controls[{name!r}]: expected a finite number, or one for each of "
            raise InputError(message + f"{len(series)} series, found {values!r}")
        added[:, m.parameters.index(name)] = column
    kind = "coordinate of the section"
    keys = {
        "parameters": _active("parameters", m, named),
        "at": _check.given(_check.numbers, "at", at, m.parameters),
        "noise": _check.given(_check.numbers, "noise", noise, m.coordinates, kind),
        "piece": _check.count("piece", piece),
        "withheld": _check.count("withheld", withheld),
        "method": _check.choice("method", method, RETURN_METHODS),
    }
    text = _json(keys)
    points = np.ascontiguousarray(np.concatenate(series))
    with shown(progress, "fit") as seen:
        lengths = [len(one) for one in series]
        found = Fit(_lib.fit(m._inner, text, lengths, points, added, seen))
    return _told(_of_map(found, m))


@older(using="method", range="spans")
def noise(
    source: Source,
    deviations: Mapping[str, float],
    *,
    at: Mapping[str, float] | None = None,
    law: Literal["normal", "uniform"] = "normal",
    start: Mapping[str, float] | None = None,
    orbits: int = 1000,
    transient: int = 100,
    keep: int = 1000,
    spans: Mapping[str, Sequence[float]] | None = None,
    cells: int = 100,
    seed: int = 0,
    method: ReturnMethod = "guarded",
    progress: Progress | bool | None = None,
) -> Noise:
    """Iterate orbits with random parameters at every return, and compute their densities.

    Equal seeds give equal results, on any number of threads.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`.
    deviations
        Standard deviations of active parameters by name (a restitution, a gap, a forcing). Of a
        scene they are made active.
    at
        Means of active parameters by name, as offsets (others 0).
    law
        ``"normal"`` or ``"uniform"``, with the same standard deviation.
    start
        Offsets of section coordinates by name, at which all orbits start (others 0).
    orbits
        Number of orbits.
    transient
        Number of returns that each orbit skips.
    keep
        Number of returns of each orbit that are counted.
    spans
        First and last offset of coordinates by name, between which returns are counted (default:
        the window).
    cells
        Number of cells along every coordinate.
    seed
        Seed of the random numbers, 0 to 2**64 - 1.
    method
        ``"guarded"``: the map inside its window, direct simulation outside; ``"map"``;
        ``"direct"``.
    progress
        ``True`` shows a bar of tqdm; a function is called with the work done and expected.

    Returns
    -------
    Noise
        Table with a row for each cell of each coordinate; :meth:`Noise.to_xarray` has the joint
        density of the first two coordinates.

    Raises
    ------
    InputError
        Wrong argument; the message names it.
    NoResultError
        The scene has no grazing orbit.

    Warns
    -----
    GrazemapWarning
        Each remark on accuracy.

    Examples
    --------
    >>> import grazemap as gm
    >>> m = gm.Scene.catalogue("linear").graze().map()
    >>> found = m.noise({"alpha": 1e-6}, at={"alpha": -1e-4}, orbits=10, keep=20, seed=1)
    >>> int(found["count"].sum()) <= 2 * 10 * 20
    True

    """
    m = map_of(source, [*_named("deviations", deviations), *_named("at", at)])
    coordinates, kind = m.coordinates, "coordinate of the section"
    ranges = None
    if spans is not None:
        _check.names("spans", _check.mapping("spans", spans), coordinates, kind)
        ranges = {name: _check.rising(f"spans[{name!r}]", one) for name, one in spans.items()}
    keys = {
        "deviations": _check.numbers(
            "deviations", deviations, _active("deviations", m, deviations)
        ),
        "at": _check.given(_check.numbers, "at", at, m.parameters),
        "law": _check.choice("law", law, ("normal", "uniform")),
        "start": _check.given(_check.numbers, "start", start, coordinates, kind),
        "orbits": _check.count("orbits", orbits, 1),
        "transient": _check.count("transient", transient),
        "keep": _check.count("keep", keep, 1),
        "range": ranges,
        "cells": _check.count("cells", cells, 1),
        "seed": _check.count("seed", seed, 0, _MOST_SIZE),
        "method": _check.choice("method", method, RETURN_METHODS),
    }
    return _told(_of_map(Noise(_answered(m, "noise", keys, progress)), m))


def report(
    source: Source,
    folder: str | PathLike[str] = "out",
    *,
    progress: Progress | bool | None = None,
) -> Path:
    """Compute everything that a scene asks for and write a report, as ``grazemap run`` does.

    The emitted crate does not state the command that reproduces it.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`.
    folder
        Folder of the report, which is made.
    progress
        ``True`` shows a bar of tqdm; a function is called with the work done and expected.

    Returns
    -------
    pathlib.Path
        Path of the page.

    Raises
    ------
    InputError
        The folder cannot be written.
    NoResultError
        The scene has no grazing orbit.

    Examples
    --------
    >>> import grazemap as gm
    >>> gm.Scene.catalogue("linear").report("out")  # doctest: +SKIP
    PosixPath('out/report.html')

    """
    _checked(source)
    with shown(progress, "report") as seen:
        _lib.report(source._inner, Path(folder), seen)
    return Path(folder) / "report.html"


def gallery(
    names: str | Sequence[str] = (),
    folder: str | PathLike[str] = "out/gallery",
    *,
    small: bool = False,
) -> Gallery:
    """Recompute published figures and tables, as ``grazemap gallery`` does.

    Parameters
    ----------
    names
        Entries (``"thota2006/fig3"``) or papers, one or several (default: all).
    folder
        Folder of the page ``index.html``, which is made.
    small
        Whether to compute only the entries that take seconds.

    Returns
    -------
    Gallery
        Table with a row for each published number. Numbers that disagree with their entry raise
        no error: ``ended`` names them.

    Raises
    ------
    InputError
        Unknown entry, or a folder that cannot be written.

    Warns
    -----
    GrazemapWarning
        Numbers that disagree with their entry.

    Examples
    --------
    >>> import tempfile
    >>> import grazemap as gm
    >>> found = gm.gallery("thota2006/fig1", tempfile.mkdtemp(), small=True)
    >>> set(found["entry"]), found.ended
    ({'thota2006/fig1'}, None)

    """
    named = _check.texts("names", names)
    options = ["--small"] if small else []
    command = [sys.executable, "-m", "grazemap", "gallery", "-q", *options, "-o", str(folder)]
    ran = subprocess.run(  # noqa: S603
        [*command, "--", *named], capture_output=True, text=True, encoding="utf-8", check=False
    )
    words = ran.stderr.strip() or None
    if ran.returncode == 0:
        return Gallery(Path(folder))
    if ran.returncode == _ENDED_OTHERWISE:
        return _told(Gallery(Path(folder), words))
    raise (InputError if ran.returncode == _WRONG_INPUT else GrazemapError)(words)


def derivatives(
    source: Source,
    start: Mapping[str, float] | None = None,
    *,
    at: float | None = None,
    returns: int = 1,
    order: int = 1,
    parameters: str | Iterable[str] | None = None,
    sides: bool = False,
    progress: Progress | bool | None = None,
) -> Derivatives:
    """Compute a state after any hits, with its derivatives by the start and by parameters.

    Every stop acts. The times of hits depend on the start, and the derivatives know it: they are
    those of the state at a fixed time (or phase), to any order, in double-double.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`; the values are those of the scene.
    start
        Values of states and phase at the start, 0 if not named.
    at
        Time after which the derivatives are taken, above 0. Default: that of ``returns``.
    returns
        Number of forcing periods, 1 to 1 000 000; the derivatives are then those of the return,
        whose time depends on the parameters.
    order
        Highest order, 1 to 8.
    parameters
        Parameters by which derivatives are taken, in this order. Default: the active ones of the
        scene.
    sides
        Where the trajectory grazes: give the series on both sides of the graze (``graze``) in the
        place of an error.
    progress
        ``True`` shows a bar of tqdm; a function is called with the work done and expected.

    Returns
    -------
    Derivatives
        Table with a row for every derivative; ``value``, ``gradient``, ``hessian``, ``tensor``
        and ``events`` give arrays.

    Raises
    ------
    InputError
        Wrong argument; the message names it.
    NoResultError
        The trajectory grazes (and ``sides`` is false), two stops act at once, or it rebounds
        without end: a derivative does not exist.

    Examples
    --------
    >>> import grazemap as gm
    >>> found = gm.Scene.catalogue("linear").derivatives({"v": 3.0}, at=3.0, parameters="r")
    >>> found.gradient.shape, [event["surface"] for event in found.events]
    ((3, 4), ['stop'])

    """
    keys = {
        "start": _check.given(_check.numbers, "start", start, scene_of(source).states, "state"),
        "at": _check.given(_check.number, "at", at),
        "returns": _check.count("returns", returns, 1, MOST_RETURNS),
        "parameters": _check.given(
            lambda name, of: of_scene(name, source, of), "parameters", parameters
        ),
        "order": _check.count("order", order, 1, MOST_ORDERS),
        "sides": _check.flag("sides", sides),
    }
    return _told(Derivatives(_answered(source, "derivatives", keys, progress)))


def contact(
    source: Source | None,
    restitution: float,
    *,
    time: float | None = None,
    stiffness: float | None = None,
    speed: float | None = None,
    exponent: float = 1.5,
    mass: float = 1.0,
    progress: Progress | bool | None = None,
) -> SoftStops:
    """Find springs and dampers with a restitution, and the error of a rigid stop in their place.

    Parameters
    ----------
    source
        :class:`Scene`, :class:`Graze` or :class:`Map`, whose grazed stop the soft one replaces;
        ``None``: the impact of a mass alone.
    restitution
        Restitution that the stops have at the speed, 0.01 to 1.
    time
        Contact time at the speed. Default: a hundredth of the period of the grazing orbit; 1
        without a source.
    stiffness
        Stiffness of the spring, in the place of ``time``.
    speed
        Speed at which the stops have the restitution. Default: a tenth of the largest normal
        speed along the grazing orbit; 1 without a source.
    exponent
        Exponent of the spring of laws that are not linear, 0.1 to 20.
    mass
        Effective mass; with 1, stiffness and damper are those of an acceleration.
    progress
        ``True`` shows a bar of tqdm; a function is called with the work done and expected.

    Returns
    -------
    SoftStops
        Table with a row for each contact law and speed; ``stops`` has the stiffness and the
        damper of each law and the lines of a scene.

    Raises
    ------
    InputError
        Wrong argument; the message names it.
    NoResultError
        No orbit of the source grazes.

    Warns
    -----
    GrazemapWarning
        A law without a stop of this restitution and size.

    Examples
    --------
    >>> import grazemap as gm
    >>> found = gm.contact(None, 0.8, time=0.01)
    >>> [round(stop["stiffness"]) for stop in found.stops][:2]
    [99194, 90063]

    """
    optional = {"time": time, "stiffness": stiffness, "speed": speed}
    keys = {
        "restitution": _check.number("restitution", restitution),
        **{name: _check.given(_check.number, name, value) for name, value in optional.items()},
        "exponent": _check.number("exponent", exponent),
        "mass": _check.number("mass", mass),
    }
    if source is not None:
        return _told(SoftStops(_answered(source, "contact", keys, progress)))
    with shown(progress, "contact") as seen:
        return _told(SoftStops(_lib.answer(None, _json(keys, "contact"), seen)))


class Commands:
    """Commands as methods of scenes, grazes and maps."""

    basin = basin
    branch = branch
    chart = chart
    contact = contact
    converge = converge
    curve = curve
    derivatives = derivatives
    diagram = diagram
    fit = fit
    image = image
    loci = loci
    nearest = nearest
    noise = noise
    orbits = orbits
    report = report
    safe = safe
    trajectory = trajectory

    def _own_scene(self) -> Scene:
        """Give the scene."""
        raise NotImplementedError

    def _own_map(self) -> Map:
        """Give the map; missing steps are computed."""
        raise NotImplementedError


def check_images(iterations: int, method: str, precision: str) -> None:
    """Refuse unknown methods and number formats of images, and wrong numbers of iterations."""
    _check.count("iterations", iterations, 1, _MOST_SIZE)
    _check.choice("method", method, IMAGE_METHODS)
    _check.choice("precision", precision, PRECISIONS)


def _checked(source: Source) -> Source:
    """Refuse anything but a scene, a graze or a map."""
    if not isinstance(source, Commands):
        message = f"source: expected a Scene, a Graze or a Map, found {type(source).__name__}"
        raise InputError(message)
    return source


def scene_of(source: Source) -> Scene:
    return _checked(source)._own_scene()


def of_scene(argument: str, source: Source, names: str | Iterable[str]) -> list[str]:
    """Accept names of parameters of the scene."""
    known = scene_of(source).parameters
    return _check.names(argument, names, known, "parameter of the scene")


def _activated(source: Source, names: Iterable[str]) -> Source:
    """Give a scene with these of its parameters active; any other source as it is."""
    scene = scene_of(source)
    if scene is not source:
        return source
    own = [name for name in names if name in scene.parameters]
    active = list(dict.fromkeys((*scene.active, *own)))
    if len(active) == len(scene.active):
        return source
    return scene.replace(**{"expansion.active": active})


def _active(argument: str, m: Map, names: str | Iterable[str]) -> list[str]:
    """Accept names of active parameters of a map."""
    found = _check.texts(argument, names)
    known = m._own_scene().parameters
    frozen = [name for name in found if name in known and name not in m.parameters]
    if frozen:
        message = f"{argument}: `{frozen[0]}` is not active in this map; active parameters are "
        message += f"{', '.join(m.parameters)}; pass the scene instead of its map, or name the "
        raise InputError(message + "parameter in `expansion.active` of the scene")
    return _check.names(argument, found, m.parameters)


def map_of(source: Source, names: Iterable[str] = ()) -> Map:
    """Give the map of a source. These parameters are made active in a scene."""
    return _activated(source, names)._own_map()


def _named(argument: str, value: Mapping[str, Any] | None) -> dict[str, Any]:
    """Accept values by name; none if not given."""
    return _check.given(_check.mapping, argument, value) or {}


def _starts(
    m: Map, start: int | Mapping[str, float] | Sequence[Mapping[str, float]] | None
) -> dict[str, object]:
    """Give the keys of starts: a number of them, or offsets."""
    if start is None:
        return {}
    if isinstance(start, (int, np.integer)):
        return {"starts": _check.count("start", start, 1, _MOST_STARTS)}
    return {"start": _check.list_of_numbers("start", start, m.coordinates)}


def _list_of_offsets(argument: str, values: Iterable[float]) -> list[float]:
    """Accept a list of finite numbers."""
    listed = enumerate(_check.items(argument, values))
    return [_check.number(f"{argument}[{place}]", value) for place, value in listed]


def _searched(source: Source, names: Iterable[str], method: OrbitMethod) -> Source:
    """Give the source in which orbits are searched for: of maps the map, which is kept."""
    _check.choice("method", method, ORBIT_METHODS)
    source = _activated(source, names)
    return source._own_map() if method == "map" else source


def _device(device: Device) -> Device:
    _check.choice("device", device, ("cpu", "cuda"))
    return device


def _on_empty(on_empty: OnEmpty) -> OnEmpty:
    _check.choice("on_empty", on_empty, ("raise", "return"))
    return on_empty


def _of_map(result: T, source: Source) -> T:
    """Note the scene and the window of a map on a result whose document lacks them."""
    if isinstance(window := getattr(source, "window", None), dict):
        scene = source._own_scene()
        bounds = [{"name": name, "value": value} for name, value in window.items()]
        result._about = {"scene": scene.name, "digest": scene.digest, "window": {"bounds": bounds}}
    return result


def _told(result: T) -> T:
    """Warn of the remarks on a result, and of its early end."""
    warn(result.remarks)
    if result.ended is not None:
        warn([result.ended])
    return result


def _found(result: T, on_empty: OnEmpty) -> T:
    """Refuse a result in which nothing was found, unless an empty one is wanted."""
    if result.ended is None or not result.is_empty:
        return _told(result)
    warn(result.remarks)
    if on_empty == "raise":
        raise NoResultError(result.ended, result)
    return result


def _series(data: ArrayLike | Sequence[ArrayLike], width: int) -> list[NDArray[np.float64]]:
    """Give measured points as a list of series."""
    try:
        whole = np.asarray(data, dtype=np.float64)
        several = list(whole) if whole.ndim == 3 else [whole]  # noqa: PLR2004
    except (TypeError, ValueError):
        # Series of different lengths, or no numbers.
        several = [_check.array("data", one) for one in _check.items("data", data)]
    for one in several:
        if one.ndim != 2 or one.shape[1] != width:  # noqa: PLR2004
            message = f"data: a series has rows of {width} coordinates, found shape {one.shape}"
            raise InputError(message)
    if not several:
        message = "data: expected at least one series, found none"
        raise InputError(message)
    return several


def _answered(
    source: Source,
    command: str,
    keys: Mapping[str, object],
    progress: Progress | bool | None,
    client: Client | None = None,
) -> _lib.Computed:
    """Compute the result of a command with these keys; keys that are `None` are omitted."""
    _checked(source)
    text = _json(keys, command)
    found = shares(client, _answer_share, source, text)
    with shown(progress, command) as seen:
        return _lib.answer(source._inner, text, seen, found)


def _answer_share(source: Source, command: str, number: int, of: int) -> bytes:
    return _lib.answer_share(source._inner, command, number, of)


def _json(keys: Mapping[str, object], command: str | None = None) -> str:
    """Write checked keys as JSON; keys that are `None` are omitted."""
    given = {key: value for key, value in keys.items() if value is not None}
    return json.dumps({command: given} if command else given, allow_nan=False)


def _drawn(
    m: Map,
    kind: str,
    keys: Mapping[str, Any],
    progress: Progress | bool | None,
    client: Client | None,
    *,
    device: Device = "cpu",
) -> _lib.Computed:
    """Compute the result of one table of a kind with these keys."""
    table = _toml.table(kind, keys)
    try:
        found = shares(client, _draw_share, m, (table, device))
        if client is not None:
            # Any machine will do: the shares left little to compute.
            device = "cpu"
        with shown(progress, kind) as seen:
            return _lib.draw(m._inner, table, seen, found, device)
    except SceneError as fault:
        raise InputError(_of_argument(fault, kind)) from None


def _of_argument(fault: SceneError, kind: str) -> str:
    """Give the words of a fault in a table that nobody wrote, with the argument's name."""
    named = fault.words.replace(f"{kind}.0.", "")
    if named == fault.words:
        # Arguments are checked, except for the expression that is observed.
        return f"observe: {named}"
    return f"{kind}: " + re.sub(r"`(\w+)`", lambda key: f"`{_KEYS.get(key[1], key[1])}`", named)


def _draw_share(m: Map, asked: tuple[str, str], number: int, of: int) -> bytes:
    return _lib.draw_share(m._inner, *asked, number, of)
