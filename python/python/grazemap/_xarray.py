"""Results as datasets of xarray.

Dimensions have the names of parameters and coordinates. Their coordinates are offsets; beside each
stands ``NAME_value`` with the values. All variables are numbers, booleans and texts, so that a
dataset can be written to a file.
"""

from __future__ import annotations

import itertools
import json
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from ._table import Basin, Branch, Chart, Curve, Diagram, Fit, Image, Loci, Noise, Table

#: Units of variables that have the same in every scene.
_UNITS = {
    "period": "returns",
    "returns": "returns",
    "lyapunov": "1/return",
    "lyapunov_error": "1/return",
    "by_map": "1",
    "outside": "1",
}
#: Numbers of the classes of cells of a basin that belong to no attractor.
_CLASSES = {"undecided": 0, "outside": -1, "no_image": -2, "escaped": -3}
#: Columns that say which chart or sweep a row belongs to.
_HEADING = {"chart", "diagram", "parameter", "parameter_1", "parameter_2", "method", "heading"}
_HEADING |= {"start", "offset", "offset_1", "offset_2"}

Variables = dict[str, tuple[Any, ...]]


def rows(table: Table, dimension: str) -> xr.Dataset:
    """Give the columns along one dimension; a column of its name is the coordinate."""
    held = {_plain(name): (dimension, column) for name, column in table.items()}
    own = {name: held.pop(name) for name in (dimension,) if name in held}
    return _dataset(table._head, held, own)


def of_diagram(table: Diagram) -> xr.Dataset:
    """Give sweeps by parameter and iterate."""
    head = table._head
    sweeps, along = head["sweeps"], head["parameter"]
    points = len(table["offset"]) // len(sweeps)
    shape = (len(sweeps), points)
    offsets = table["offset"].reshape(shape)
    rising = np.argsort(offsets, axis=1, kind="stable")

    def sorted_by_offset(name: str) -> np.ndarray[Any, Any]:
        return np.take_along_axis(table[name].reshape(shape), rising, axis=1)

    iterates = [name for name in table if name.startswith("value_")]
    values = np.stack([sorted_by_offset(name) for name in iterates], axis=-1)
    dimensions = ("sweep", along)
    note = {"long_name": head["observable"]}
    variables: Variables = {"value": ((*dimensions, "iterate"), values, note)}
    for name in table:
        if name not in _HEADING and name not in iterates:
            variables[_plain(name)] = (dimensions, sorted_by_offset(name))
    axis = np.take_along_axis(offsets, rising, axis=1)[0]
    coordinates: Variables = {
        "sweep": ("sweep", np.arange(1, len(sweeps) + 1)),
        "heading": ("sweep", _texts(sweep["heading"] for sweep in sweeps)),
        "method": ("sweep", _texts(sweep["method"] for sweep in sweeps)),
        **_starts("sweep", head, [sweep["start"] for sweep in sweeps]),
        **_axis(along, axis, head["grazing_value"]),
        "iterate": ("iterate", np.arange(1, len(iterates) + 1)),
    }
    found = _dataset(head, variables, coordinates)
    return found.set_xindex("heading").set_xindex("method")


def of_chart(table: Chart) -> xr.Dataset:
    """Give cells by the two parameters; methods and starts are dimensions where several."""
    heads = table._heads
    first, second = heads[0]["axes"]
    methods = list(dict.fromkeys(head["method"] for head in heads))
    starts = list(dict.fromkeys(tuple(head["start"] or ()) for head in heads))
    leading: list[str] = []
    coordinates: Variables = {}
    if len(methods) > 1:
        leading.append("method")
        coordinates["method"] = ("method", _texts(methods))
    if len(starts) > 1:
        leading.append("start")
        coordinates["start"] = ("start", np.arange(1, len(starts) + 1))
        coordinates |= _starts("start", heads[0], [list(start) or None for start in starts])
    coordinates |= _axis(second["parameter"], second["offsets"], second["grazing_value"])
    coordinates |= _axis(first["parameter"], first["offsets"], first["grazing_value"])
    cells = (len(second["offsets"]), len(first["offsets"]))
    places = [
        (methods.index(head["method"]), starts.index(tuple(head["start"] or ()))) for head in heads
    ]
    dimensions = (*leading, second["parameter"], first["parameter"])
    sizes = tuple(size for size in (len(methods), len(starts)) if size > 1)

    def laid_out(name: str) -> np.ndarray[Any, Any]:
        column = table[name].reshape((len(heads), *cells))
        whole = np.empty((len(methods), len(starts), *cells), dtype=column.dtype)
        for place, chart in zip(places, column, strict=True):
            whole[place] = chart
        return whole.reshape((*sizes, *cells))

    names = [name for name in table if name not in _HEADING]
    variables: Variables = {_plain(name): (dimensions, laid_out(name)) for name in names}
    found = _dataset(heads[0], variables, coordinates)
    if len(methods) > 1:
        found.attrs["method"] = ", ".join(methods)
    return found


def of_basin(table: Basin) -> xr.Dataset:
    """Give cells by the two coordinates, and the attractors by their number."""
    head = table._head
    first, second = head["axes"]
    cells = (len(second["offsets"]), len(first["offsets"]))
    words = table["attractor"]
    known, place = np.unique(words.astype(str), return_inverse=True)
    classes = np.array([_class(word) for word in known], dtype=np.int32)
    note = {
        "long_name": "attractor",
        "flag_values": np.array(list(_CLASSES.values()), dtype=np.int32),
        "flag_meanings": " ".join(_CLASSES),
    }
    dimensions = (second["coordinate"], first["coordinate"])
    attractors = head["attractors"]
    variables: Variables = {
        "attractor": (dimensions, classes[place].reshape(cells), note),
        "fraction": ("number", _numbers(one["fraction"] for one in attractors)),
        "itinerary": ("number", _texts(one["itinerary"] for one in attractors)),
        "period": ("number", _numbers(_period(one["period"]) for one in attractors)),
        "lyapunov": ("number", _numbers(one["lyapunov"] for one in attractors)),
    }
    section = dict(zip(head["coordinates"], head["section"]["point"], strict=True))
    coordinates: Variables = {"number": ("number", np.arange(1, len(attractors) + 1))}
    for axis in (second, first):
        name = axis["coordinate"]
        coordinates |= _axis(name, axis["offsets"], section[name])
    for parameter in head["parameters"]:
        coordinates[parameter["name"]] = ((), parameter["offset"])
        coordinates[f"{parameter['name']}_value"] = ((), parameter["value"])
    return _dataset(head, variables, coordinates)


def of_branches(table: Branch) -> list[xr.Dataset]:
    """Give each branch with its special points."""
    head = table._head
    along = head["along"]
    several = {"branch", "itinerary", "period", "name", "speeds", along, f"{along}_value"}
    multipliers = _multipliers(table)
    several = several.union(*multipliers)
    found = []
    for branch in head["branches"]:
        own = table["branch"] == branch["branch"]
        points = branch["points"]
        held = [name for name in table if name not in several]
        variables: Variables = {_plain(name): ("point", table[name][own]) for name in held}
        for part, names in zip(("re", "im"), multipliers, strict=True):
            columns = np.stack([table[name][own] for name in names], axis=-1)
            variables[f"multiplier_{part}"] = (("point", "multiplier"), columns)
        speeds = [[contact["speed"] for contact in point["contacts"]] for point in points]
        variables["speed"] = (("point", "contact"), _ragged(speeds))
        variables["orbit"] = ("point", table["name"][own])
        coordinates = _along(table, along, own, head["grazing_parameters"][along])
        special = [place for place, point in enumerate(points) if point.get("label")]
        coordinates |= _special(coordinates, special, (along, f"{along}_value"))
        variables["special_label"] = ("special", _texts(points[one]["label"] for one in special))
        variables["special_coefficient"] = (
            "special",
            _numbers(points[one].get("coefficient") for one in special),
        )
        one = _dataset(head, variables, coordinates)
        one.attrs |= _described(branch, ("branch", "itinerary", "period"))
        found.append(one)
    return found


def of_loci(table: Loci) -> list[xr.Dataset]:
    """Give each locus with its points of codimension two."""
    head = table._head
    first, second = head["plane"]
    places = {name for axis in (first, second) for name in (axis, f"{axis}_value")}
    found = []
    for number, locus in enumerate(head["loci"], 1):
        own = table["locus"] == number
        held = [name for name in table if name not in {"locus", "kind", "itinerary", *places}]
        variables: Variables = {_plain(name): ("point", table[name][own]) for name in held}
        grazing = head["grazing_parameters"]
        coordinates = _along(table, first, own, grazing[first])
        coordinates |= _along(table, second, own, grazing[second])
        special = [place for place, label in enumerate(table["label"][own]) if label]
        coordinates |= _special(coordinates, special, sorted(places))
        variables["special_label"] = ("special", table["label"][own][special])
        one = _dataset(head, variables, coordinates)
        one.attrs |= {"locus": number, **_described(locus, ("kind", "itinerary"))}
        found.append(one)
    return found


def of_curve(table: Curve) -> xr.Dataset:
    """Give the points of a grazing curve, with the parameters as coordinates."""
    head = table._head
    held: Variables = {_plain(name): ("point", column) for name, column in table.items()}
    coordinates = {name: held.pop(name) for name in head["free"]}
    return _dataset(head, held, coordinates)


def of_image(table: Image) -> xr.Dataset:
    """Give images by state and iteration; those that do not exist are NaN."""
    state, iteration = (table[name].astype(int) for name in ("row", "iteration"))
    shape = (state.max(initial=-1) + 1, iteration.max(initial=0))
    variables: Variables = {}
    for name, column in table.items():
        if name not in ("row", "iteration"):
            empty = np.nan if column.dtype.kind == "f" else column.dtype.type()
            whole = np.full(shape, empty, dtype=column.dtype)
            whole[state, iteration - 1] = column
            variables[_plain(name)] = (("row", "iteration"), whole)
    coordinates: Variables = {
        "row": ("row", np.arange(shape[0])),
        "iteration": ("iteration", np.arange(1, shape[1] + 1)),
    }
    return _dataset(table._head, variables, coordinates)


def of_fit(table: Fit) -> xr.Dataset:
    """Give the fitted parameters with their covariance."""
    found = rows(table, "parameter")
    found["covariance"] = (("parameter", "parameter_2"), table.covariance)
    return found.assign_coords(parameter_2=("parameter_2", found["parameter"].values))


def of_noise(table: Noise) -> xr.Dataset:
    """Give the joint density of the first two coordinates, and that of each coordinate."""
    head = table._head
    names = list(dict.fromkeys(table["coordinate"]))
    ranges, cells = head["request"]["ranges"], head["request"]["cells"]
    coordinates: Variables = {}
    variables: Variables = {}
    for name, (low, high) in zip(names, ranges, strict=True):
        edges = np.linspace(low, high, cells + 1)
        coordinates[name] = (name, (edges[:-1] + edges[1:]) / 2)
        coordinates[f"{name}_from"] = (name, edges[:-1])
        coordinates[f"{name}_to"] = (name, edges[1:])
        own = table["coordinate"] == name
        variables[f"density_{name}"] = (name, table["density"][own])
        variables[f"count_{name}"] = (name, table["count"][own])
    if len(names) > 1:
        _, _, density = table.density()
        counts = np.array(head["joint"], dtype=np.int64).reshape(cells, cells)
        variables["density"] = ((names[1], names[0]), density)
        variables["count"] = ((names[1], names[0]), counts)
    coordinates["coordinate"] = ("coordinate", _texts(names))
    coordinates["coordinate_2"] = ("coordinate_2", _texts(names))
    variables["mean"] = ("coordinate", _numbers(head["mean"]))
    covariance = np.array(head["covariance"], dtype=np.float64)
    variables["covariance"] = (("coordinate", "coordinate_2"), covariance)
    return _dataset(head, variables, coordinates)


def _dataset(
    head: Mapping[str, Any], variables: Mapping[str, Any], coordinates: Mapping[str, Any]
) -> xr.Dataset:
    """Make a dataset. A variable that has the name of a coordinate gets a trailing `_`."""
    named = {name + "_" * (name in coordinates): held for name, held in variables.items()}
    found = xr.Dataset(named, coordinates, _described(head, _ATTRIBUTES))
    for name, unit in _UNITS.items():
        if name in found and name not in coordinates:
            found[name].attrs["units"] = unit
    bounds = (head.get("window") or {}).get("bounds", ())
    if bounds:
        found.attrs["window"] = json.dumps({bound["name"]: bound["value"] for bound in bounds})
    found.attrs["units"] = "those of the scene"
    return found


#: Fields of a document that are attributes of its dataset.
_ATTRIBUTES = ("document", "scene", "digest", "version", "method", "using", "observe", "margin")


def _described(head: Mapping[str, Any], names: Iterable[str]) -> dict[str, Any]:
    """Give the texts and numbers of these fields."""
    given = {name: head.get(name) for name in names}
    return {name: value for name, value in given.items() if isinstance(value, (str, int, float))}


def _axis(name: str, offsets: Any, grazing_value: float) -> Variables:
    """Give the coordinates of an axis: offsets and values."""
    offsets = np.asarray(offsets, dtype=np.float64)
    note = {"long_name": f"{name} - {grazing_value:.10g}", "grazing_value": grazing_value}
    return {
        name: (name, offsets, note),
        f"{name}_value": (name, grazing_value + offsets, {"long_name": name}),
    }


def _along(table: Table, name: str, own: np.ndarray[Any, Any], grazing_value: float) -> Variables:
    """Give a parameter along points: offsets and values."""
    note = {"long_name": f"{name} - {grazing_value:.10g}", "grazing_value": grazing_value}
    return {
        name: ("point", table[name][own], note),
        f"{name}_value": ("point", table[f"{name}_value"][own], {"long_name": name}),
    }


def _special(coordinates: Variables, special: Sequence[int], names: Iterable[str]) -> Variables:
    """Give the places of special points: their numbers among the points, and parameters."""
    places = np.array(special, dtype=np.int64)
    own: Variables = {"special_point": ("special", places)}
    for name in names:
        own[f"special_{name}"] = ("special", coordinates[name][1][places])
    return own


def _starts(
    dimension: str, head: Mapping[str, Any], starts: Sequence[Sequence[float] | None]
) -> Variables:
    """Give the offsets of starts by coordinate; NaN for those that were not named."""
    names = head["section"]["coordinates"]
    if all(start is None for start in starts):
        return {}
    columns = np.array([start or [np.nan] * len(names) for start in starts], dtype=np.float64)
    return {
        f"start_{name}": (dimension, column) for name, column in zip(names, columns.T, strict=True)
    }


def _multipliers(table: Table) -> tuple[list[str], list[str]]:
    """Give the columns of real and imaginary parts, ``re1``, ``im1``, and so on."""
    numbers = list(itertools.takewhile(lambda n: f"re{n}" in table, itertools.count(1)))
    return [f"re{n}" for n in numbers], [f"im{n}" for n in numbers]


def _ragged(lists: Sequence[Sequence[float]]) -> np.ndarray[Any, Any]:
    """Give lists as rows, with NaN behind the shorter ones."""
    width = max(map(len, lists), default=0)
    return np.array([[*one, *[np.nan] * (width - len(one))] for one in lists], dtype=np.float64)


def _class(word: str) -> int:
    """Give the number of an attractor or of a class of cells."""
    number = _CLASSES.get(word.replace(" ", "_"))
    return int(word) if number is None else number


def _period(period: Any) -> float:
    """Give a period, NaN without one."""
    return float(period["periodic"]) if isinstance(period, dict) else np.nan


def _numbers(values: Iterable[float | None]) -> np.ndarray[Any, Any]:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def _texts(values: Iterable[str | None]) -> np.ndarray[Any, Any]:
    return np.array([value or "" for value in values], dtype=object)


def _plain(name: str) -> str:
    """Give the name of a column as a name of Python: ``orbit (stop,periods)`` is ``orbit``."""
    return name.partition(" (")[0].replace(" ", "_").replace("/", "_per_")
