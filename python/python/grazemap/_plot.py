"""Plots of results with Matplotlib."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from ._errors import InputError, NoResult
from ._style import (
    CELLS,
    CHAOS,
    FAINT,
    GREY,
    INK,
    MARKS,
    PALE,
    PAPER,
    RIM,
    ROOMY,
    SERIES,
    Entry,
    Flags,
    Numbers,
    Style,
    cells,
    dots,
    grazing_words,
    image,
    joined,
    key,
    label,
    legend,
    line_handle,
    mark_style,
    new_axes,
    offset_label,
    plain_ticks,
    rim,
    symbol,
    width,
    words_beside,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from ._table import (
        Basin,
        Branch,
        Chart,
        Curve,
        Diagram,
        Fit,
        Image,
        Loci,
        Noise,
        Safety,
        Study,
        Table,
        Trajectory,
    )

#: Lines of every name and kind: ``stable``, ``unstable`` or ``virtual``.
Parts: TypeAlias = dict[tuple[str, str], list[tuple[Numbers, Numbers]]]
#: Longest period, and number of itineraries, with colours of their own.
OWN_COLORS = 8
#: Largest number of points of an attractor that are drawn with a ring each.
MARKED = 64
#: Kinds of loci, with the letters of their bifurcation.
KINDS = {"graze": "GR", "fold": "SN", "flip": "PD", "torus": "NS", "crisis": "CR"}
#: Special points nearer than this share of the extent of all curves share a mark.
ONE_MARK = 1e-6
#: Least Lyapunov exponent of an attractor that is called chaotic.
CHAOTIC = 1e-3
#: Largest share of its range by which a gap differs from an affine function.
AFFINE = 1e-9


def columns(table: Table, ax: Axes | None, x: str | None, y: str | None, style: Style) -> Axes:
    """Draw one column of numbers over another."""
    across, up = _numbers(table, x, "x"), _numbers(table, y, "y")
    ax = new_axes(ax)
    ax.plot(across, up, **{"marker": ".", "linestyle": "none", "color": SERIES[0], **style})
    ax.set(xlabel=label(str(x)), ylabel=label(str(y)))
    plain_ticks(ax)
    return ax


def _numbers(table: Table, name: str | None, argument: str) -> Numbers:
    """Give a column of numbers, or say which ones there are."""
    known = [other for other, column in table.items() if column.dtype != object]
    if name in known:
        _filled(table)
        return np.asarray(table[name], dtype=np.float64)
    what = f"{table.command or 'this table'} has no plot of its own; " if name is None else ""
    found = "" if name is None else f", found {name!r}"
    message = f"{argument}: {what}expected a column of numbers ({', '.join(known)}){found}"
    raise InputError(message)


def _filled(table: Table) -> None:
    """Refuse a table without rows."""
    if not len(next(iter(table.values()), ())):
        message = f"nothing to plot: {table.ended or 'the table has no rows'}"
        raise NoResult(message)


class Offsets:
    """Axis of a parameter: what is added to offsets, and its label."""

    def __init__(self, name: str, grazing: float, values: bool) -> None:
        """Keep the parameter's grazing value; with ``values`` it is added to offsets."""
        self.shift = grazing if values else 0.0
        self._name, self._grazing, self._values = name, grazing, values

    def label(self, room: float) -> str:
        """Give the label of an axis of some length: long ones have the grazing value."""
        if self._values:
            return label(self._name)
        words = offset_label(self._name)
        if room < ROOMY:
            return words
        return f"{words}   ({grazing_words(self._name, self._grazing)})"


def _mark_graze(ax: Axes, at: float, words: str = "graze") -> None:
    """Draw a vertical line with words at the graze if it is in view."""
    low, high = sorted(ax.get_xlim())
    if not low <= at <= high:
        return
    ax.axvline(at, color=FAINT, linewidth=0.8, linestyle=":", zorder=1)
    side = -1 if at > low + 0.8 * (high - low) else 1
    ax.annotate(
        words,
        (at, 1.0),
        xycoords=ax.get_xaxis_transform(),
        xytext=(3 * side, -3),
        textcoords="offset points",
        ha="left" if side > 0 else "right",
        va="top",
        fontsize="small",
        color=FAINT,
        path_effects=rim(RIM),
    )


def diagram(table: Diagram, ax: Axes | None, values: bool, style: Style) -> Axes:
    """Draw a bifurcation diagram."""
    document = table._head
    ends = table["end"]
    trusted = ends != "outside"
    sweeps = list(dict.fromkeys(zip(table["method"], table["heading"], strict=True)))
    several = len({method for method, _ in sweeps}) > 1
    axis = Offsets(document["parameter"], document["grazing_value"], values)
    shift, clouds = axis.shift, []
    for number, (method, heading) in enumerate(sweeps):
        rows = (table["method"] == method) & (table["heading"] == heading)
        name = f"{method}, {heading}" if several else heading
        clouds.append((name, SERIES[number % len(SERIES)], table.points(rows & trusted)))
    clouds.append(("outside the window", GREY, table.points(~trusted)))
    clouds = [cloud for cloud in clouds if cloud[2][0].size]
    if not clouds:
        message = f"nothing to plot: all {len(ends)} orbits ended early ({', '.join(set(ends))})"
        raise NoResult(message)
    ax = new_axes(ax)
    handles: list[Artist] = []
    for number, (name, color, (offsets, heights)) in enumerate(clouds):
        # Larger dots below others show a rim.
        size = 1.0 + 0.9 * (len(clouds) - 1 - number)
        dots(ax, (offsets + shift, heights), size, **{"color": color, "zorder": 2, **style})
        handles.append(line_handle(name, marker="o", markersize=4, linestyle="none", color=color))
    left = table["offset"][(ends == "escaped") | (ends == "no image")]
    if left.size:
        marks: Style = {"marker": "|", "linestyle": "none", "color": FAINT, "markersize": 4}
        bottom = np.full(left.size, 0.02)
        ax.plot(left + shift, bottom, transform=ax.get_xaxis_transform(), **marks)
        handles.append(line_handle("escaped", **marks))
    if document["is_logarithmic"] and not values:
        _scale_by_powers(ax, table["offset"])
    else:
        offsets = table["offset"] + shift
        if offsets.min() < offsets.max():
            ax.set_xlim(offsets.min(), offsets.max())
        _mark_graze(ax, shift)
    observed = document["observable"]
    ax.set(xlabel=axis.label(width(ax)), ylabel=f"{label(observed)} at the section")
    plain_ticks(ax)
    legend(ax, handles if len(handles) > 1 else [])
    return ax


def _scale_by_powers(ax: Axes, offsets: Numbers) -> None:
    """Make the axis of offsets logarithmic, in their size below the graze."""
    if offsets.min() > 0:
        ax.set_xscale("log")
    else:
        ax.set_xscale("symlog", linthresh=max(0.1 * np.abs(offsets).min(), np.finfo(float).tiny))


def chart(table: Chart, ax: Axes | None, number: int, values: bool, style: Style) -> Axes:
    """Draw one chart of a table as an image with a key."""
    documents = table._heads
    if not 1 <= number <= len(documents):
        message = f"number: expected a chart from 1 to {len(documents)}, found {number}"
        raise InputError(message)
    document = documents[number - 1]
    axes = document["axes"]
    pair = [Offsets(axis["parameter"], axis["grazing_value"], values) for axis in axes]
    shifts = [axis.shift for axis in pair]
    across, up = (np.array(axes[n]["offsets"]) + shifts[n] for n in range(2))
    rows = table["chart"] == number
    classes, entries = _chart_classes(table, rows, document)
    ax = new_axes(ax)
    shape = (up.size, across.size)
    found = cells(ax, (across, up), classes.reshape(shape), entries, style)
    exponents = table["lyapunov"][rows].reshape(shape)
    if document["observe"] == "lyapunov" and np.isfinite(exponents).any():
        drawn = np.ma.masked_invalid(exponents)
        largest = float(np.abs(drawn).max()) or 1.0
        colors: Style = {"cmap": "PuOr_r", "vmin": -largest, "vmax": largest, **style}
        _scale(ax, image(ax, (across, up), drawn, **colors), "largest Lyapunov exponent")
    over = [_plane_curve(curve) for overlay in document["overlay"] for curve in overlay["curves"]]
    limits = {"xlim": ax.get_xlim(), "ylim": ax.get_ylim()}
    parts = _loci_parts(over, shifts, virtual=False)
    handles = _draw_loci(ax, over, parts, shifts, {"path_effects": rim(1.6 + RIM)})
    ax.set(**limits, xlabel=pair[0].label(width(ax)), ylabel=pair[1].label(0.0))
    plain_ticks(ax)
    key(ax, found, document["observe"])
    legend(ax, handles)
    return ax


def _scale(ax: Axes, drawn: Any, words: str) -> None:
    """Draw the scale of an image of numbers."""
    figure = ax.get_figure()
    if figure is None:
        return
    scale = figure.colorbar(drawn, ax=ax, label=words, pad=0.02)
    scale.outline.set_visible(False)
    scale.ax.ticklabel_format(axis="y", style="sci", scilimits=(-2, 4), useMathText=True)
    scale.ax.yaxis.get_offset_text().set_horizontalalignment("left")


def _chart_classes(
    table: Chart, rows: Flags, document: Mapping[str, Any]
) -> tuple[NDArray[np.int_], list[Entry]]:
    """Give the class of every cell of a chart by number, and all classes."""
    observed, longest = document["observe"], document["longest_period"]
    ends, periods = table["end"][rows], np.nan_to_num(table["period"][rows]).astype(int)
    if observed == "itinerary":
        words = table["itinerary"][rows]
        common = [word for word, _ in Counter(filter(None, words)).most_common(OWN_COLORS)]
        common.sort(key=lambda word: (len(word), word))
        entries = [(word, CELLS[place], False) for place, word in enumerate(common)]
        entries.append(("other", CELLS[OWN_COLORS], False))
        places = {word: place for place, word in enumerate(common)}
        classes = np.array([places.get(word, len(common)) for word in words], dtype=int)
    elif observed == "attractors":
        counts = table["attractors"][rows].astype(int)
        entries = [(str(count + 1), CELLS[count % len(CELLS)], False) for count in range(16)]
        classes = counts - 1
    elif observed == "lyapunov":
        entries = [("", PALE, False)]
        classes = np.zeros(periods.shape, dtype=int)
    else:
        entries = [("no contact", PALE, False)]
        entries += [(str(place + 1), CELLS[place], False) for place in range(OWN_COLORS)]
        entries.append((f"{OWN_COLORS + 1} to {longest}", CELLS[OWN_COLORS], False))
        classes = np.minimum(periods, OWN_COLORS + 1)
        classes[(periods == 1) & _without_contact(table, rows)] = 0
    apart = [
        ("escaped", PAPER, ~np.isin(ends, ["completed", "outside"])),
        ("outside the window", GREY, ends == "outside"),
    ]
    if observed != "lyapunov":
        converging = table["converging"][rows] == 1
        unsettled = (ends == "completed") & (periods == 0)
        apart.append((f"none up to {longest}", CHAOS, unsettled & ~converging))
        apart.append(("still converging", FAINT, unsettled & converging))
    counted = observed == "attractors"
    for name, color, mask in reversed(apart):
        classes[mask & (classes < 0) if counted else mask] = len(entries)
        entries.append((name, color, True))
    return classes, entries


def _without_contact(table: Chart, rows: Flags) -> Flags:
    """Tell which orbits hit no surface, by their names such as ``(0,1)``."""
    (names,) = (table[name][rows] for name in table if name.startswith("orbit ("))
    free = {name for name in set(names) if not any(map(int, name.strip("()").split(",")[:-1]))}
    silent: Flags = np.isin(names, list(free)) & (table["kept_contacts"][rows] == 0)
    return silent


def basin(table: Basin, ax: Axes | None, style: Style) -> Axes:
    """Draw basins of attraction as an image, with the points of the attractors."""
    document = table._head
    attractors = document["attractors"]
    entries = [
        (f"{number + 1}: {_attractor_words(found)}", _attractor_color(number), False)
        for number, found in enumerate(attractors)
    ]
    names = [str(number + 1) for number in range(len(attractors))]
    for name, words, color in (
        ("undecided", "undecided", FAINT),
        ("no image", "no image", PALE),
        ("outside", "outside the window", GREY),
        ("escaped", "escaped", PAPER),
    ):
        names.append(name)
        entries.append((words, color, True))
    across, up = (np.array(axis["offsets"]) for axis in document["axes"])
    numbers = {name: number for number, name in enumerate(names)}
    classes = np.array([numbers[word] for word in table["attractor"]])
    ax = new_axes(ax)
    found = cells(ax, (across, up), classes.reshape(up.size, across.size), entries, style)
    limits = {"xlim": ax.get_xlim(), "ylim": ax.get_ylim()}
    plane = [axis["coordinate"] for axis in document["axes"]]
    places = [document["coordinates"].index(name) for name in plane]
    handles = _draw_manifolds(ax, document.get("manifolds"), places)
    for number, attractor in enumerate(attractors):
        points = np.array(attractor["states"])[:, places]
        _draw_attractor(ax, str(number + 1), points)
    ax.set(**limits, xlabel=offset_label(plane[0]), ylabel=offset_label(plane[1]))
    plain_ticks(ax)
    key(ax, found, "attractor")
    legend(ax, handles)
    return ax


def _attractor_color(number: int) -> str:
    return SERIES[number % len(SERIES)]


def _attractor_words(found: Mapping[str, Any]) -> str:
    """Write period and itinerary of an attractor."""
    period = found["period"].get("periodic") if isinstance(found["period"], dict) else None
    itinerary = found["itinerary"]
    if period is None:
        exponent = found["lyapunov"]
        return "chaotic" if exponent is not None and exponent > CHAOTIC else "no period"
    if itinerary is not None and len(itinerary) <= OWN_COLORS:
        return f"period {period} ({itinerary})"
    return f"period {period}"


def _draw_attractor(ax: Axes, name: str, points: Numbers) -> None:
    """Mark the points of an attractor; periodic ones have a ring each and their number."""
    if len(points) > MARKED:
        dots(ax, (points[:, 0], points[:, 1]), color=INK, zorder=3)
        return
    ax.plot(points[:, 0], points[:, 1], **mark_style("GR"))
    words_beside(ax, name, (points[0, 0], points[0, 1]))


def _draw_manifolds(ax: Axes, found: Any, places: Sequence[int]) -> list[Artist]:
    """Draw stable and unstable manifolds with their saddles; give the entries of the legend."""
    if not found:
        return []
    handles: list[Artist] = []
    for kind, color in (("stable", INK), ("unstable", SERIES[1])):
        pieces = [
            np.array([*piece, [np.nan, np.nan]])[:, places]
            for branch in found["branches"]
            if branch["kind"] == kind
            for piece in branch["pieces"]
        ]
        if pieces:
            line = np.concatenate(pieces)
            style: Style = {"color": color, "linewidth": 1.2}
            ax.plot(line[:, 0], line[:, 1], path_effects=rim(1.2 + RIM), zorder=2.5, **style)
            handles.append(line_handle(f"{kind} manifold", **style))
    saddles = [state for saddle in found["saddles"] for state in saddle["states"]]
    if saddles:
        points = np.array(saddles)[:, places]
        cross: Style = {"marker": "X", "linestyle": "none", "color": INK, "markeredgecolor": PAPER}
        ax.plot(points[:, 0], points[:, 1], zorder=4, markersize=7, **cross)
        handles.append(line_handle("saddle", markersize=7, **cross))
    return handles


def branch(
    table: Branch,
    ax: Axes | None,
    names: tuple[str | None, str | None],
    shown: tuple[bool, bool],
    style: Style,
) -> Axes:
    """Draw branches of periodic orbits with their special points.

    ``shown`` tells whether virtual orbits and values are drawn.
    """
    _filled(table)
    document = table.document
    coordinates, along = document["section"]["coordinates"], document["along"]
    x, y = names[0] or along, names[1] or coordinates[0]
    virtual, values = shown
    axis = Offsets(along, document["grazing_parameters"][along], values)
    shift = axis.shift if x == along else 0.0
    parts: Parts = {}
    marks: dict[str, list[tuple[float, float]]] = {}
    for rows, orbits, returned in _returns(table, coordinates, y):
        across = _numbers(table, x, "x")[rows] + shift
        segments = _segments(table, rows)
        if not virtual:
            del segments["virtual"]
        for kind, drawn in segments.items():
            for name in dict.fromkeys(orbits[1:]):
                _add(parts, (name, kind), joined(across, returned, drawn & (orbits[1:] == name)))
        labels = table["label"][rows]
        for place in np.flatnonzero((labels != "") & _ends(*segments.values())):
            spots = marks.setdefault(labels[place], [])
            spots.append((float(across[place]), float(returned[place])))
    ax = _axes_for(parts, ax)
    handles = _draw_parts(ax, parts, style)
    for word, spots in sorted(marks.items(), key=lambda mark: list(MARKS).index(mark[0])):
        look = mark_style(word)
        ax.plot(*np.array(spots).T, label=word, **look)
        handles.append(line_handle(word, **look))
    if x == along:
        _mark_graze(ax, shift, "" if "GR" in marks else "graze")
    ax.set_xlabel(axis.label(width(ax)) if x == along else label(x))
    ax.set_ylabel(offset_label(y) if y in coordinates else label(y))
    plain_ticks(ax)
    legend(ax, handles)
    return ax


def _add(parts: Parts, part: tuple[str, str], line: tuple[Numbers, Numbers]) -> None:
    """Add a line to a part, unless it is empty."""
    if line[0].size:
        parts.setdefault(part, []).append(line)


def _axes_for(parts: Parts, ax: Axes | None) -> Axes:
    """Give axes for some lines, or say that all orbits are virtual."""
    if not parts:
        message = "nothing to plot: all orbits are virtual; virtual=True draws them"
        raise NoResult(message)
    return new_axes(ax)


def _ends(*segments: Flags) -> Flags:
    """Tell which points are an end of a segment that is drawn."""
    drawn = np.any(segments, axis=0)
    ends: Flags = np.append(drawn, False) | np.append(False, drawn)
    return ends


def _orbit_names(passages: Sequence[str], found: Mapping[str, Any]) -> NDArray[Any]:
    """Give the name of every orbit of a branch: its itinerary, where that tells orbits apart."""
    several = len(set(passages)) > 1

    def name(point: Mapping[str, Any]) -> str:
        more = (point.get("extra_contacts") or 0) > 0 or (point.get("turns") or 0) != 0
        return f"orbit {point['name']}" if several or more else f"itinerary {found['itinerary']}"

    return np.array([name(point) for point in found["points"]], dtype=object)


def _segments(table: Branch, rows: slice) -> dict[str, Flags]:
    """Give the stable, unstable and virtual segments between the points of a branch.

    A special point, and one without multipliers, belongs to both its sides.
    """
    special = table["label"][rows] != ""
    physical = table["physical"][rows] == 1
    stable = np.asarray(table["stable"][rows], dtype=np.float64)
    both = special | ~np.isfinite(stable)
    plain = ~(special[:-1] & special[1:])
    found = {}
    for kind, wanted in (("stable", 1.0), ("unstable", 0.0)):
        belongs = physical & (both | (stable == wanted))
        found[kind] = belongs[:-1] & belongs[1:] & plain
    found["virtual"] = ~(physical[:-1] & physical[1:])
    return found


def _returns(
    table: Branch, coordinates: Sequence[str], y: str
) -> Iterator[tuple[slice, NDArray[Any], Numbers]]:
    """Give every branch: its rows, the names of its orbits, and what is drawn of them.

    A coordinate is given once for every return, another column once.
    """
    column, first = _numbers(table, y, "y"), 0
    for found in table.document["branches"]:
        points = found["points"]
        rows = slice(first, first + len(points))
        first = rows.stop
        names = _orbit_names(table.document["passages"], found)
        if y not in coordinates:
            yield rows, names, column[rows]
            continue
        place = coordinates.index(y)
        for number in range(len(points[0]["states"])):
            yield rows, names, np.array([point["states"][number][place] for point in points])


#: Line styles of the parts of branches and loci.
STROKES: dict[str, Style] = {
    "stable": {"linestyle": "-"},
    "unstable": {"linestyle": (0, (4, 2))},
    "virtual": {"linestyle": ":", "color": GREY},
}


def _draw_parts(
    ax: Axes,
    parts: Parts,
    style: Style,
    colors: Mapping[str, str] | None = None,
) -> list[Artist]:
    """Draw lines by name and kind, virtual ones below; give the entries of the legend."""
    names = list(dict.fromkeys(name for name, kind in parts if kind != "virtual"))
    if colors is None:
        colors = {name: SERIES[place % len(SERIES)] for place, name in enumerate(names)}
    unnamed = set(names)
    for name, kind in sorted(parts, key=lambda part: part[1] != "virtual"):
        across, up = (np.concatenate(pieces) for pieces in zip(*parts[name, kind], strict=True))
        look: Style = {"color": colors.get(name, GREY), "linewidth": 1.6, **STROKES[kind]}
        if kind != "virtual" and name in unnamed:
            unnamed.remove(name)
            look["label"] = name
        ax.plot(across, up, **{"zorder": 2, **look, **style})
    handles: list[Artist] = [line_handle(name, color=colors[name]) for name in names]
    kinds = {kind for _, kind in parts}
    if kinds == {"stable"}:
        return handles
    for kind, look in STROKES.items():
        if kind in kinds:
            handles.append(line_handle(kind, **{"color": INK, **look}))
    return handles


def loci(
    table: Loci,
    ax: Axes | None,
    names: tuple[str | None, str | None],
    shown: tuple[bool | None, bool, bool],
    style: Style,
) -> Axes:
    """Draw loci in the plane of two parameters, or measured from the grazing curve.

    ``shown`` tells whether loci are measured from that curve (``None``: on new axes), and whether
    virtual orbits and values are drawn.
    """
    if names != (None, None):
        return columns(table, ax, *names, style)
    _filled(table)
    from_graze, virtual, values = shown
    document = table.document
    plane, grazing = document["plane"], document["grazing_parameters"]
    curves = [
        {**locus, "points": [_plane_point(point, plane) for point in locus["points"]]}
        for locus in document["loci"]
    ]
    axes = [Offsets(name, grazing[name], values) for name in plane]
    shifts = [axis.shift for axis in axes]
    up = axes[1].label(0.0)
    drawn = list(map(_plane_curve, curves))
    graze = _grazing_curve(drawn)
    if from_graze and graze is None:
        message = "from_graze: these loci hold no graze of an orbit without contact"
        raise InputError(message)
    if graze is not None and (ax is None if from_graze is None else from_graze):
        for curve in drawn:
            curve["at"] = _above(curve["at"], graze)
        shifts[1], letter = 0.0, symbol(plane[1])
        up = rf"${letter} - {letter}_\mathrm{{graze}}$"
    parts = _loci_parts(drawn, shifts, virtual=virtual)
    ax = _axes_for(parts, ax)
    handles = _draw_loci(ax, drawn, parts, shifts, style)
    ax.set(xlabel=axes[0].label(width(ax)), ylabel=up)
    plain_ticks(ax)
    legend(ax, handles)
    return ax


def _plane_point(point: Mapping[str, Any], plane: Sequence[str]) -> dict[str, Any]:
    return {**point, "at": [point["parameters"][name] for name in plane]}


def _plane_curve(curve: Mapping[str, Any]) -> dict[str, Any]:
    """Give a locus as arrays."""
    points = curve["points"]
    return {
        "kind": curve["kind"],
        "itinerary": curve["itinerary"],
        "at": np.array([point["at"] for point in points], dtype=np.float64).reshape(-1, 2),
        "stable": np.array([point["stable"] for point in points], dtype=bool),
        "physical": np.array([point["physical"] for point in points], dtype=bool),
        "labels": [point.get("label") for point in points],
    }


def _grazing_curve(curves: Sequence[Mapping[str, Any]]) -> Numbers | None:
    """Give the points of the graze of the orbit without contact, from left to right."""
    for curve in curves:
        if curve["kind"] == "graze" and "1" not in curve["itinerary"]:
            at: Numbers = curve["at"]
            return at[np.argsort(at[:, 0], kind="stable")]
    return None


def _above(at: Numbers, graze: Numbers) -> Numbers:
    """Give points with their second parameter measured from the grazing curve."""
    level = np.interp(at[:, 0], graze[:, 0], graze[:, 1], left=np.nan, right=np.nan)
    return np.column_stack([at[:, 0], at[:, 1] - level])


def _loci_parts(
    curves: Sequence[Mapping[str, Any]], shifts: Sequence[float], *, virtual: bool
) -> Parts:
    """Give the lines of loci by kind and stability."""
    parts: Parts = {}
    for curve in sorted(curves, key=lambda curve: list(KINDS).index(curve["kind"])):
        at, name = curve["at"] + np.asarray(shifts), f"{curve['kind']} ({KINDS[curve['kind']]})"
        physical, stable = curve["physical"][:-1], curve["stable"][:-1]
        kinds = {"stable": physical & stable, "unstable": physical & ~stable, "virtual": ~physical}
        for kind, drawn in kinds.items():
            if virtual or kind != "virtual":
                _add(parts, (name, kind), joined(at[:, 0], at[:, 1], drawn))
    return parts


def _draw_loci(
    ax: Axes,
    curves: Sequence[Mapping[str, Any]],
    parts: Parts,
    shifts: Sequence[float],
    style: Style,
) -> list[Artist]:
    """Draw loci and their points of codimension two; give the entries of the legend."""
    colors = {f"{kind} ({word})": SERIES[place] for place, (kind, word) in enumerate(KINDS.items())}
    handles = _draw_parts(ax, parts, style, colors)
    for at, words in _codimension_two(curves, np.asarray(shifts)):
        ax.plot(*at, **mark_style("GR"))
        words_beside(ax, words, (at[0], at[1]))
    return handles


def _codimension_two(
    curves: Sequence[Mapping[str, Any]], shifts: Numbers
) -> Iterator[tuple[Numbers, str]]:
    """Give the physical points of codimension two, with all labels of a place."""
    extent = np.max([np.abs(curve["at"]).max(axis=0) for curve in curves] or [[1.0, 1.0]], axis=0)
    found: list[tuple[Numbers, list[str]]] = []
    for curve in curves:
        for at, physical, word in zip(curve["at"], curve["physical"], curve["labels"], strict=True):
            if not physical or not word or not np.isfinite(at).all():
                continue
            near = (
                labels for other, labels in found if (np.abs(other - at) <= ONE_MARK * extent).all()
            )
            labels = next(near, None)
            if labels is None:
                found.append((at, [word]))
            # A graze's own label implies that loci end there.
            elif word not in labels and not (
                labels[0].startswith("xi") and not word.startswith("xi")
            ):
                labels.append(word)
    for at, labels in found:
        yield (
            at + shifts,
            ", ".join(f"${symbol(word)}$" if word.startswith("xi") else word for word in labels),
        )


def curve(
    table: Curve,
    ax: Axes | None,
    names: tuple[str | None, str | None],
    style: Style,
) -> Axes:
    """Draw a grazing curve in the plane of two of its columns, with its zeros of ``xi_n``."""
    _filled(table)
    document = table.document
    adjusted, *_, along = document["free"]
    x, y = names[0] or along, names[1] or adjusted
    across, up = _numbers(table, x, "x"), _numbers(table, y, "y")
    multipliers = [
        np.hypot(table[name], table[name.replace("_re", "_im")])
        for name in table
        if name.startswith("multiplier_") and name.endswith("_re")
    ]
    stable = np.all(np.array(multipliers) < 1, axis=0)[:-1]
    physical = (table["physical"] == 1)[:-1]
    strokes = [
        ("stable without the stop", physical & stable, STROKES["stable"]),
        ("unstable without the stop", physical & ~stable, STROKES["unstable"]),
        ("passes through a stop", ~physical, STROKES["virtual"]),
    ]
    ax = new_axes(ax)
    handles: list[Artist] = []
    for words, drawn, stroke in strokes:
        line = joined(across, up, drawn)
        if line[0].size:
            look: Style = {"color": SERIES[0], "linewidth": 1.6, **stroke, **style}
            ax.plot(*line, **look)
            handles.append(line_handle(words, **look))
    for n in sorted({point["n"] for point in document["codim2"]}):
        points = [point["parameters"] for point in document["codim2"] if point["n"] == n]
        places = (_on_curve(point, (x, y), n) for point in points)
        spots = [spot for spot in places if spot is not None]
        if spots:
            ax.plot(*np.array(spots).T, **mark_style("GR"))
            for spot in spots:
                words_beside(ax, rf"$\xi_{{{n}}} = 0$", spot)
    if y.startswith("xi_"):
        ax.axhline(0.0, color=FAINT, linewidth=0.8, linestyle=":")
    ax.set(xlabel=label(x), ylabel=label(y))
    plain_ticks(ax)
    legend(ax, handles)
    return ax


def _on_curve(
    parameters: Mapping[str, float], names: tuple[str, str], n: int
) -> tuple[float, float] | None:
    """Give the place of a zero of ``xi_n`` in a plane; ``None`` if the plane does not hold it."""
    known = {**parameters, f"xi_{n}": 0.0}
    x, y = names
    return (known[x], known[y]) if x in known and y in known else None


def trajectory(
    table: Trajectory,
    ax: Axes | None,
    names: tuple[str | None, str | None],
    style: Style,
) -> Axes:
    """Draw a state over time, or over another state, with stops and impacts."""
    document = table.document
    x, y = names[0] or "t", names[1] or next(iter(document["states"]))
    across, up = _numbers(table, x, "x"), _numbers(table, y, "y")
    ax = new_axes(ax, 2.8 if x == "t" else 4.0)
    handles: list[Artist] = []
    for words, drawn, own in _motions(table, (x, y)):
        line = joined(across, up, drawn)
        if line[0].size:
            look: Style = {"linewidth": 1.4, **own, **style}
            ax.plot(*line, **look)
            handles += [line_handle(words, **look)] if words else []
    stops = list(_stops(table, document["gaps"], (x, ax.axvline), (y, ax.axhline)))
    stop: Style = {"color": INK, "linewidth": 1.2}
    for at, line_at in stops:
        line_at(at, zorder=1.5, **stop)
    if stops:
        handles.append(line_handle("stop" if len(stops) == 1 else "stops", **stop))
    for event, words, filling in (
        ("impact", "impact", SERIES[1]),
        ("contact", "begin of contact", PAPER),
    ):
        rows = table["event"] == event
        if rows.any():
            look = {**mark_style("SN"), "markersize": 4.5, "markerfacecolor": filling}
            look["markeredgecolor"] = SERIES[1]
            ax.plot(across[rows], up[rows], **look)
            handles.append(line_handle(words, **look))
    ax.set(xlabel=_series_label(x), ylabel=_series_label(y))
    if x == "t":
        ax.set_xlim(across.min(), across.max())
    plain_ticks(ax)
    legend(ax, handles if len(handles) > 1 else [])
    return ax


def _motions(table: Trajectory, names: tuple[str, str]) -> list[tuple[str, Flags, Style]]:
    """Give the segments of free flight, of contact and of jumps, with their styles.

    A phase that begins a new turn is no motion.
    """
    events, columns = table["event"], list(table)
    jumps, held = events[:-1] == "impact", _held(events)[:-1]
    phases = {columns[1]} - {next(iter(table.document["states"]))}
    turns = np.zeros(jumps.shape, dtype=bool)
    for name in phases.intersection(names):
        turns |= np.diff(table[name]) < 0
    moves = np.any([np.diff(table[name]) != 0 for name in names], axis=0)
    return [
        ("free flight", ~held & ~jumps & ~turns, {"color": SERIES[0]}),
        ("contact", held & ~jumps & ~turns, {"color": SERIES[1]}),
        ("", jumps & moves & ~turns, {"color": SERIES[0], "linestyle": ":"}),
    ]


def _series_label(name: str) -> str:
    if name.startswith("h_"):
        return f"gap at {name.removeprefix('h_')}"
    return "time $t$" if name == "t" else label(name)


def _held(events: NDArray[Any]) -> Flags:
    """Tell after which rows a contact lasts."""
    contacts, held = 0, []
    for event in events:
        contacts = max(contacts + (event == "contact") - (event == "release"), 0)
        held.append(contacts > 0)
    return np.array(held, dtype=bool)


def _stops(
    table: Trajectory, surfaces: Sequence[str], *axes: tuple[str, Any]
) -> Iterator[tuple[float, Any]]:
    """Give the stops at a fixed place of an axis: the place and the function that draws it.

    A gap that is an affine function of the axis alone is 0 at the stop.
    """
    for name, line in axes:
        for surface in surfaces:
            gap, places = table[f"h_{surface}"], table[name]
            if name == f"h_{surface}":
                yield 0.0, line
            elif name in table.document["states"] and np.ptp(places) > 0:
                slope, start = np.polyfit(places, gap, 1)
                off = np.abs(slope * places + start - gap).max()
                if slope != 0 and off <= AFFINE * np.ptp(gap):
                    yield float(-start / slope), line


def study(
    table: Study, ax: Axes | None, names: tuple[str | None, str | None], style: Style
) -> Axes:
    """Draw the largest error over the weight of the contact, a line for every smooth order."""
    if names != (None, None):
        return columns(table, ax, *names, style)
    _filled(table)
    import matplotlib as mpl

    shape = table["shape"][0]
    rows = table["shape"] == shape
    ax = new_axes(ax)
    orders = np.unique(table["N"][rows])
    handles: list[Artist] = []
    for place, order in enumerate(orders):
        chosen = rows & (table["N"] == order)
        # The last fifth of the ramp is too pale on white.
        color = mpl.colormaps["viridis"](0.82 * place / max(len(orders) - 1, 1))
        look: Style = {"color": color, "marker": "o", "markersize": 3.5, "linewidth": 1.2, **style}
        ax.plot(table["W"][chosen], table["largest error"][chosen], **look)
        handles.append(line_handle(f"$N = {order:g}$", **look))
    tolerance = table.document["chosen"]["tolerance"]
    ax.axhline(tolerance, color=FAINT, linewidth=0.8, linestyle=":")
    handles.append(line_handle("tolerance", color=FAINT, linewidth=0.8, linestyle=":"))
    ax.set_yscale("log")
    ax.locator_params(axis="x", integer=True)
    ax.set(xlabel="weight $W$ of the contact", ylabel=f"largest error, {shape} maps")
    legend(ax, handles)
    return ax


def points(
    table: Image,
    ax: Axes | None,
    names: tuple[str | None, str | None],
    style: Style,
) -> Axes:
    """Draw images of section points, those outside the window in grey."""
    columns = list(table)
    coordinates = columns[2 : columns.index("contacts")]
    across, up = (["iteration", *coordinates] if len(coordinates) == 1 else coordinates)[:2]
    x, y = names[0] or across, names[1] or up
    places = _numbers(table, x, "x"), _numbers(table, y, "y")
    inside = table["inside"] == 1
    ax = new_axes(ax)
    handles: list[Artist] = []
    for words, color, rows in (
        ("outside the window", GREY, ~inside),
        ("inside the window", SERIES[0], inside),
    ):
        if rows.any():
            dots(ax, (places[0][rows], places[1][rows]), 1.5, **{"color": color, **style})
            look: Style = {"marker": "o", "markersize": 4, "linestyle": "none"}
            handles.append(line_handle(words, color=color, **look))
    labels = [offset_label(name) if name in coordinates else label(name) for name in (x, y)]
    ax.set(xlabel=labels[0], ylabel=labels[1])
    plain_ticks(ax)
    legend(ax, handles if len(handles) > 1 else [])
    return ax


def noise(table: Noise, ax: Axes | None, style: Style) -> Axes:
    """Draw the joint density of the first two coordinates, or the density of the only one."""
    names = list(dict.fromkeys(table["coordinate"]))
    ax = new_axes(ax)
    if len(names) == 1:
        stairs = [*table["from"], table["to"][-1]]
        ax.stairs(table["density"], stairs, **{"color": SERIES[0], "fill": True, **style})
        ax.set(xlabel=offset_label(names[0]), ylabel="density")
        plain_ticks(ax)
        return ax
    across, up, density = table.density()
    centres = 0.5 * (across[1:] + across[:-1]), 0.5 * (up[1:] + up[:-1])
    shown = np.ma.masked_equal(density, 0)
    _scale(ax, image(ax, centres, shown, **{"cmap": "viridis_r", **style}), "density")
    ax.set(xlabel=offset_label(names[0]), ylabel=offset_label(names[1]))
    plain_ticks(ax)
    return ax


def fit(table: Fit, ax: Axes | None, names: tuple[str | None, str | None], style: Style) -> Axes:
    """Draw confidence ellipses of two fitted parameters, or the error bar of the only one."""
    known = list(table["parameter"])
    for name, argument in zip(names, "xy", strict=True):
        if name is not None and name not in known:
            message = (
                f"{argument}: expected a fitted parameter ({', '.join(known)}), found {name!r}"
            )
            raise InputError(message)
    ax = new_axes(ax)
    if len(known) == 1:
        look: Style = {"fmt": "o", "capsize": 4, "color": SERIES[0], **style}
        ax.errorbar([0.0], table["offset"], yerr=table["standard_error"], **look)
        ax.set_xticks([])
        ax.set_ylabel(offset_label(known[0]))
        plain_ticks(ax)
        return ax
    x = names[0] or next(name for name in known if name != names[1])
    y = names[1] or next(name for name in known if name != x)
    places = [known.index(x), known.index(y)]
    centre = table["offset"][places]
    values, vectors = np.linalg.eigh(table.covariance[np.ix_(places, places)])
    turn = np.linspace(0, 2 * np.pi, 181)
    circle = np.array([np.cos(turn), np.sin(turn)])
    half = vectors * np.sqrt(np.maximum(values, 0))
    handles: list[Artist] = []
    for share, thick in ((0.68, 1.8), (0.95, 1.0)):
        ring = centre[:, None] + np.sqrt(-2 * np.log(1 - share)) * half @ circle
        look = {"color": SERIES[0], "linewidth": thick, **style}
        ax.plot(*ring, **look)
        handles.append(line_handle(f"{100 * share:.0f} % confidence", **look))
    look = {"marker": "+", "markersize": 8, "linestyle": "none", "color": INK}
    ax.plot(*centre, **look)
    handles.append(line_handle("fit", **look))
    ax.set(xlabel=offset_label(x), ylabel=offset_label(y))
    plain_ticks(ax)
    legend(ax, handles)
    return ax


class Bar(NamedTuple):
    """Interval in a row of the plot of safety: NaN for an end that is not known."""

    height: float
    ends: tuple[float, float]
    labels: tuple[str | None, str | None]
    look: Style
    words: str


def safety(table: Safety, ax: Axes | None, style: Style) -> Axes:
    """Draw a row for every parameter and attractor: intervals relative to the scene's values."""
    _filled(table)
    names = [str(name) for name in table["parameter"]]
    values = dict(zip(names, table["value"].tolist(), strict=True))
    followed = [one for one in table.attractors if one["from"] and table.along in values]
    bars = _safe_bars(table, values, style)
    bars += _attractor_bars(table, followed, values, style)
    ax = new_axes(ax, 1.2 + 0.5 * (len(names) + len(followed)))
    known = [end for bar in bars for end in bar.ends if np.isfinite(end)] or [-10.0, 10.0]
    room = 0.15 * max(map(abs, known))
    ax.set_xlim(min(0.0, *known) - room, max(0.0, *known) + room)
    for bar in bars:
        ends = np.where(np.isfinite(bar.ends), bar.ends, ax.get_xlim())
        ax.plot(ends, [bar.height] * 2, **bar.look)
        for end, word in zip(bar.ends, bar.labels, strict=True):
            if word and np.isfinite(end):
                ax.plot(end, bar.height, **mark_style(word))
                words_beside(ax, word, (end, bar.height))
    for row, one in enumerate(followed, start=len(names)):
        words = f"{100 * one['fraction']:.3g} %"
        words += f", speed {one['impact_speed']:.3g}" if one["impact_speed"] else ", no contact"
        ax.annotate(words, (0, -row), (4, 5), textcoords="offset points", fontsize="small")
    ax.axvline(0, color=FAINT, linewidth=0.8, linestyle=":", zorder=1)
    rows = [label(name) for name in names] + [one["orbit"] for one in followed]
    ax.set_yticks([-row for row in range(len(rows))], rows)
    ax.set_ylim(0.6 - len(rows), 0.6)
    ax.set_xlabel("change from the scene's value, %")
    entries = {bar.words: bar.look for bar in bars}
    legend(ax, [line_handle(words, **look) for words, look in entries.items()])
    return ax


def _percent(values: Mapping[str, float], name: str, value: float | None) -> float:
    """Give the change of a parameter from its value, in percent of it (of 1 where that is 0)."""
    if value is None:
        return np.nan
    return 100 * (value - values[name]) / (abs(values[name]) or 1.0)


def _safe_bars(table: Safety, values: Mapping[str, float], style: Style) -> list[Bar]:
    """Give the intervals without contact of all parameters, and their tolerances."""
    words = "without contact" if table.clears else "between grazes"
    look: Style = {"color": SERIES[0], "linewidth": 3, **style}
    bars = []
    for row, interval in enumerate(table.document["intervals"]):
        name = interval["parameter"]
        ends, labels = [], []
        for side in ("below", "above"):
            folds = interval[side] is None and interval[f"fold_{side}"] is not None
            ends.append(_percent(values, name, interval[f"fold_{side}" if folds else side]))
            labels.append("SN" if folds else "GR")
        bars.append(Bar(-row, (ends[0], ends[1]), (labels[0], labels[1]), look, words))
    tolerance = table.document["tolerance"] or {"tolerances": {}}
    look = {"color": SERIES[1], "linewidth": 1.5}
    for name, share in tolerance["tolerances"].items():
        half = _percent(values, name, values[name] + share * abs(values[name]))
        height = -list(values).index(name) - 0.25
        bars.append(Bar(height, (-half, half), (None, None), look, "tolerance"))
    return bars


def _attractor_bars(
    table: Safety,
    followed: Sequence[Mapping[str, Any]],
    values: Mapping[str, float],
    style: Style,
) -> list[Bar]:
    """Give the intervals in which attractors exist, in the rows below the parameters."""
    look: Style = {"color": SERIES[2], "linewidth": 3, **style}
    words = f"attractor, along {label(table.along)}"
    bars = []
    for row, one in enumerate(followed, start=len(values)):
        sides = one["from"], one["to"]
        low, high = (_percent(values, table.along, side["value"]) for side in sides)
        labels = sides[0]["label"], sides[1]["label"]
        bars.append(Bar(-row, (low, high), labels, look, words))
    return bars
