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
    Study,
    Trajectory,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from os import PathLike

    from numpy.typing import ArrayLike, NDArray

#: What a command begins with: what is not there yet of a scene's orbit and map is computed.
Source: TypeAlias = Scene | Graze | Map
#: Exit codes of the program.
_ENDED_OTHERWISE, _WRONG_INPUT = 1, 2
#: First and last offset.
Range: TypeAlias = tuple[float | None, float | None]


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
    client: Client | None = None,
) -> Diagram:
    """Make a bifurcation diagram over offsets of a parameter.

    The arguments are the keys of ``[[diagram]]`` in a scene, with its defaults; ``using`` is its
    ``with``. The numbers are those that ``grazemap diagram`` writes. With a ``client`` of Dask the
    work is done on the workers of its cluster, in shares, and the numbers are the same to the bit.

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
    return Diagram(_drawn(m, "diagram", keys, progress, client))


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
    device: str = "cpu",
    progress: Progress | bool | None = None,
    client: Client | None = None,
) -> Chart:
    """Make a two-parameter chart over offsets, the horizontal parameter first.

    The arguments are the keys of ``[[chart]]`` in a scene, with its defaults; ``using`` is its
    ``with``. The numbers are those that ``grazemap chart`` writes. With a ``client`` of Dask the
    work is done on the workers of its cluster, in shares, and the numbers are the same to the bit.
    So they are with the ``device`` ``"cuda"``, a graphics processor, of the workers where there are
    any.
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
    return Chart(_drawn(m, "chart", keys, progress, client, device=device))


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
    client: Client | None = None,
) -> Basin:
    """Find the attractors and their basins in a plane of the section.

    The arguments are the keys of ``[[basin]]`` in a scene, with its defaults; ``using`` is its
    ``with``. The numbers are those that ``grazemap basin`` writes. With a ``client`` of Dask the
    work is done on the workers of its cluster, in shares, and the numbers are the same to the bit.
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
    return Basin(_drawn(m, "basin", keys, progress, client))


def branch(
    source: Source,
    along: str,
    range: Range | None = None,  # noqa: A002
    *,
    at: Mapping[str, float] | None = None,
    itineraries: Sequence[str] = (),
    period: int | None = None,
    using: str = "map",
    starts: Sequence[Mapping[str, float]] = (),
    observe: Sequence[str] = (),
    iterates: bool = False,
    progress: Progress | bool | None = None,
    client: Client | None = None,
) -> Branch:
    """Follow branches of periodic orbits in one parameter, through folds, flips and grazes.

    ``range`` holds offsets of ``along``, by default those of the window; ``at`` those of other
    parameters. ``itineraries`` are digits (1 contact, 0 none); none are all of short periods, or
    of up to ``period`` returns. ``using`` is ``"map"`` or ``"direct"``, ``observe`` some of
    ``"h"``, ``"impact_speed"``, ``"contact_time"``, ``"amplitude"``. Direct simulation looks for
    orbits from ``starts`` too, offsets of coordinates by name. With ``iterates`` the figures
    show the iterates of the scene's diagram over the same parameter below the branches.

    The rows are those of ``grazemap branch``. With a ``client`` of Dask the work is done on the
    workers of its cluster, in shares, and the numbers are the same to the bit.

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
        "using": using,
        "starts": starts,
        "observe": observe,
        "iterates": iterates,
    }
    return Branch(_answered(source, "branch", keys, progress, client))


def loci(
    source: Source,
    parameters: tuple[str, str],
    range: Range | None = None,  # noqa: A002
    *,
    kind: str | Sequence[str] = (),
    at: Mapping[str, float] | None = None,
    itineraries: Sequence[str] = (),
    using: str = "map",
    chart: bool = False,
    progress: Progress | bool | None = None,
) -> Loci:
    """Follow loci of periodic orbits in two parameters, with their points of codimension two.

    ``range`` holds offsets of the first parameter, by default those of the window; ``kind`` is
    some of ``"graze"``, ``"fold"``, ``"flip"``, ``"torus"``, ``"crisis"``, by default all but
    crises. With ``chart`` the figure shows the scene's chart in these parameters below the loci.

    The rows are those of ``grazemap loci``.
    """
    first, last = range or (None, None)
    keys = {
        "in": parameters,
        "from": first,
        "to": last,
        "kind": [kind] if isinstance(kind, str) else kind,
        "at": at,
        "itineraries": itineraries,
        "using": using,
        "chart": chart,
    }
    return Loci(_answered(source, "loci", keys, progress))


def orbits(
    source: Source,
    at: Mapping[str, float] | Sequence[Mapping[str, float]] = (),
    *,
    itineraries: Sequence[str] = (),
    period: int | None = None,
    using: str = "map",
    kind: str | Sequence[str] = (),
    parameters: Sequence[str] = (),
    range: Range | None = None,  # noqa: A002
    points: int | None = None,
    progress: Progress | bool | None = None,
) -> Orbits:
    """Find periodic orbits by itinerary, and where they fold and flip.

    ``at`` holds offsets of parameters, by default a tenth of the window on both sides of the graze.
    With ``kind``, ``"fold"`` or ``"flip"`` or both, the rows are those changes of stability: solved
    for in the last of ``parameters``, while the first of two takes ``points`` values in ``range``.

    The rows are those of ``grazemap orbits``.
    """
    first, last = range or (None, None)
    keys = {
        "at": [at] if isinstance(at, dict) else at,
        "itineraries": itineraries,
        "period": period,
        "using": using,
        "kind": [kind] if isinstance(kind, str) else kind,
        "in": parameters,
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

    ``range`` holds values of ``along``, no offsets. The rows are those of ``grazemap curve``.

    >>> traced = curve(Scene.catalogue("linear"), "omega", (1.75, 1.85))
    >>> traced.ended is None
    True
    """
    keys = {"with": along, "from": range[0], "to": range[1], "xi": xi}
    return Curve(_answered(source, "curve", keys, progress))


def nearest(
    source: Source,
    parameters: Sequence[str],
    *,
    scale: Mapping[str, float] | None = None,
    progress: Progress | bool | None = None,
) -> Nearest:
    """Find the smallest change of one or two parameters at which the orbit grazes.

    ``scale`` is what a change of a parameter is counted in, by default its value. The rows are
    those of ``grazemap curve --nearest``.
    """
    keys = {"nearest": parameters, "scale": scale}
    return Nearest(_answered(source, "nearest", keys, progress))


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
    """Simulate time series directly: from a point of the section, or on a periodic orbit.

    ``start`` holds offsets of the section's coordinates, by default all 0, the grazing orbit;
    ``itinerary`` names a periodic orbit instead; ``settle`` returns are simulated first, without
    rows. The rows are those of ``grazemap trajectory``.

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

    ``fresh`` is the number of points at which the chosen map is compared. The rows are those of
    ``grazemap converge``, with the times measured.
    """
    return Study(_answered(source, "converge", {"fresh": fresh}, progress))


def image(
    m: Map,
    states: ArrayLike,
    parameters: ArrayLike | None = None,
    iterations: int = 1,
    *,
    using: str = "map",
    precision: str = "f64",
) -> Image:
    """List images of rows of states, iterated: whether each has contacts and lies in the window.

    The arguments are those of :meth:`Map.iterate`, the rows those of ``grazemap image``.
    """
    rows, own, _ = m._points(states, parameters)
    check_methods(using, precision)
    return Image(m._inner.image(np.atleast_2d(rows), own, iterations, using, precision))


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
    using: str = "guarded",
    progress: Progress | bool | None = None,
) -> Fit:
    """Fit parameters to measured section points, by least squares with exact derivatives.

    ``data`` is one series of points (returns by coordinates), or several: offsets, NaN where a
    coordinate was not measured. ``parameters`` are active; of a scene they are made so. ``at``
    holds the offsets that the fit begins with; ``controls`` what is known to be added to
    parameters, a number or one for each series. ``noise`` is the standard deviation of the
    measurement by coordinate, by default that of the residuals.

    Series are cut into pieces of ``piece`` returns (by default 10; 0: none is cut), each with a
    start of its own. The last ``withheld`` points of every series are predicted and not fitted.
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
        "using": using,
    }
    text = _json(keys)
    points = np.ascontiguousarray(np.concatenate(series))
    with shown(progress, "fit") as seen:
        lengths = [len(one) for one in series]
        return Fit(_lib.fit(m._inner, text, lengths, points, added, seen))


def _map_with(source: Source, parameters: Sequence[str]) -> Map:
    """Give the map of a source; that of a scene keeps these parameters as variables."""
    if isinstance(source, Map):
        return source
    if isinstance(source, Graze):
        return source.map()
    active = dict.fromkeys((*source.active, *parameters))
    if len(active) > len(source.active):
        source = source.with_(**{"expansion.active": list(active)})
    return source.graze().map()


def _series(data: ArrayLike | Sequence[ArrayLike], width: int) -> list[NDArray[np.float64]]:
    """Give measured points as series."""
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
    using: str = "guarded",
    progress: Progress | bool | None = None,
) -> Noise:
    """Iterate with parameters that are drawn afresh at every return, and count densities.

    ``deviations`` are standard deviations of active parameters, be they a restitution, a gap or a
    forcing; ``at`` their means, as offsets; ``law`` is ``"normal"`` or ``"uniform"``. ``orbits``
    start at ``start``, leave out ``transient`` returns and count ``keep`` in ``cells`` cells along
    every coordinate, between the offsets of ``range``, by default the window.

    Equal seeds give equal numbers, on any number of threads.

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
        "using": using,
    }
    return Noise(_answered(m, "noise", keys, progress))


def report(
    source: Source,
    folder: str | PathLike[str] = "out",
    *,
    progress: Progress | bool | None = None,
) -> Path:
    """Compute all that a scene asks for and write it with a page, as ``grazemap run`` does.

    The path of the page is given back; the emitted crate does not say by which command it was made.
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
    """Compute published figures and tables again, as ``grazemap gallery`` does.

    ``names`` are entries (``"thota2006/fig3"``) or papers, by default all; ``small`` takes fewer
    points and leaves out the longest computations. The page is ``index.html`` in ``folder``. What
    is not as its entry says is data: ``ended`` names it.

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
    """Compute what a command with these keys asks for; keys that are `None` are left out."""
    text = _json(keys, command)
    found = shares(client, _answer_share, source, text)
    with shown(progress, command) as seen:
        return _lib.answer(source._inner, text, seen, found)


def _answer_share(source: Source, command: str, number: int, of: int) -> bytes:
    return _lib.answer_share(source._inner, command, number, of)


def _json(keys: Mapping[str, object], command: str | None = None) -> str:
    """Give keys as JSON, which has no NaN and no infinity; keys that are `None` are left out."""
    given = {key: value for key, value in keys.items() if value is not None}
    for key, value in given.items():
        try:
            json.dumps(value, default=_plain, allow_nan=False)
        except ValueError:
            message = f"{key}: expected finite numbers, found {value}"
            raise InputError(message) from None
    return json.dumps({command: given} if command else given, default=_plain)


def _plain(item: object) -> object:
    """Give a number or an array of NumPy as JSON has it."""
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
    """Compute what one table of a kind with these keys asks for."""
    table = _toml.table(kind, keys)
    found = shares(client, _draw_share, m, (table, device))
    if client is not None:
        # What the shares left is little, on any machine.
        device = "cpu"
    with shown(progress, kind) as seen:
        return _lib.draw(m._inner, table, seen, found, device)


def _draw_share(m: Map, asked: tuple[str, str], number: int, of: int) -> bytes:
    return _lib.draw_share(m._inner, *asked, number, of)
