"""Results: a table by columns, a JSON document, figures."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from . import _plot
from ._errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

    from . import _lib


class Table(Mapping[str, np.ndarray[Any, Any]]):
    """Columns by name, as the program writes them to CSV: arrays of equal length.

    A column of numbers holds doubles, NaN if missing; a column of flags (``stable``, ``physical``,
    ``inside``, ...) booleans, false if unknown. A column of words is an array of ``str`` objects,
    empty if missing.
    """

    #: Command of the program that writes the same table.
    command = ""
    #: Columns of flags.
    flags: ClassVar[tuple[str, ...]] = ()
    #: Dimension of the rows as a dataset.
    dimension: ClassVar[str] = "row"

    def __init__(self, computed: _lib.Computed) -> None:
        """Wrap a computed result."""
        self._columns = {
            name: _words(*held) if isinstance(held, tuple) else held
            for name, held in computed.columns().items()
        }
        for name in self._columns.keys() & set(self.flags):
            self._columns[name] = self._columns[name] == 1
        self._computed: _lib.Computed | None = computed
        #: Scene and window of the map, if the document does not hold them.
        self._about: dict[str, Any] = {}
        #: Warnings about accuracy or completeness.
        self.remarks: tuple[str, ...] = tuple(computed.remarks)
        #: Reason why the result is not the one asked for; ``None`` if it is.
        self.ended: str | None = computed.ended

    def __getitem__(self, name: str) -> np.ndarray[Any, Any]:
        """Give a column."""
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        """Give the names of the columns, left to right."""
        return iter(self._columns)

    def __len__(self) -> int:
        """Count the columns."""
        return len(self._columns)

    @cached_property
    def _text(self) -> str:
        """JSON document of the program."""
        return self._computed.document() if self._computed is not None else "null"

    @cached_property
    def _outline(self) -> str:
        """JSON document without what the columns hold, where that is long."""
        return self._computed.head() if self._computed is not None else "null"

    @cached_property
    def figures(self) -> dict[str, str]:
        """Figures of the program as SVG, by file name without ``.svg``."""
        return dict(self._computed.figures()) if self._computed is not None else {}

    @property
    def document(self) -> Any:
        """JSON document of the program, as lists and dictionaries."""
        return json.loads(self._text)

    @property
    def _heads(self) -> list[dict[str, Any]]:
        """Documents of all results, without what the columns hold where that is long."""
        document = json.loads(self._outline)
        return document if isinstance(document, list) else [document]

    @property
    def _head(self) -> dict[str, Any]:
        """Document of the first result, and what is known about its map."""
        return {**self._about, **next(iter(self._heads), {})}

    def __getstate__(self) -> dict[str, Any]:
        """Lay out what a copy elsewhere cannot compute."""
        laid_out = {"_text": self._text, "_outline": self._outline, "figures": self.figures}
        return {**self.__dict__, **laid_out, "_computed": None}

    @property
    def is_empty(self) -> bool:
        """Whether nothing was found."""
        return not any(column.size for column in self.values())

    def to_pandas(self) -> pd.DataFrame:
        """Give the columns as a data frame; needs pandas."""
        import pandas as pd

        return pd.DataFrame(self._columns)

    def to_xarray(self) -> xr.Dataset:
        """Give the columns as variables along one dimension; needs xarray."""
        from . import _xarray

        return _xarray.rows(self, self.dimension)

    def _ipython_key_completions_(self) -> list[str]:
        """Offer the names of the columns in a notebook."""
        return list(self)

    def plot(
        self, ax: Axes | None = None, x: str | None = None, y: str | None = None, **style: Any
    ) -> Axes:
        """Draw one column of numbers over another with Matplotlib, on new axes if none are given.

        Raises
        ------
        InputError
            The table has no such column, or no plot of its own and ``x`` or ``y`` is missing; the
            message names the columns.

        """
        return _plot.columns(self, ax, x, y, style)

    def __repr__(self) -> str:
        """State the size of the table."""
        rows = len(next(iter(self._columns.values()), ()))
        ended = f", {self.ended}" if self.ended else ""
        return f"<grazemap {self.command or 'table'}: {rows} rows, {len(self)} columns{ended}>"

    def _repr_html_(self) -> str:
        """Show the figure in a notebook."""
        return next(iter(self.figures.values()), f"<pre>{self!r}</pre>".replace("<g", "&lt;g"))


class StableRange(NamedTuple):
    """Range of a parameter in which the orbits of a branch are stable and physical.

    Attributes
    ----------
    branch
        Number of the branch.
    itinerary
        Contacts of the orbits.
    name
        Hits and periods of the orbits.
    first, last
        Offsets of the parameter.
    first_value, last_value
        Values of the parameter.
    first_label, last_label
        Labels of the special points that bound the range; empty at the end of what was followed.

    """

    branch: int
    itinerary: str
    name: str
    first: float
    last: float
    first_value: float
    last_value: float
    first_label: str
    last_label: str


def _runs(good: np.ndarray[Any, Any], special: np.ndarray[Any, Any]) -> list[tuple[int, int]]:
    """Give first and last place of each run of good points, with the special points at its ends.

    >>> _runs(np.array([False, True, True, False]), np.array([False, False, False, True]))
    [(1, 3)]
    """
    changes = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]]).astype(int)))
    runs = []
    for first, end in zip(changes[::2].tolist(), changes[1::2].tolist(), strict=True):
        start = first - 1 if first > 0 and special[first - 1] else first
        last = end if end < len(good) and special[end] else end - 1
        runs.append((start, last))
    return runs


def _words(numbers: np.ndarray[Any, Any], words: list[str]) -> np.ndarray[Any, Any]:
    """Give the words at indices; -1 is the empty word."""
    known: np.ndarray[Any, Any] = np.array([*words, ""], dtype=object)
    return known.take(numbers, mode="wrap")


class Diagram(Table):
    """Bifurcation diagram: a row for every value of the parameter in every sweep."""

    command = "diagram"

    def to_xarray(self) -> xr.Dataset:
        """Give a dataset with the dimensions ``sweep``, the parameter and ``iterate``.

        The parameter has its offsets (``alpha``) and values (``alpha_value``) as coordinates, a
        sweep its ``heading`` and ``method``: ``ds.sel(heading="up")``. ``value`` holds the
        observable, with NaN behind the last iterate of a period. Needs xarray.
        """
        from . import _xarray

        return _xarray.of_diagram(self)

    def points(
        self, rows: np.ndarray[Any, Any] | slice = slice(None)
    ) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
        """Give offsets and values of all finite points, as two arrays of equal length.

        ``rows`` selects rows of the table (default: all).
        """
        names = [name for name in self if name.startswith("value_")]
        values = np.column_stack([self[name][rows] for name in names])
        offsets = np.repeat(self["offset"][rows], len(names)).reshape(values.shape)
        drawn = np.isfinite(values)
        return offsets[drawn], values[drawn]

    def plot(  # type: ignore[override]
        self, ax: Axes | None = None, *, values: bool = False, **style: Any
    ) -> Axes:
        """Draw the iterates with Matplotlib, each method and heading in its colour.

        More than 4000 points are drawn as pixels, in PDF and SVG too: give ``savefig`` a ``dpi``.

        Parameters
        ----------
        ax
            Axes to draw on (default: new ones).
        values
            Show values of the parameter instead of offsets from the graze.
        **style
            Properties of the points, as for :meth:`matplotlib.axes.Axes.plot`.

        Raises
        ------
        NoResult
            All orbits ended early: there is nothing to draw.

        """
        return _plot.diagram(self, ax, values, style)


class Chart(Table):
    """Two-parameter chart: a row for every cell."""

    command = "chart"
    flags = ("computed", "converging")

    def to_xarray(self) -> xr.Dataset:
        """Give a dataset with the two parameters as dimensions, the second one first.

        Each has its offsets (``alpha``) and values (``alpha_value``) as coordinates:
        ``ds.period.sel(alpha=1e-5, method="nearest")``. Several methods and starts are
        dimensions before these. Needs xarray.
        """
        from . import _xarray

        return _xarray.of_chart(self)

    def grid(self) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any], np.ndarray[Any, Any]]:
        """Give the first chart: both axes, and periods by second and first parameter.

        Cells without a period have 0.
        """
        chart = self._head
        first, second = (np.array(axis["offsets"]) for axis in chart["axes"])
        cells = first.size * second.size
        periods = np.nan_to_num(self["period"][:cells]).astype(int)
        return first, second, periods.reshape(second.size, first.size)

    def plot(  # type: ignore[override]
        self, ax: Axes | None = None, *, number: int = 1, values: bool = False, **style: Any
    ) -> Axes:
        """Draw a chart as an image with a key, and its overlay.

        The image shows what the chart observes: periods, itineraries or numbers of attractors in
        one colour each, Lyapunov exponents on a scale around 0. Cells without a period and escaped
        ones have colours of their own. Of several attractors of a cell the first is shown.

        Parameters
        ----------
        ax
            Axes to draw on (default: new ones).
        number
            Number of the chart, from 1: there is one for each method and start.
        values
            Show values of the parameters instead of offsets from the graze.
        **style
            Properties of the image, as for :meth:`matplotlib.axes.Axes.imshow`.

        """
        return _plot.chart(self, ax, number, values, style)


class Basin(Table):
    """Basins of attraction: a row for every cell."""

    command = "basin"

    @property
    def document(self) -> Any:
        """JSON documents of the program, as a list of dictionaries."""
        document = super().document
        return document if isinstance(document, list) else [document]

    def to_xarray(self) -> xr.Dataset:
        """Give a dataset with the two coordinates as dimensions, the second one first.

        ``attractor`` is the number of the attractor, or that of a class named by the attributes
        ``flag_values`` and ``flag_meanings``. Attractors have the dimension ``number``. Needs
        xarray.
        """
        from . import _xarray

        return _xarray.of_basin(self)

    @property
    def attractors(self) -> list[dict[str, Any]]:
        """Attractors found, the one with the largest basin first."""
        return list(self._head["attractors"])

    def plot(  # type: ignore[override]
        self, ax: Axes | None = None, **style: Any
    ) -> Axes:
        """Draw the basins as an image with a key, the attractors and the manifolds.

        Rings mark the points of an attractor in view, dots those of one with more than 64 points.

        Parameters
        ----------
        ax
            Axes to draw on (default: new ones).
        **style
            Properties of the image, as for :meth:`matplotlib.axes.Axes.imshow`.

        """
        return _plot.basin(self, ax, style)


class Branch(Table):
    """Branches of periodic orbits: a row for every point of every branch."""

    command = "branch"
    flags = ("stable", "physical", "inside")

    def to_xarray(self) -> list[xr.Dataset]:  # type: ignore[override]
        """Give a dataset for each branch, with its special points; needs xarray.

        Points have the dimension ``point`` and the parameter's offsets and values as
        coordinates, special points the dimension ``special``: their number among the points,
        label, parameter and coefficient.
        """
        from . import _xarray

        return _xarray.of_branches(self)

    @property
    def stable_ranges(self) -> list[StableRange]:
        """Ranges of the parameter in which the orbits of a branch are stable and physical."""
        along = self._head["along"]
        good = self["stable"] & self["physical"]
        found = []
        for number in dict.fromkeys(self["branch"]):
            (own,) = np.nonzero(self["branch"] == number)
            for first, last in _runs(good[own], self["label"][own] != ""):
                places = (int(own[first]), int(own[last]))
                low, high = sorted(places, key=lambda place: float(self[along][place]))
                found.append(
                    StableRange(
                        branch=int(number),
                        itinerary=str(self["itinerary"][low]),
                        name=str(self["name"][own[(first + last) // 2]]),
                        first=float(self[along][low]),
                        last=float(self[along][high]),
                        first_value=float(self[f"{along}_value"][low]),
                        last_value=float(self[f"{along}_value"][high]),
                        first_label=str(self["label"][low]),
                        last_label=str(self["label"][high]),
                    )
                )
        return found

    @property
    def special(self) -> list[dict[str, Any]]:
        """Special points: grazes, folds, flips, branch points and so on."""
        branches = self.document["branches"]
        return [point for branch in branches for point in branch["points"] if point.get("label")]

    def plot(
        self,
        ax: Axes | None = None,
        x: str | None = None,
        y: str | None = None,
        *,
        virtual: bool = False,
        values: bool = False,
        **style: Any,
    ) -> Axes:
        """Draw the branches, solid if stable and dashed if not, with their special points.

        Parameters
        ----------
        ax
            Axes to draw on (default: new ones).
        x, y
            Columns of numbers (default: the parameter and the first coordinate). A coordinate is
            drawn at every return of an orbit.
        virtual
            Draw virtual orbits too, dotted.
        values
            Show values of the parameter instead of offsets from the graze.
        **style
            Properties of the lines, as for :meth:`matplotlib.axes.Axes.plot`.

        Raises
        ------
        NoResult
            There is no branch, or only virtual orbits.

        """
        return _plot.branch(self, ax, (x, y), (virtual, values), style)


class Loci(Table):
    """Loci in two parameters: a row for every point of every locus."""

    command = "loci"
    flags = ("stable", "physical", "inside")

    def to_xarray(self) -> list[xr.Dataset]:  # type: ignore[override]
        """Give a dataset for each locus, with its points of codimension two; needs xarray."""
        from . import _xarray

        return _xarray.of_loci(self)

    @property
    def special(self) -> list[dict[str, Any]]:
        """Points of codimension two."""
        loci = self.document["loci"]
        return [point for locus in loci for point in locus["points"] if point.get("label")]

    def plot(
        self,
        ax: Axes | None = None,
        x: str | None = None,
        y: str | None = None,
        *,
        from_graze: bool | None = None,
        virtual: bool = False,
        values: bool = False,
        **style: Any,
    ) -> Axes:
        """Draw the loci, solid if stable and dashed if not, with points of codimension two.

        Parameters
        ----------
        ax
            Axes to draw on (default: new ones).
        x, y
            Two columns of numbers to draw over each other instead.
        from_graze
            Measure the second parameter from the grazing curve, which folds and flips leave so
            slowly that the plane does not tell them apart (default: on new axes, if the loci hold
            that curve).
        virtual
            Draw virtual orbits too, dotted.
        values
            Show values of the parameters instead of offsets from the graze.
        **style
            Properties of the lines, as for :meth:`matplotlib.axes.Axes.plot`.

        Raises
        ------
        NoResult
            There is no locus, or only virtual orbits.

        """
        return _plot.loci(self, ax, (x, y), (from_graze, virtual, values), style)


class Orbits(Table):
    """Periodic orbits, or their folds and flips: a row for each."""

    command = "orbits"
    flags = ("stable", "physical", "inside")
    dimension = "orbit"


class Curve(Table):
    """Grazing curve: a row for every grazing orbit."""

    command = "curve"
    flags = ("physical",)

    @property
    def is_empty(self) -> bool:
        """Whether no physical orbit was found."""
        return not self["physical"].any()

    @property
    def special(self) -> list[dict[str, Any]]:
        """Points of codimension two: zeros of ``xi_n``."""
        return list(self.document["codim2"])

    def to_xarray(self) -> xr.Dataset:
        """Give the points of the curve along the dimension ``point``; needs xarray."""
        from . import _xarray

        return _xarray.of_curve(self)

    def plot(
        self,
        ax: Axes | None = None,
        x: str | None = None,
        y: str | None = None,
        **style: Any,
    ) -> Axes:
        """Draw the grazing curve, with rings at its points of codimension two.

        Parameters
        ----------
        ax
            Axes to draw on (default: new ones).
        x, y
            Columns of numbers (default: the parameter of the curve and the adjusted one);
            ``y="xi_1"`` shows the condition along the curve.
        **style
            Properties of the lines, as for :meth:`matplotlib.axes.Axes.plot`.

        Raises
        ------
        NoResult
            The curve has no points.

        """
        return _plot.curve(self, ax, (x, y), style)


class Nearest(Table):
    """Smallest change of parameters at which the orbit grazes."""

    command = "curve"
    dimension = "parameter"

    @property
    def margin(self) -> float:
        """Length of the smallest change, in scales; negative where the orbit goes beyond."""
        return float(self.document["margin"])

    @property
    def clears(self) -> bool:
        """Whether the orbit is clear of every stop at the scene's values."""
        return bool(self.document["clears"])

    @property
    def parameters(self) -> dict[str, float]:
        """Values of all parameters at the nearest graze."""
        return dict(self.document["parameters"])

    @property
    def sensitivities(self) -> dict[str, float]:
        """Change of the margin with each parameter of the scene."""
        return dict(self.document["sensitivities"])


class Safety(Table):
    """Safety of a scene: a row for every parameter, with the grazes below and above its value."""

    command = "safe"
    dimension = "parameter"

    @property
    def clears(self) -> bool:
        """Tell whether the orbit is clear of every stop at the scene's values."""
        return bool(self.document["clears"])

    @property
    def attractors(self) -> list[dict[str, Any]]:
        """Attractors found by direct simulation, the one with the largest share first.

        Each has its name ``orbit``, its share ``fraction`` of the starts, its ``impact_speed``, and
        the ends ``from`` and ``to`` of the interval of the parameter :attr:`along` in which it
        exists: ``value``, and as ``label`` the special point there (``None``: followed no
        farther). An attractor that was not followed has no ends.
        """
        return list(self.document["attractors"])

    @property
    def along(self) -> str:
        """Parameter along which the attractors were followed."""
        return str(self.document["along"])

    def plot(
        self, ax: Axes | None = None, x: str | None = None, y: str | None = None, **style: Any
    ) -> Axes:
        """Draw a row for every parameter and a row for every attractor that was followed.

        Lines are intervals relative to the scene's values: without contact, of the tolerance, and
        in which an attractor exists. A line that reaches the edge has no known end.

        Parameters
        ----------
        ax
            Axes to draw on (default: new ones).
        x, y
            Columns of numbers to draw instead.
        **style
            Properties of the lines, as for :meth:`matplotlib.axes.Axes.plot`.

        """
        if x is not None or y is not None:
            return super().plot(ax, x, y, **style)
        return _plot.safety(self, ax, style)


class Derivatives(Table):
    """State after hits with its derivatives: a row for every derivative."""

    command = "derivatives"
    dimension = "by"

    @property
    def variables(self) -> list[str]:
        """Names of the variables: states and phase at the start, then parameters."""
        return list(self.document["variables"])

    @property
    def value(self) -> dict[str, float]:
        """Full state at the end; the phase is not reduced."""
        return dict(self.document["state"])

    @property
    def gradient(self) -> np.ndarray[Any, Any]:
        """First derivatives, of shape (components of the state, variables)."""
        return self.tensor(1)

    @property
    def hessian(self) -> np.ndarray[Any, Any]:
        """Second derivatives, of shape (components of the state, variables, variables)."""
        return self.tensor(2)

    def tensor(self, order: int) -> np.ndarray[Any, Any]:
        """Give the derivatives of an order: components of the state, then variables.

        Raises :class:`InputError` if the order was not computed.
        """
        if not 1 <= order <= self.document["order"]:
            message = f"order: expected 1 to {self.document['order']}, found {order!r}"
            raise InputError(message)
        name = {1: "gradient", 2: "hessian"}.get(order, f"order_{order}")
        return np.array([of[name] for of in self.document["derivatives"].values()])

    @property
    def events(self) -> list[dict[str, Any]]:
        """Hits, and ends of contacts, with the derivatives of their times."""
        return list(self.document["events"])

    @property
    def graze(self) -> dict[str, Any] | None:
        """Graze with the series beside it; ``None`` if the trajectory does not graze.

        ``surface``, ``time``, ``gap``; derivatives of the ``depth`` ``d`` of the free flow; and for
        each component those of ``contact`` and ``root``, with which the state where ``d`` is
        positive is ``contact + sqrt(d) * root``. Everything else then is without contact.
        """
        found = self.document.get("graze")
        return None if found is None else dict(found)


class SoftStops(Table):
    """Soft stops of a wanted restitution: a row for every contact law and speed."""

    command = "contact"

    @property
    def stops(self) -> list[dict[str, Any]]:
        """One stop for each law: ``stiffness``, ``damper``, and ``contact`` and ``release``."""
        names = ("law", "exponent", "stiffness", "damper", "contact", "release")
        return [{name: stop[name] for name in names} for stop in self.document["laws"]]


class Trajectory(Table):
    """Time series: a row for every sample and event."""

    command = "trajectory"
    dimension = "t"

    def plot(
        self,
        ax: Axes | None = None,
        x: str | None = None,
        y: str | None = None,
        **style: Any,
    ) -> Axes:
        """Draw a state over time, with the stops and impacts.

        A stop is drawn where its gap depends on the state alone, and that linearly.

        Parameters
        ----------
        ax
            Axes to draw on (default: new ones).
        x, y
            Columns of numbers (default: the time and the first state); ``x="x", y="v"`` is a phase
            portrait.
        **style
            Properties of the lines, as for :meth:`matplotlib.axes.Axes.plot`.

        """
        return _plot.trajectory(self, ax, (x, y), style)


class Study(Table):
    """Convergence study: a row for every pair of orders."""

    command = "converge"

    def plot(
        self,
        ax: Axes | None = None,
        x: str | None = None,
        y: str | None = None,
        **style: Any,
    ) -> Axes:
        """Draw the largest error over the weight of the contact, a line for every smooth order.

        Parameters
        ----------
        ax
            Axes to draw on (default: new ones).
        x, y
            Two columns of numbers to draw over each other instead.
        **style
            Properties of the lines, as for :meth:`matplotlib.axes.Axes.plot`.

        """
        return _plot.study(self, ax, (x, y), style)


class Image(Table):
    """Images of section points: a row for every starting point and iteration."""

    command = "image"
    flags = ("inside",)

    def to_xarray(self) -> xr.Dataset:
        """Give images by ``row`` and ``iteration``; needs xarray."""
        from . import _xarray

        return _xarray.of_image(self)

    def plot(
        self,
        ax: Axes | None = None,
        x: str | None = None,
        y: str | None = None,
        **style: Any,
    ) -> Axes:
        """Draw the images as points of the section, those outside the window in grey.

        Parameters
        ----------
        ax
            Axes to draw on (default: new ones).
        x, y
            Columns of numbers (default: the first two coordinates).
        **style
            Properties of the points, as for :meth:`matplotlib.axes.Axes.plot`.

        """
        return _plot.points(self, ax, (x, y), style)


class Fit(Table):
    """Fitted parameters: a row for each."""

    command = "fit"
    dimension = "parameter"

    def to_xarray(self) -> xr.Dataset:
        """Give the parameters with their covariance; needs xarray."""
        from . import _xarray

        return _xarray.of_fit(self)

    @property
    def parameters(self) -> dict[str, float]:
        """Fitted offsets of the parameters, by name."""
        return dict(zip(self["parameter"], map(float, self["offset"]), strict=True))

    @property
    def errors(self) -> dict[str, float]:
        """Standard errors of the parameters, by name."""
        return dict(zip(self["parameter"], map(float, self["standard_error"]), strict=True))

    @property
    def covariance(self) -> np.ndarray[Any, Any]:
        """Covariance of the parameters, in the order of the rows."""
        return np.array(self.document["covariance"], dtype=np.float64)

    @property
    def noise(self) -> list[float]:
        """Standard deviation of the measurement in every coordinate, stated or estimated."""
        return list(self.document["noise"])

    def plot(
        self,
        ax: Axes | None = None,
        x: str | None = None,
        y: str | None = None,
        **style: Any,
    ) -> Axes:
        """Draw the confidence ellipses of two parameters, or the error bar of the only one.

        Parameters
        ----------
        ax
            Axes to draw on (default: new ones).
        x, y
            Names of the parameters (default: the first two).
        **style
            Properties of the ellipses, as for :meth:`matplotlib.axes.Axes.plot`.

        """
        return _plot.fit(self, ax, (x, y), style)


class Noise(Table):
    """Densities under noise: a row for every cell of every coordinate."""

    command = "noise"

    def to_xarray(self) -> xr.Dataset:
        """Give a dataset with the coordinates as dimensions; needs xarray.

        ``density`` and ``count`` are those of the first two coordinates together,
        ``density_NAME`` and ``count_NAME`` of one.
        """
        from . import _xarray

        return _xarray.of_noise(self)

    def density(self) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any], np.ndarray[Any, Any]]:
        """Give the cell edges of the first two coordinates and their joint density.

        Rows of the density belong to the second coordinate.
        """
        document = self.document
        (first, second, *_), cells = document["request"]["ranges"], document["request"]["cells"]
        counts = np.array(document["joint"], dtype=np.float64).reshape(cells, cells)
        across = np.linspace(first[0], first[1], cells + 1)
        up = np.linspace(second[0], second[1], cells + 1)
        area = (across[1] - across[0]) * (up[1] - up[0])
        return across, up, counts / (document["points"] * area)

    def plot(  # type: ignore[override]
        self, ax: Axes | None = None, **style: Any
    ) -> Axes:
        """Draw the joint density of the first two coordinates as an image.

        Parameters
        ----------
        ax
            Axes to draw on (default: new ones).
        **style
            Properties of the image, as for :meth:`matplotlib.axes.Axes.imshow`.

        """
        return _plot.noise(self, ax, style)


class Gallery(Table):
    """Published numbers beside computed ones: a row for each, with all columns as words.

    ``figures`` holds those of all entries, by path in the folder; ``document`` holds the rows.
    """

    command = "gallery"

    def __init__(self, folder: Path, ended: str | None = None) -> None:
        """Read the files that the program wrote into a folder."""
        with (folder / "numbers.csv").open(encoding="utf-8", newline="") as file:
            rows = csv.DictReader(file)
            held = list(rows)
            names = rows.fieldnames or ()
        self._columns = {
            name: np.array([row[name] for row in held], dtype=object) for name in names
        }
        self._computed = None
        self._text = self._outline = json.dumps(held)
        self._about = {}
        self.figures = {
            path.relative_to(folder).with_suffix("").as_posix(): path.read_text(encoding="utf-8")
            for path in sorted(folder.rglob("*.svg"))
        }
        self.remarks = ()
        self.ended = ended
        #: Path of the page with all figures and numbers.
        self.page = folder / "index.html"
