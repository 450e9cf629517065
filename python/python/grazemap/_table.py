"""What a computation gives: a table by columns, a document, figures."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

    from . import _lib


class Table(Mapping[str, np.ndarray[Any, Any]]):
    """Columns by name, as the program writes them to CSV: arrays of equal length.

    Numbers are doubles, NaN where nothing is known; words are an array of ``str`` objects, empty
    where nothing is known.
    """

    #: The command of the program that writes the same.
    command = ""

    def __init__(self, computed: _lib.Computed) -> None:
        """Take over what was computed."""
        self._columns = {
            name: _words(*held) if isinstance(held, tuple) else held
            for name, held in computed.columns().items()
        }
        self._text = computed.document
        self._figures = computed.figures

    def __getitem__(self, name: str) -> np.ndarray[Any, Any]:
        """Give a column."""
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        """Give the names of the columns, left to right."""
        return iter(self._columns)

    def __len__(self) -> int:
        """Count the columns."""
        return len(self._columns)

    @property
    def document(self) -> Any:
        """The JSON document of the program, as lists and dictionaries."""
        return json.loads(self._text)

    @property
    def figures(self) -> dict[str, str]:
        """The program's figures as SVG, by the names of their files without ``.svg``."""
        return {f"{self.command}{ending}": text for ending, text in self._figures}

    def to_pandas(self) -> pd.DataFrame:
        """Give the columns as a data frame."""
        import pandas as pd

        return pd.DataFrame(self._columns)

    def to_xarray(self) -> xr.Dataset:
        """Give the columns as variables along one dimension, ``row``."""
        import xarray as xr

        return xr.Dataset({name: ("row", column) for name, column in self._columns.items()})

    def __repr__(self) -> str:
        """Say how large the table is."""
        rows = len(next(iter(self._columns.values()), ()))
        return f"<grazemap {self.command or 'table'}: {rows} rows, {len(self)} columns>"

    def _repr_html_(self) -> str:
        """Show the figure in a notebook."""
        return next(iter(self.figures.values()), f"<pre>{self!r}</pre>".replace("<g", "&lt;g"))


def _words(numbers: np.ndarray[Any, Any], words: list[str]) -> np.ndarray[Any, Any]:
    """Give the words that numbers stand for; the last is that of -1."""
    known: np.ndarray[Any, Any] = np.array([*words, ""], dtype=object)
    return known.take(numbers, mode="wrap")


class Diagram(Table):
    """A bifurcation diagram: a row for every value of the parameter in every sweep."""

    command = "diagram"

    def points(self) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
        """Give offsets and values of all points to be drawn, as two arrays of equal length."""
        names = [name for name in self if name.startswith("value_")]
        values = np.column_stack([self[name] for name in names])
        offsets = np.repeat(self["offset"], len(names)).reshape(values.shape)
        drawn = np.isfinite(values)
        return offsets[drawn], values[drawn]

    def plot(self, ax: Axes | None = None, **style: Any) -> Axes:
        """Draw the points with Matplotlib, on new axes where none are given."""
        if ax is None:
            import matplotlib.pyplot as plt

            ax = plt.figure().add_subplot()
        ax.plot(*self.points(), **{"marker": ",", "linestyle": "none", "color": "black", **style})
        (first, *_) = self.document
        ax.set_xlabel(f"{first['parameter']} − {first['grazing_value']:.10g}")
        ax.set_ylabel(first["observable"])
        return ax


class Chart(Table):
    """A two-parameter chart: a row for every cell."""

    command = "chart"

    def grid(self) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any], np.ndarray[Any, Any]]:
        """Give the first chart: both axes, and the periods by second and first parameter.

        The period is 0 where there is none.
        """
        (chart, *_) = self.document
        first, second = (np.array(axis["offsets"]) for axis in chart["axes"])
        cells = first.size * second.size
        periods = np.nan_to_num(self["period"][:cells]).astype(int)
        return first, second, periods.reshape(second.size, first.size)

    def plot(self, ax: Axes | None = None, **style: Any) -> Axes:
        """Draw the periods of the first chart with Matplotlib, on new axes where none are given."""
        if ax is None:
            import matplotlib.pyplot as plt

            ax = plt.figure().add_subplot()
        ax.pcolormesh(*self.grid(), **{"shading": "nearest", **style})
        names = [axis["parameter"] for axis in self.document[0]["axes"]]
        ax.set_xlabel(f"{names[0]} offset")
        ax.set_ylabel(f"{names[1]} offset")
        return ax


class Basin(Table):
    """Basins of attraction: a row for every cell."""

    command = "basin"

    @property
    def attractors(self) -> list[dict[str, Any]]:
        """The attractors that were found, the one with the largest basin first."""
        (basin, *_) = self.document
        return list(basin["attractors"])
