"""The program's commands as functions."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from . import _lib, _toml
from ._cluster import Client, shares
from ._errors import GrazemapError, InputError
from ._names import older
from ._pipeline import Graze, Map, Scene, check_methods
from ._progress import Progress, shown
from ._table import (
    Basin,
    Branch,
    Chart,
    Curve,
    Diagram,
    Fit,
    Gallery,
    Image,
    Loci,
    Nearest,
    Noise,
    Orbits,
    Safety,
    Study,
    Trajectory,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from os import PathLike

    from numpy.typing import ArrayLike, NDArray

#: Input of a command. Missing steps (the orbit and the map of a scene) are computed.
Source: TypeAlias = Scene | Graze | Map
#: Exit codes of the program.
_ENDED_OTHERWISE, _WRONG_INPUT = 1, 2
#: Arguments that are counts, and the first number beyond all of them.
_COUNTS = {
    "cells",
    "fresh",
    "keep",
    "orbits",
    "period",
    "periods",
    "piece",
    "points",
    "samples",
    "settle",
    "transient",
    "withheld",
    "xi",
}
_MOST = 2**32
#: First and last offset.
Range: TypeAlias = tuple[float | None, float | None]


@older(using="method", parameter="along")
def diagram(
    m: Map,
    along: str,
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
    method: str | Sequence[str] = "guarded",
    progress: Progress | bool | None = None,
    client: Client | None = None,
) -> Diagram:
    """Make a bifurcation diagram over offsets of a parameter.

    The arguments are the keys of ``[[diagram]]`` in a scene, with its defaults; ``method`` is its
    ``with``. Results equal those of ``grazemap diagram``. With a Dask ``client`` the workers of its
    cluster compute shares of the work, with identical results.

    >>> from grazemap import Scene
    >>> m = Scene.catalogue("linear").graze().map()
    >>> diagram(m, "alpha", (-1e-4, 1e-4), points=20)["offset"].shape
    (40,)
    """
    keys = {
        "parameter": along,
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
        "with": method,
    }
    return Diagram(_drawn(m, "diagram", keys, progress, client))


@older(using="method", parameters="plane")
def chart(
    m: Map,
    plane: tuple[str, str],
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
    method: str | Sequence[str] = "guarded",
    device: str = "cpu",
    progress: Progress | bool | None = None,
    client: Client | None = None,
) -> Chart:
    """Make a two-parameter chart over offsets, the horizontal parameter first.

    The arguments are the keys of ``[[chart]]`` in a scene, with its defaults; ``method`` is its
    ``with``. Results equal those of ``grazemap chart``. With a Dask ``client`` the workers of its
    cluster compute shares of the work, with identical results. ``device="cuda"`` iterates on an
    NVIDIA GPU (of each worker, with a client); results are identical.
    """
    keys = {
        "parameters": plane,
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
        "with": method,
    }
    return Chart(_drawn(m, "chart", keys, progress, client, device=device))


@older(using="method", axes="plane")
def basin(
    m: Map,
    plane: tuple[str, str] | None = None,
    ranges: tuple[tuple[float, float], tuple[float, float]] | None = None,
    *,
    points: int | tuple[int, int] | None = None,
    at: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    manifolds: int | None = None,
    method: str = "guarded",
    progress: Progress | bool | None = None,
    client: Client | None = None,
) -> Basin:
    """Find the attractors and their basins in a plane of the section.

    The arguments are the keys of ``[[basin]]`` in a scene, with its defaults; ``method`` is its
    ``with``. Results equal those of ``grazemap basin``. With a Dask ``client`` the workers of its
    cluster compute shares of the work, with identical results.
    """
    keys = {
        "axes": plane,
        "ranges": ranges,
        "points": points,
        "at": at,
        "start": start,
        "manifolds": manifolds,
        "with": method,
    }
    return Basin(_drawn(m, "basin", keys, progress, client))


@older(using="method")
def branch(
    source: Source,
    along: str,
    range: Range | None = None,  # noqa: A002
    *,
    at: Mapping[str, float] | None = None,
    itineraries: Sequence[str] = (),
    period: int | None = None,
    method: str = "map",
    starts: Sequence[Mapping[str, float]] = (),
    observe: Sequence[str] = (),
    iterates: bool = False,
    progress: Progress | bool | None = None,
    client: Client | None = None,
) -> Branch:
    """Follow branches of periodic orbits in one parameter, through folds, flips and grazes.

    ``range`` holds the first and last offset of ``along`` (default: the window), ``at`` offsets
    of other parameters. ``itineraries`` are digits (1 contact, 0 none); by default all itineraries
    of short periods, or of up to ``period`` returns, are searched. ``method`` is ``"map"`` or
    ``"direct"``. ``observe`` names quantities to add as columns: ``"h"``, ``"impact_speed"``,
    ``"contact_time"``, ``"amplitude"``. Direct simulation also searches from ``starts``, offsets
    of coordinates by name. With ``iterates`` the figures show the iterates of the scene's diagram
    in the same parameter below the branches.

    Rows equal those of ``grazemap branch``. With a Dask ``client`` the workers of its cluster
    compute shares of the work, with identical results.

    >>> m = Scene.catalogue("foale").graze().map()
    >>> set(branch(m, "omega", (-1e-3, 1e-3), itineraries=["1"])["label"]) >= {"", "GR"}
    True
    """
    first, last = range or (None, None)
    keys = {
        "along": along,
        "from": first,
        "to": last,
        "at": at,
        "itineraries": itineraries,
        "period": period,
        "method": method,
        "starts": starts,
        "observe": observe,
        "iterates": iterates,
    }
    return Branch(_answered(source, "branch", keys, progress, client))


@older(using="method", parameters="plane")
def loci(
    source: Source,
    plane: tuple[str, str],
    range: Range | None = None,  # noqa: A002
    *,
    kind: str | Sequence[str] = (),
    at: Mapping[str, float] | None = None,
    itineraries: Sequence[str] = (),
    method: str = "map",
    chart: bool = False,
    progress: Progress | bool | None = None,
) -> Loci:
    """Follow loci of periodic orbits in two parameters, with their points of codimension two.

    ``range`` holds the first and last offset of the first parameter (default: the window).
    ``kind`` is one or several of ``"graze"``, ``"fold"``, ``"flip"``, ``"torus"``, ``"crisis"``
    (default: all but crises). With ``chart`` the figure shows the scene's chart in these
    parameters below the loci.

    Rows equal those of ``grazemap loci``.
    """
    first, last = range or (None, None)
    keys = {
        "plane": plane,
        "from": first,
        "to": last,
        "kind": [kind] if isinstance(kind, str) else kind,
        "at": at,
        "itineraries": itineraries,
        "method": method,
        "chart": chart,
    }
    return Loci(_answered(source, "loci", keys, progress))


@older(using="method", parameters="plane")
def orbits(
    source: Source,
    at: Mapping[str, float] | Sequence[Mapping[str, float]] = (),
    *,
    itineraries: Sequence[str] = (),
    period: int | None = None,
    method: str = "map",
    kind: str | Sequence[str] = (),
    plane: Sequence[str] = (),
    range: Range | None = None,  # noqa: A002
    points: int | None = None,
    progress: Progress | bool | None = None,
) -> Orbits:
    """Find periodic orbits by itinerary, or their folds and flips.

    ``at`` holds offsets of parameters (default: a tenth of the window, on both sides of the graze).
    With ``kind``, ``"fold"`` or ``"flip"`` or both, the rows are these bifurcations. They are
    solved for in the last of ``plane``; the first of two takes ``points`` values in ``range``.

    Rows equal those of ``grazemap orbits``.
    """
    first, last = range or (None, None)
    keys = {
        "at": [at] if isinstance(at, dict) else at,
        "itineraries": itineraries,
        "period": period,
        "method": method,
        "kind": [kind] if isinstance(kind, str) else kind,
        "plane": plane,
        "from": first,
        "to": last,
        "points": points,
    }
    return Orbits(_answered(source, "orbits", keys, progress))


def curve(
    source: Source,
    along: str,
    range: tuple[float, float],  # noqa: A002
    *,
    xi: int = 1,
    progress: Progress | bool | None = None,
) -> Curve:
    """Follow the grazing curve in a second parameter, with ``xi_1`` to ``xi_N`` and their zeros.

    ``range`` holds values of ``along``, not offsets. Rows equal those of ``grazemap curve``.

    >>> traced = curve(Scene.catalogue("linear"), "omega", (1.75, 1.85))
    >>> traced.ended is None
    True
    """
    keys = {"along": along, "from": range[0], "to": range[1], "xi": xi}
    return Curve(_answered(source, "curve", keys, progress))


def nearest(
    source: Source,
    parameters: Sequence[str],
    *,
    scale: Mapping[str, float] | None = None,
    progress: Progress | bool | None = None,
) -> Nearest:
    """Find the smallest change of one or two parameters at which the orbit grazes.

    ``scale`` is the unit in which a change of each parameter is measured (default: the parameter's
    value, or 1 if that is 0). Rows equal those of ``grazemap curve --nearest``.
    """
    keys = {"nearest": parameters, "scale": scale}
    return Nearest(_answered(source, "nearest", keys, progress))


def safe(
    source: Source,
    tolerance: Mapping[str, float] | None = None,
    *,
    points: int = 16,
    progress: Progress | bool | None = None,
) -> Safety:
    """Tell whether the orbit is clear of the stop, and how far parameters may go.

    ``tolerance`` holds tolerances of parameters relative to their values (0.05 is 5 %); the whole
    box is looked at. Direct simulation looks for other attractors from ``points`` by ``points``
    states; 0: none. The rows are those of ``grazemap safe``.

    >>> found = safe(Scene.catalogue("linear"), {"alpha": 0.01}, points=0)
    >>> found.clears, [str(name) for name in found["parameter"]]
    (False, ['alpha', 'omega'])
    """
    keys = {"tolerance": tolerance, "points": points}
    return Safety(_answered(source, "safe", keys, progress))


def trajectory(
    source: Source,
    *,
    at: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    itinerary: str | None = None,
    settle: int | None = None,
    periods: int | None = None,
    samples: int | None = None,
    progress: Progress | bool | None = None,
) -> Trajectory:
    """Simulate a time series directly, from a section point or on a periodic orbit.

    ``start`` holds offsets of section coordinates (default: all 0, the grazing orbit).
    ``itinerary`` selects a periodic orbit instead. ``settle`` returns are simulated first, without
    rows. Rows equal those of ``grazemap trajectory``.

    >>> series = trajectory(Scene.catalogue("linear"), periods=2, samples=50)
    >>> bool(series["t"][-1] > series["t"][0])
    True
    """
    keys = {
        "at": at,
        "start": start,
        "itinerary": itinerary,
        "settle": settle,
        "periods": periods,
        "samples": samples,
    }
    return Trajectory(_answered(source, "trajectory", keys, progress))


def converge(
    source: Source, *, fresh: int | None = None, progress: Progress | bool | None = None
) -> Study:
    """Compare maps of all truncation orders with direct simulation.

    ``fresh`` is the number of new points at which the chosen map is compared. Rows equal those of
    ``grazemap converge``, except for measured times.
    """
    return Study(_answered(source, "converge", {"fresh": fresh}, progress))


@older(using="method")
def image(
    m: Map,
    states: ArrayLike,
    parameters: ArrayLike | None = None,
    iterations: int = 1,
    *,
    method: str = "map",
    precision: str = "f64",
) -> Image:
    """List iterated images of states, with their contacts and whether they lie in the window.

    The arguments are those of :meth:`Map.iterate`. Rows equal those of ``grazemap image``.
    """
    rows, own, _ = m._points(states, parameters)
    check_methods(method, precision)
    return Image(m._inner.image(np.atleast_2d(rows), own, iterations, method, precision))


@older(using="method")
def fit(
    source: Source,
    data: ArrayLike | Sequence[ArrayLike],
    parameters: Sequence[str],
    *,
    at: Mapping[str, float] | None = None,
    controls: Mapping[str, float | Sequence[float]] | None = None,
    noise: Mapping[str, float] | None = None,
    piece: int | None = None,
    withheld: int | None = None,
    method: str = "guarded",
    progress: Progress | bool | None = None,
) -> Fit:
    """Fit parameters to measured section points, by least squares with exact derivatives.

    ``data`` is one series of points (returns by coordinates) or several, in offsets; NaN marks a
    coordinate that was not measured. ``parameters`` must be active; for a scene they are made so.
    ``at`` holds the initial offsets of the fit. ``controls`` are known changes of parameters: one
    number, or one for each series. ``noise`` is the standard deviation of the measurement by
    coordinate (default: that of the residuals).

    Series are cut into pieces of ``piece`` returns (default: 10; 0 leaves them whole), each with
    its own start. The last ``withheld`` points of every series are predicted instead of fitted.
    """
    m = _map_with(source, parameters)
    width = len(m.coordinates)
    series = _series(data, width)
    added = np.zeros((len(series), len(m.parameters)))
    for name, values in (controls or {}).items():
        if name not in m.parameters:
            message = f"controls: the map has no variable `{name}`; active parameters are "
            raise InputError(message + ", ".join(m.parameters))
        added[:, m.parameters.index(name)] = values
    keys = {
        "parameters": parameters,
        "at": at,
        "noise": noise,
        "piece": piece,
        "withheld": withheld,
        "method": method,
    }
    text = _json(keys)
    points = np.ascontiguousarray(np.concatenate(series))
    with shown(progress, "fit") as seen:
        lengths = [len(one) for one in series]
        return Fit(_lib.fit(m._inner, text, lengths, points, added, seen))


def _map_with(source: Source, parameters: Sequence[str]) -> Map:
    """Give the map of a source. These parameters are made active in a scene."""
    if isinstance(source, Map):
        return source
    if isinstance(source, Graze):
        return source.map()
    active = dict.fromkeys((*source.active, *parameters))
    if len(active) > len(source.active):
        source = source.with_(**{"expansion.active": list(active)})
    return source.graze().map()


def _series(data: ArrayLike | Sequence[ArrayLike], width: int) -> list[NDArray[np.float64]]:
    """Give measured points as a list of series."""
    try:
        whole = np.asarray(data, dtype=np.float64)
        several = list(whole) if whole.ndim == 3 else [whole]  # noqa: PLR2004
    except ValueError:
        several = [np.asarray(one, dtype=np.float64) for one in data]  # type: ignore[union-attr]
    for one in several:
        if one.ndim != 2 or one.shape[1] != width:  # noqa: PLR2004
            message = f"a series has rows of {width} coordinates, found shape {one.shape}"
            raise InputError(message)
    return several


@older(using="method")
def noise(
    source: Source,
    deviations: Mapping[str, float],
    *,
    at: Mapping[str, float] | None = None,
    law: str = "normal",
    start: Mapping[str, float] | None = None,
    orbits: int | None = None,
    transient: int | None = None,
    keep: int | None = None,
    range: Mapping[str, tuple[float, float]] | None = None,  # noqa: A002
    cells: int | None = None,
    seed: int = 0,
    method: str = "guarded",
    progress: Progress | bool | None = None,
) -> Noise:
    """Iterate orbits with random parameters at every return, and compute their densities.

    ``deviations`` are standard deviations of active parameters (a restitution, a gap, a forcing),
    ``at`` their means as offsets, and ``law`` is ``"normal"`` or ``"uniform"``. ``orbits`` is the
    number of orbits that begin at ``start``. Each skips ``transient`` returns and then counts
    ``keep`` returns in ``cells`` cells along every coordinate, between the offsets of ``range``
    (default: the window).

    Equal seeds give equal results, on any number of threads.

    >>> m = Scene.catalogue("linear").graze().map()
    >>> found = noise(m, {"alpha": 1e-6}, at={"alpha": -1e-4}, orbits=10, keep=20, seed=1)
    >>> int(found["count"].sum()) <= 2 * 10 * 20
    True
    """
    m = _map_with(source, list(deviations))
    keys = {
        "deviations": deviations,
        "at": at,
        "law": law,
        "start": start,
        "orbits": orbits,
        "transient": transient,
        "keep": keep,
        "range": range,
        "cells": cells,
        "seed": seed,
        "method": method,
    }
    return Noise(_answered(m, "noise", keys, progress))


def report(
    source: Source,
    folder: str | PathLike[str] = "out",
    *,
    progress: Progress | bool | None = None,
) -> Path:
    """Compute everything that a scene asks for and write a report, as ``grazemap run`` does.

    Return the path of the page. The emitted crate does not state the command that reproduces it.
    """
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

    ``names`` are entries (``"thota2006/fig3"``) or papers (default: all). ``small`` uses fewer
    points and omits the longest computations. The page is ``index.html`` in ``folder``. Numbers
    that disagree with their entry raise no error: ``ended`` names them.

    >>> import tempfile
    >>> found = gallery("thota2006/fig1", tempfile.mkdtemp(), small=True)
    >>> set(found["entry"]), found.ended
    ({'thota2006/fig1'}, None)
    """
    named = [names] if isinstance(names, str) else list(names)
    options = ["--small"] if small else []
    command = [sys.executable, "-m", "grazemap", "gallery", "-q", *options, "-o", str(folder)]
    ran = subprocess.run(  # noqa: S603
        [*command, "--", *named], capture_output=True, text=True, encoding="utf-8", check=False
    )
    words = ran.stderr.strip() or None
    if ran.returncode == 0:
        return Gallery(Path(folder))
    if ran.returncode == _ENDED_OTHERWISE:
        return Gallery(Path(folder), words)
    raise (InputError if ran.returncode == _WRONG_INPUT else GrazemapError)(words)


def _answered(
    source: Source,
    command: str,
    keys: Mapping[str, object],
    progress: Progress | bool | None,
    client: Client | None = None,
) -> _lib.Computed:
    """Compute the result of a command with these keys; keys that are `None` are omitted."""
    text = _json(keys, command)
    found = shares(client, _answer_share, source, text)
    with shown(progress, command) as seen:
        return _lib.answer(source._inner, text, seen, found)


def _answer_share(source: Source, command: str, number: int, of: int) -> bytes:
    return _lib.answer_share(source._inner, command, number, of)


def _json(keys: Mapping[str, object], command: str | None = None) -> str:
    """Write keys as JSON, which has no NaN and no infinity; keys that are `None` are omitted."""
    given = {key: value for key, value in keys.items() if value is not None}
    for key in _COUNTS & given.keys():
        count = given[key]
        if isinstance(count, (int, np.integer)) and not 0 <= count < _MOST:
            message = f"{key}: expected a whole number from 0 to {_MOST - 1}, found {count}"
            raise InputError(message)
    asked = {command: given} if command else given
    try:
        return json.dumps(asked, default=_plain, allow_nan=False)
    except ValueError:
        wrong = next(key for key, value in given.items() if not _is_finite(value))
        message = f"{wrong}: expected finite numbers, found {given[wrong]}"
        raise InputError(message) from None


def _is_finite(value: object) -> bool:
    """Tell whether JSON has all numbers of a value."""
    try:
        json.dumps(value, default=_plain, allow_nan=False)
    except ValueError:
        return False
    return True


def _plain(item: object) -> object:
    """Convert a NumPy number or array to values of JSON."""
    if isinstance(item, (np.generic, np.ndarray)):
        return item.tolist()
    message = f"expected numbers, texts, lists or mappings, found {type(item).__name__}"
    raise TypeError(message)


def _drawn(
    m: Map,
    kind: str,
    keys: Mapping[str, object],
    progress: Progress | bool | None,
    client: Client | None,
    *,
    device: str = "cpu",
) -> _lib.Computed:
    """Compute the result of one table of a kind with these keys."""
    table = _toml.table(kind, keys)
    found = shares(client, _draw_share, m, (table, device))
    if client is not None:
        # Any machine will do: the shares left little to compute.
        device = "cpu"
    with shown(progress, kind) as seen:
        return _lib.draw(m._inner, table, seen, found, device)


def _draw_share(m: Map, asked: tuple[str, str], number: int, of: int) -> bytes:
    return _lib.draw_share(m._inner, *asked, number, of)
