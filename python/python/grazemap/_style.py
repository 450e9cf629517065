"""Colours, labels, axes and keys of plots, in the style of the program's figures."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

Numbers: TypeAlias = NDArray[np.float64]
Flags: TypeAlias = NDArray[np.bool_]
#: Name and colour of a class of cells, and whether it stands apart from the others in the key.
Entry: TypeAlias = tuple[str, str, bool]
#: Properties of an artist.
Style: TypeAlias = dict[str, Any]

#: Ink of marks and guides, secondary ink, colour of untrusted results, lines of the grid.
INK, FAINT, GREY, GRID = "#1f2328", "#6a7078", "#b3b7bc", "#e6e8eb"
#: Colours of cells in which nothing happens or repeats, and of the paper.
PALE, CHAOS, PAPER = "#f7eec3", "#f4a582", "#ffffff"
#: Colours of lines and dots: Okabe and Ito, without their yellow.
SERIES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c564b", "#30343a")
#: Colours of areas: the muted scheme of Tol.
CELLS = (
    "#88ccee",
    "#ddcc77",
    "#cc6677",
    "#117733",
    "#aa4499",
    "#999933",
    "#882255",
    "#44aa99",
    "#332288",
)
#: Marker and filling of every special point of a branch.
MARKS = {
    "GR": ("o", False),
    "SN": ("o", True),
    "PD": ("s", True),
    "NS": ("D", True),
    "BP": ("^", True),
    "HB": ("X", True),
}
#: Letters that are written by their names.
GREEK = frozenset(
    (
        "alpha",
        "beta",
        "gamma",
        "delta",
        "epsilon",
        "zeta",
        "eta",
        "theta",
        "kappa",
        "lambda",
        "mu",
        "nu",
        "xi",
        "rho",
        "sigma",
        "tau",
        "phi",
        "psi",
        "omega",
        "Delta",
        "Omega",
    )
)
#: Widths of new axes and of the key of an image, in inches.
WIDTH, KEY_WIDTH = 6.4, 1.2
#: Widths of the handle of an entry of a legend and of a letter, in inches.
HANDLE, LETTER = 0.52, 0.068
#: Width of axes from which on their label has the grazing value, beside the power of ten.
ROOMY = 4.2
#: White rim of lines and words on top of others, in points.
RIM = 2.5
#: Place that words beside a point take, in pixels, and the steps between vertices of a line that
#: are tested for it.
REACH, STEPS = (60.0, 22.0), 20
#: Dots that are drawn as shapes; more of them are drawn as pixels in vector formats too.
EXACT_DOTS = 4000


def symbol(name: str) -> str:
    r"""Write a name as mathematics, without the dollar signs.

    >>> symbol("alpha"), symbol("omega_n"), symbol("x1"), symbol("gap")
    ('\\alpha', '\\omega_{n}', 'x_{1}', '\\mathrm{gap}')
    """
    parts = re.fullmatch(r"([A-Za-z]+)_(\w+)|([A-Za-z]+?)(\d+)", name)
    if parts is None:
        return _letter(name)
    base, index = (part for part in parts.groups() if part is not None)
    return rf"{_letter(base)}_{{{_letter(index)}}}"


def _letter(word: str) -> str:
    if word in GREEK:
        return rf"\{word}"
    return word if len(word) == 1 or word.isdigit() else rf"\mathrm{{{_escaped(word)}}}"


def _escaped(text: str) -> str:
    return re.sub(r"([_$%#&^])", r"\\\1", text)


def label(name: str) -> str:
    r"""Write the name of a variable or the text of an expression as the label of an axis.

    >>> label("theta"), label("impact_speed"), label("q - Q")
    ('$\\theta$', 'impact speed', 'q - Q')
    """
    words = {"h": "gap $h$", "contact_time": "contact time", "impact_speed": "impact speed"}
    if name in words or name == "amplitude":
        return words.get(name, name)
    return f"${symbol(name)}$" if name.isidentifier() else name.replace("$", r"\$")


def offset_label(name: str) -> str:
    r"""Write the label of an axis of offsets.

    >>> offset_label("alpha")
    '$\\alpha - \\alpha^*$'
    """
    letter = symbol(name)
    return f"${letter} - {letter}^*$"


def grazing_words(name: str, value: float) -> str:
    r"""Write the value of a parameter at the graze.

    >>> grazing_words("alpha", 2.25)
    '$\\alpha^* = 2.25$'
    """
    return f"${symbol(name)}^* = {_number(value)}$"


def _number(value: float) -> str:
    mantissa, _, exponent = f"{value:.7g}".partition("e")
    return rf"{mantissa} \times 10^{{{int(exponent)}}}" if exponent else mantissa


def new_axes(ax: Axes | None, height: float = 4.0) -> Axes:
    """Give these axes, or new ones with a light grid."""
    if ax is None:
        import matplotlib.pyplot as plt

        ax = plt.figure(figsize=(WIDTH, height), layout="constrained").add_subplot()
        ax.grid(color=GRID, linewidth=0.6)
        ax.set_axisbelow(True)
    return ax


def plain_ticks(ax: Axes) -> None:
    """Write powers of ten beside linear axes, and values without an offset."""
    for axis, scale in (("x", ax.get_xscale()), ("y", ax.get_yscale())):
        if scale == "linear":
            ax.ticklabel_format(
                axis=axis,  # type: ignore[arg-type]
                style="sci",
                scilimits=(-2, 4),
                useMathText=True,
                useOffset=False,
            )
            ax.locator_params(axis=axis, nbins=6)  # type: ignore[arg-type]


def width(ax: Axes) -> float:
    """Give the width of axes, in inches."""
    return ax.get_window_extent().width / ax.figure.dpi


def legend(ax: Axes, handles: Sequence[Artist]) -> None:
    """Draw a legend above the axes; nothing is drawn without handles."""
    if not handles:
        return
    ax.legend(
        handles=handles,
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        borderaxespad=0.2,
        ncols=_columns([str(handle.get_label()) for handle in handles], width(ax)),
        frameon=False,
        fontsize="small",
        handletextpad=0.5,
        columnspacing=1.2,
    )


def _columns(entries: Sequence[str], room: float) -> int:
    """Give the largest number of columns of a legend that fit into some inches.

    >>> entries = ["itinerary 1", "stable", "unstable", "GR"]
    >>> _columns(entries, 6.0), _columns(entries, 2.5), _columns(entries, 0.5)
    (4, 2, 1)
    """

    def needed(count: int) -> float:
        columns = (part.tolist() for part in np.array_split(list(map(len, entries)), count))
        return float(sum(HANDLE + LETTER * max(column) for column in columns))

    counts = range(len(entries), 1, -1)
    return next((count for count in counts if needed(count) <= room), 1)


def rim(width: float) -> list[Any]:
    """Give the effect of a white rim of this width, in points."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=width, foreground=PAPER)]


def words_beside(ax: Axes, words: str, at: tuple[float, float]) -> None:
    """Write words beside a point, on the side with the fewest lines."""
    corners = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    spot = ax.transData.transform(at)
    drawn = [line.get_transform().transform_path(line.get_path()) for line in ax.lines]
    vertices = [path.interpolated(STEPS).vertices for path in drawn if len(path)]
    apart = np.concatenate([*vertices, np.empty((0, 2))]) - spot

    def crossed(corner: tuple[int, int]) -> int:
        across, up = (apart * corner).T
        near = (across > 0) & (across < REACH[0]) & (up > 0) & (up < REACH[1])
        return int(near.sum())

    across, up = min(corners, key=crossed)
    ax.annotate(
        words,
        at,
        xytext=(6 * across, 5 * up),
        textcoords="offset points",
        ha="left" if across > 0 else "right",
        va="bottom" if up > 0 else "top",
        fontsize="small",
        color=INK,
        annotation_clip=True,
        path_effects=rim(RIM),
        zorder=5,
    )


def line_handle(words: str, **style: Any) -> Line2D:
    """Make an entry of a legend."""
    from matplotlib.lines import Line2D

    return Line2D([], [], label=words, **style)


def mark_style(word: str) -> Style:
    """Give the style of the markers of a special point."""
    marker, filled = MARKS.get(word, ("o", False))
    return {
        "linestyle": "none",
        "marker": marker,
        "markersize": 5.0 if filled else 7.0,
        "markeredgecolor": INK,
        "markerfacecolor": INK if filled else PAPER,
        "zorder": 4,
    }


def dots(ax: Axes, points: tuple[Numbers, Numbers], size: float = 1.0, **style: Any) -> Line2D:
    """Draw a cloud of points; fewer points are larger, many are drawn as pixels."""
    count = points[0].size
    diameter = size * np.clip(1.3 * (EXACT_DOTS / max(count, 1)) ** 0.25, 0.65, 2.5)
    drawn: Style = {
        "marker": "o",
        "linestyle": "none",
        "markersize": diameter,
        "markeredgewidth": 0,
        "rasterized": count > EXACT_DOTS,
        **style,
    }
    (line,) = ax.plot(*points, **drawn)
    return line


def edges(centres: Numbers) -> tuple[float, float]:
    """Give the outer edges of evenly spaced cells."""
    half = 0.5 * (centres[1] - centres[0]) if centres.size > 1 else 0.5
    return float(centres[0] - half), float(centres[-1] + half)


def cells(
    ax: Axes,
    axes: tuple[Numbers, Numbers],
    classes: NDArray[np.int_],
    entries: Sequence[Entry],
    style: Style,
) -> list[Entry]:
    """Draw classes of cells as an image, and give those that it holds.

    Rows of ``classes`` belong to the second axis; ``entries`` are the classes by number.
    """
    from matplotlib.colors import ListedColormap

    found = np.unique(classes)
    held = [entries[number] for number in found]
    colors = ListedColormap([color for _, color, _ in held])
    look: Style = {"cmap": colors, "vmin": -0.5, "vmax": len(held) - 0.5, **style}
    image(ax, axes, np.searchsorted(found, classes), **look)
    return held


def image(ax: Axes, axes: tuple[Numbers, Numbers], values: NDArray[Any], **style: Any) -> Any:
    """Draw a grid of values as an image; rows belong to the second axis."""
    ax.grid(visible=False)
    style = {"origin": "lower", "aspect": "auto", "interpolation": "nearest", **style}
    return ax.imshow(values, extent=(*edges(axes[0]), *edges(axes[1])), **style)


def key(ax: Axes, entries: Sequence[Entry], title: str) -> None:
    """Draw the key of an image at its right; classes that stand apart come last."""
    from matplotlib.colorbar import make_axes
    from matplotlib.patches import Patch

    def patches(apart: bool) -> list[Artist]:
        style: Style = {"edgecolor": FAINT, "linewidth": 0.6}
        chosen = [entry for entry in entries if entry[2] == apart]
        return [Patch(label=name, facecolor=color, **style) for name, color, _ in chosen]

    entries = [entry for entry in entries if entry[0]]
    if not entries:
        return
    first, last = patches(apart=False), patches(apart=True)
    gap: list[Artist] = [Patch(label="", visible=False)] if first and last else []
    beside, _ = make_axes(ax, location="right", fraction=min(KEY_WIDTH / width(ax), 0.45), pad=0.02)
    beside.set_axis_off()
    beside.legend(
        handles=[*first, *gap, *last],
        title=title,
        loc="upper left",
        bbox_to_anchor=(0.0, 1.0),
        borderaxespad=0.0,
        alignment="left",
        frameon=False,
        fontsize="small",
        title_fontsize="small",
        labelspacing=0.35,
        handlelength=1.2,
        handleheight=1.1,
    )


def joined(x: Numbers, y: Numbers, drawn: Flags) -> tuple[Numbers, Numbers]:
    """Give the drawn segments of a polyline as one line, interrupted by NaN.

    ``drawn[i]`` belongs to the segment from point ``i`` to point ``i + 1``.

    >>> x = np.arange(5.0)
    >>> joined(x, x, np.array([True, False, False, True]))[0]
    array([ 0.,  1., nan,  3.,  4., nan])
    """
    changes = np.flatnonzero(np.diff(np.concatenate([[False], drawn, [False]]).astype(int)))
    places = [np.arange(first, last + 1) for first, last in changes.reshape(-1, 2)]
    if not places:
        return np.empty(0), np.empty(0)
    gap = [np.nan]
    across = [piece for place in places for piece in (x[place], gap)]
    up = [piece for place in places for piece in (y[place], gap)]
    return np.concatenate(across), np.concatenate(up)
