"""Scene, graze and map: from equations to images of points."""

from __future__ import annotations

import html
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _lib, _toml
from ._errors import InputError
from ._names import older
from ._table import Table

if TYPE_CHECKING:
    from collections.abc import Mapping
    from os import PathLike

#: Number of samples of the orbit shown in a notebook.
SAMPLES = 200

Array: TypeAlias = NDArray[np.float64]

#: Methods and number formats of images, and languages of emitted maps.
METHODS, PRECISIONS, TARGETS = map(tuple, _lib.words())


class _Value:
    """Base of values that are compared, hashed and pickled by their text."""

    def _key(self) -> str:
        raise NotImplementedError

    def __eq__(self, other: object) -> bool:
        """Compare the texts."""
        return isinstance(other, type(self)) and self._key() == other._key()

    def __hash__(self) -> int:
        """Hash the text."""
        return hash(self._key())


class Scene(_Value):
    """Oscillator with its stops and the requested analyses, from a scene file.

    >>> scene = Scene.catalogue("linear")
    >>> scene.states
    ('x', 'v', 'theta')
    """

    def __init__(self, inner: _lib.Scene) -> None:
        """Wrap a scene; use :meth:`load`, :meth:`parse` or :meth:`catalogue`."""
        self._inner = inner

    @classmethod
    def load(
        cls, path: str | PathLike[str], overrides: Mapping[str, object] | None = None
    ) -> Scene:
        """Read a scene file, with overrides as in :meth:`with_`.

        Raises
        ------
        SceneError
            The first fault, with its line and column.

        """
        return cls(_lib.Scene.load(Path(path), _overrides(overrides or {})))

    @classmethod
    def parse(cls, text: str, name: str = "scene.toml") -> Scene:
        """Parse the text of a scene; ``name`` is its name in messages."""
        return cls(_lib.Scene.parse(text, name, []))

    @classmethod
    def catalogue(cls, name: str) -> Scene:
        """Give a scene of the catalogue; :func:`grazemap.catalogue` lists the names."""
        text = _lib.Scene.catalogue_text(name)
        if text is None:
            message = f"no scene `{name}` in the catalogue: {', '.join(_lib.catalogue())}"
            raise InputError(message)
        return cls.parse(text, f"{name}.toml")

    def with_(self, **overrides: object) -> Scene:
        """Give the scene with other values of parameters, or of keys by their dotted path.

        >>> scene = Scene.catalogue("linear").with_(zeta=0.1, **{"expansion.smooth_order": 4})
        >>> scene.parameters["zeta"]
        0.1
        """
        inner = self._inner
        return Scene(_lib.Scene.parse(inner.text, inner.file_name, _overrides(overrides)))

    @property
    def text(self) -> str:
        """Text of the scene, overrides included."""
        return self._inner.text

    @property
    def name(self) -> str:
        """Identifier: the file name without extension."""
        return self._inner.name

    @property
    def digest(self) -> str:
        """Digest of the text."""
        return self._inner.digest

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states, the phase last."""
        return tuple(self._inner.states)

    @property
    def parameters(self) -> dict[str, float]:
        """Values of the parameters as the scene states them."""
        return dict(self._inner.parameters)

    @property
    def active(self) -> tuple[str, ...]:
        """Names of the parameters that maps keep as variables."""
        return tuple(self._inner.active)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about suspicious entries that are not errors."""
        return tuple(self._inner.warnings)

    def graze(self) -> Graze:
        """Find the orbit that just touches the stop.

        Raises
        ------
        NoResult
            The search ended without an orbit; the message says why.

        """
        return Graze(self._inner.graze())

    def _key(self) -> str:
        return f"{self._inner.file_name}\n{self.text}"

    def __reduce__(self) -> tuple[object, tuple[str, str]]:
        """Pickle the text."""
        return Scene.parse, (self.text, self._inner.file_name)

    def __repr__(self) -> str:
        """Name the scene."""
        return f"<grazemap scene {self.name}: {', '.join(self.states)}>"

    def _repr_html_(self) -> str:
        """Show the text in a notebook."""
        return _words(self, self.text)


class Graze(_Value):
    """Grazing orbit of a scene.

    >>> graze = Scene.catalogue("linear").graze()
    >>> len(graze.multipliers)
    2
    """

    def __init__(self, inner: _lib.Graze) -> None:
        """Wrap an orbit; use :meth:`Scene.graze`."""
        self._inner = inner
        self.document: dict[str, Any] = json.loads(inner.to_json())
        """Document of ``grazemap locate --json``."""

    @classmethod
    def from_json(cls, text: str) -> Graze:
        """Read a saved orbit, bit by bit."""
        return cls(_lib.Graze.from_json(text))

    def to_json(self) -> str:
        """Write the orbit as the document that the program saves."""
        return self._inner.to_json()

    @property
    def scene(self) -> Scene:
        """Scene of the orbit."""
        return Scene(self._inner.scene)

    @property
    def parameters(self) -> dict[str, float]:
        """Values of all parameters at which the orbit grazes."""
        return dict(self.document["parameters"])

    @property
    def state(self) -> dict[str, float]:
        """State at the grazing point."""
        return dict(self.document["state"])

    @property
    def multipliers(self) -> NDArray[np.complex128]:
        """Eigenvalues of the smooth Poincaré map, the largest first."""
        return np.array([complex(*pair) for pair in self.document["multipliers"]])

    @property
    def xi(self) -> Array:
        """``xi_1, xi_2, ...``: 0 at a point of codimension two."""
        return np.array(self.document["xi"])

    @property
    def verdict(self) -> str:
        """Bifurcation at the graze, as theory predicts it."""
        return "\n".join(self._inner.verdict())

    def map(self) -> Map:
        """Expand the local map, with the scene's orders or the cheapest for its tolerance."""
        return Map(self._inner.map())

    def _key(self) -> str:
        return self.to_json()

    def __reduce__(self) -> tuple[object, tuple[str]]:
        """Pickle the document."""
        return Graze.from_json, (self.to_json(),)

    def __repr__(self) -> str:
        """Name the scene and the parameters at which it grazes."""
        parameters = ", ".join(f"{name} = {value:.10g}" for name, value in self.parameters.items())
        return f"<grazemap graze of {self.document['scene']}: {parameters}>"

    def _repr_html_(self) -> str:
        """Show the orbit and the predicted bifurcation in a notebook."""
        return _portrait(self._inner) + _words(self, *self.verdict.splitlines())


class Map(_Value):
    """Local map near a graze; states and parameters are offsets from the grazing orbit.

    >>> import numpy as np
    >>> m = Scene.catalogue("linear").graze().map()
    >>> m(np.zeros((3, 2))).shape
    (3, 2)
    """

    def __init__(self, inner: _lib.Map) -> None:
        """Wrap a map; use :meth:`Graze.map`."""
        self._inner = inner

    @classmethod
    def from_json(cls, text: str) -> Map:
        """Read a saved map, with the bits that it had."""
        return cls(_lib.Map.from_json(text))

    def to_json(self) -> str:
        """Write the map as the document that the program saves as ``map.json``."""
        return self._inner.to_json()

    @property
    def graze(self) -> Graze:
        """Grazing orbit, on the section of the map."""
        return Graze(self._inner.graze)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the section's coordinates, in the order of a state."""
        return tuple(self._inner.coordinates)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the active parameters, in the order in which they are passed."""
        return tuple(self._inner.parameters)

    @property
    def orders(self) -> tuple[int, int]:
        """Order of the smooth map and weight of the contact."""
        return self._inner.orders[1:]

    @property
    def window(self) -> dict[str, float]:
        """Largest depth ``y²`` and the half-widths of coordinates and parameters, by name."""
        depth, states, parameters = self._inner.window
        names = ("depth", *self.coordinates, *self.parameters)
        return dict(zip(names, (depth, *states, *parameters), strict=True))

    @property
    def error(self) -> dict[str, float]:
        """Largest error against direct simulation measured in the window, by coordinate."""
        errors = [np.nan if error is None else error for error in self._inner.errors]
        return dict(zip(self.coordinates, errors, strict=True))

    @property
    def polynomials(self) -> Table:
        """Coefficients by name: the table of ``grazemap expand --csv``."""
        return Table(self._inner.polynomials())

    def emit(
        self, folder: str | PathLike[str], target: str = "rust", *, measure: bool = True
    ) -> list[Path]:
        """Write the map as source code into a folder; return the paths of the files.

        ``target`` is one of :data:`TARGETS`. Files that were not emitted are never replaced.
        Without ``measure`` the code does not state its error.
        """
        names = self._inner.emit(Path(folder), target, measure)
        if names is None:
            message = f"target is one of {', '.join(TARGETS)}, found {target!r}"
            raise InputError(message)
        return [Path(folder) / name for name in names]

    def save(self, path: str | PathLike[str]) -> None:
        """Write the map to a file, which the program accepts in place of a scene."""
        Path(path).write_text(self.to_json(), encoding="utf-8")

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Map:
        """Read a saved map, with the bits that it had."""
        return cls.from_json(Path(path).read_text(encoding="utf-8"))

    def __call__(self, states: ArrayLike, parameters: ArrayLike | None = None) -> Array:
        """Give the images of one state or of rows of states.

        Parameters are one row for all states or one row for each (default: all 0).
        """
        rows, own, shape = self._points(states, parameters)
        return self._inner.batch(rows, own, False)[:, : shape[-1]].reshape(shape)

    def jacobian(self, states: ArrayLike, parameters: ArrayLike | None = None) -> Array:
        """Give the derivatives of the images by coordinates, then parameters.

        The last two axes are the coordinate of the image and the variable.
        """
        rows, own, shape = self._points(states, parameters)
        columns = len(self.coordinates) + len(self.parameters)
        first = shape[-1] + self._inner.orders[0]
        derivatives = self._inner.batch(rows, own, True)[:, first:]
        return derivatives.reshape((*shape, columns))

    def depths(self, states: ArrayLike, parameters: ArrayLike | None = None) -> Array:
        """Give the depths ``y² = -h_min`` of the passages, negative without contact."""
        rows, own, shape = self._points(states, parameters)
        passages = self._inner.orders[0]
        depths = self._inner.batch(rows, own, False)[:, shape[-1] : shape[-1] + passages]
        return depths.reshape((*shape[:-1], passages))

    def inside(self, states: ArrayLike, parameters: ArrayLike | None = None) -> NDArray[np.bool_]:
        """Tell whether each state lies in the window on which the map's error was measured."""
        rows, own, shape = self._points(states, parameters)
        return self._inner.inside(rows, own).reshape(shape[:-1])

    @older(using="method")
    def iterate(
        self,
        states: ArrayLike,
        parameters: ArrayLike | None = None,
        iterations: int = 1,
        *,
        method: str = "map",
        precision: str = "f64",
    ) -> Array:
        """Give the orbits of states; the axis of iterates is before the axis of coordinates.

        ``method`` is ``"map"``, ``"guarded"`` (direct simulation outside the window), ``"direct"``,
        ``"smooth"`` or ``"discontinuity"``; ``precision`` is ``"f64"``, ``"f32"`` or ``"dd"``.
        Values after the early end of an orbit are NaN.
        """
        rows, own, shape = self._points(states, parameters)
        check_methods(method, precision)
        orbits = self._inner.orbits(rows, own, iterations, method, precision)
        return orbits.reshape((*shape[:-1], iterations, shape[-1]))

    def _points(
        self, states: ArrayLike, parameters: ArrayLike | None
    ) -> tuple[Array, Array, tuple[int, ...]]:
        """Give states as rows, parameters as one row or one per state, and the states' shape."""
        given = np.asarray(states, dtype=np.float64)
        width, count = len(self.coordinates), len(self.parameters)
        if given.ndim == 0 or given.shape[-1] != width:
            message = f"a state has {width} coordinates ({', '.join(self.coordinates)}), found an "
            message += f"array of shape {given.shape}"
            raise InputError(message)
        rows = np.ascontiguousarray(given.reshape(-1, width))
        own = np.zeros(count) if parameters is None else np.asarray(parameters, dtype=np.float64)
        if own.ndim == 0 or own.shape[-1] != count or own.size not in (count, count * len(rows)):
            message = f"expected one row of {count} parameters ({', '.join(self.parameters)}) or a "
            message += f"row for each of {len(rows)} states, found an array of shape {own.shape}"
            raise InputError(message)
        return rows, np.ascontiguousarray(own.reshape(-1, count)), given.shape

    def _key(self) -> str:
        return self.to_json()

    def __reduce__(self) -> tuple[object, tuple[str]]:
        """Pickle the document."""
        return Map.from_json, (self.to_json(),)

    def __repr__(self) -> str:
        """Name the scene and the orders."""
        smooth, contact = self.orders
        scene = self._inner.graze.scene.name
        return f"<grazemap map of {scene}: N = {smooth}, W = {contact}>"

    def _repr_html_(self) -> str:
        """Show the orbit and the errors of the map in a notebook."""
        errors = (f"error in {name}: {error:.2g}" for name, error in self.error.items())
        return _portrait(self._inner.graze) + _words(self, *errors)


@overload
def catalogue() -> list[str]: ...


@overload
def catalogue(name: str) -> Scene: ...


def catalogue(name: str | None = None) -> list[str] | Scene:
    """Give a scene of the catalogue or, without a name, the names of all scenes.

    >>> catalogue("linear").states
    ('x', 'v', 'theta')
    >>> "mems" in catalogue()
    True
    """
    return _lib.catalogue() if name is None else Scene.catalogue(name)


def _portrait(graze: _lib.Graze) -> str:
    """Draw the phase portrait of a grazing orbit."""
    found = _lib.answer(graze, json.dumps({"trajectory": {"samples": SAMPLES}}), None, [])
    return next((figure for _, figure in found.figures), "")


def _words(value: object, *lines: str) -> str:
    """Write the representation of a value, and lines of text, as HTML."""
    return f"<pre>{html.escape(chr(10).join([repr(value), *lines]))}</pre>"


def check_methods(method: str, precision: str) -> None:
    """Refuse unknown methods and number formats of images."""
    for what, given, known in (("method", method, METHODS), ("precision", precision, PRECISIONS)):
        if given not in known:
            message = f"{what} is one of {', '.join(known)}, found {given!r}"
            raise InputError(message)


def _overrides(values: Mapping[str, object]) -> list[tuple[str, str]]:
    return [(key, _toml.value(item)) for key, item in values.items()]
