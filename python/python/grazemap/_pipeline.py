"""Scene, graze and map: from equations to images of points."""

from __future__ import annotations

import html
import json
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _check, _lib, _toml
from ._commands import TARGETS, Commands, ImageMethod, Precision, check_images
from ._errors import InputError
from ._model import Model
from ._names import older
from ._remarks import warn
from ._table import Branch, Table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from os import PathLike

    from ._model import Compliant, Expression, Phase, Rigid

#: Number of samples of the orbit shown in a notebook.
SAMPLES = 200

Array: TypeAlias = NDArray[np.float64]


class _Value(Commands):
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
    """Oscillator with its stops and the requested analyses.

    A scene is made from values, read from a file (:meth:`load`), parsed from text
    (:meth:`parse`) or taken from the catalogue (:meth:`catalogue`). The values are written as
    the text of a scene file, which :attr:`text` gives.

    Parameters
    ----------
    states
        Names of the states, without the phase.
    flow
        Rates in free flight: an expression for each state.
    stops
        Stops: :class:`Rigid` or :class:`Compliant`, one or several.
    solve_for
        Parameter that is adjusted until the orbit grazes, or one for each independent graze.
    parameters
        Values of the parameters by name: numbers or expressions of numbers, ``"2*pi"``.
    phase
        Periodic forcing, :class:`Phase`. Default: an autonomous system, which needs ``guess``.
    let
        Names for expressions, which may use each other.
    surface
        Name of the stop that is touched (default: the only one).
    passages
        Instead of ``surface``: names of the stops that are touched in one orbit, in order.
    periods
        Number of forcing periods of the orbit, 1 to 1000.
    guess
        State near the grazing point, with the phase; picks the orbit where several exist.
    symmetry
        ``"half-period"`` for an orbit that is its own mirror image; default ``"none"``.
    section
        ``"tangency"``, ``"stroboscopic"`` or ``"any"``, which needs ``tolerance``.
    active
        Parameters that maps keep as variables (default: ``solve_for``).
    smooth_order, contact_weight
        Orders of the map, 1 to 64 (default: 5 and 6).
    tolerance
        Error of the map in its window, instead of the orders.
    weights
        Weights of states and active parameters (default: 2).
    window
        Largest depth (``"depth"``) and half-widths of coordinates and active parameters by name,
        as in :attr:`Map.window`. Bounds that are left out are measured.
    name
        Name of the scene.

    Raises
    ------
    SceneError
        Fault in an expression or a name; the message names the argument.
    InputError
        Argument of a wrong type.

    Notes
    -----
    Expressions are texts with ``+ - * / ^``, or SymPy expressions of symbols with the names of
    the model.

    Examples
    --------
    >>> import grazemap as gm
    >>> scene = gm.Scene(
    ...     states=["x", "v"],
    ...     flow={"x": "v", "v": "alpha*cos(theta) - 2*zeta*v - x"},
    ...     stops=gm.Rigid("delta - x", restitution="r"),
    ...     phase=gm.Phase("theta", rate="omega", period="2*pi"),
    ...     parameters={"zeta": 0.05, "delta": 1.0, "r": 0.8, "alpha": 2.2, "omega": 1.8},
    ...     solve_for="alpha",
    ...     active=["alpha", "omega"],
    ... )
    >>> scene.states
    ('x', 'v', 'theta')

    """

    _inner: _lib.Scene

    def __init__(
        self,
        states: Sequence[object],
        flow: Mapping[Any, Expression],
        stops: Rigid | Compliant | Sequence[Rigid | Compliant],
        *,
        solve_for: object | Sequence[object],
        parameters: Mapping[Any, float | str] | None = None,
        phase: Phase | None = None,
        let: Mapping[Any, Expression] | None = None,
        surface: str | None = None,
        passages: Sequence[str] | None = None,
        periods: int = 1,
        guess: Mapping[Any, float | str] | None = None,
        symmetry: str | None = None,
        section: str = "tangency",
        active: object | Sequence[object] | None = None,
        smooth_order: int | None = None,
        contact_weight: int | None = None,
        tolerance: float | None = None,
        weights: Mapping[Any, int] | None = None,
        window: Mapping[Any, float] | None = None,
        name: str = "scene",
    ) -> None:
        """Write the text of the scene and parse it."""
        model = Model(name)
        model.states(states, flow, parameters or {}, let or {}, phase)
        model.stops([stops] if not isinstance(stops, (list, tuple)) else list(stops))
        model.table(
            "grazing",
            solve_for=solve_for,
            surface=surface,
            passages=passages,
            periods=periods,
            guess=guess,
            symmetry=symmetry,
        )
        model.table("section", kind=section)
        model.table(
            "expansion",
            active=active,
            smooth_order=smooth_order,
            contact_weight=contact_weight,
            tolerance=tolerance,
            weights=weights,
        )
        model.window(window or {})
        self._inner = model.parse()
        warn(self.warnings)

    @classmethod
    def _of(cls, inner: _lib.Scene) -> Scene:
        """Wrap a parsed scene."""
        scene = cls.__new__(cls)
        scene._inner = inner
        return scene

    @classmethod
    def load(
        cls, path: str | PathLike[str], overrides: Mapping[str, object] | None = None
    ) -> Scene:
        """Read a scene file.

        Parameters
        ----------
        path
            Path of the file.
        overrides
            Other values of parameters or keys, as in :meth:`replace`.

        Returns
        -------
        Scene
            Scene with the text of the file.

        Raises
        ------
        SceneError
            The first fault, with its line and column.

        Examples
        --------
        >>> Scene.load("my.toml", {"zeta": 0.1})  # doctest: +SKIP
        <grazemap scene my: x, v, theta>

        """
        scene = cls._of(_lib.Scene.load(Path(path), _overrides(overrides or {})))
        warn(scene.warnings)
        return scene

    @classmethod
    def parse(cls, text: str, name: str = "scene.toml") -> Scene:
        """Parse the text of a scene.

        Parameters
        ----------
        text
            Text of a scene file, in TOML.
        name
            Name of the file in messages.

        Returns
        -------
        Scene
            Scene with this text.

        Raises
        ------
        SceneError
            The first fault, with its line and column.

        Examples
        --------
        >>> Scene.parse(Scene.catalogue("linear").text, "mine.toml").name
        'mine'

        """
        scene = cls._of(_lib.Scene.parse(text, name, []))
        warn(scene.warnings)
        return scene

    @classmethod
    def catalogue(cls, name: str) -> Scene:
        """Give a scene of the catalogue.

        Parameters
        ----------
        name
            Name, one of :func:`grazemap.scenes`.

        Returns
        -------
        Scene
            Scene of this name.

        Raises
        ------
        InputError
            Unknown name; the message has the nearest one.

        Examples
        --------
        >>> Scene.catalogue("linear").states
        ('x', 'v', 'theta')

        """
        text = _lib.Scene.catalogue_text(name) if isinstance(name, str) else None
        if text is None:
            near = _check.meant(str(name), scenes())
            message = f"name: no scene `{name}` in the catalogue{near}; grazemap.scenes() lists "
            raise InputError(message + "the names")
        return cls.parse(text, f"{name}.toml")

    def replace(self, **changes: object) -> Scene:
        """Give the scene with other values of parameters or keys.

        Parameters
        ----------
        **changes
            Values of parameters by name, and of keys by their dotted path.

        Returns
        -------
        Scene
            Changed copy.

        Raises
        ------
        SceneError
            Unknown name or wrong value.

        Examples
        --------
        >>> scene = Scene.catalogue("linear")
        >>> scene.replace(zeta=0.1, **{"expansion.smooth_order": 4}).parameters["zeta"]
        0.1

        """
        inner = self._inner
        scene = Scene._of(_lib.Scene.parse(inner.text, inner.file_name, _overrides(changes)))
        warn(new for new in scene.warnings if new not in self.warnings)
        return scene

    #: Older name of :meth:`replace`.
    with_ = replace

    def save(self, path: str | PathLike[str]) -> None:
        """Write the text to a scene file."""
        Path(path).write_text(self.text, encoding="utf-8")

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

        Returns
        -------
        Graze
            Grazing orbit, which the scene keeps.

        Raises
        ------
        NoResultError
            The search ended without an orbit; the message says why.

        Examples
        --------
        >>> round(Scene.catalogue("linear").graze().parameters["alpha"], 6)
        2.247221

        """
        return self._grazed

    def at_graze(self, branch: Branch | str | PathLike[str], number: int) -> Scene:
        """Give the scene whose grazing orbit is that of a special point of a branch.

        Parameters
        ----------
        branch
            Branches of this scene, or the path of their JSON document.
        number
            Number of the special point, a graze, as the program counts: ``branch.special`` holds
            number 1 first.

        Returns
        -------
        Scene
            Scene with the parameters of the point, the stop that its orbit grazes, the stops that
            it hits, and a guess of its state.

        Raises
        ------
        InputError
            Branches of another scene, or a point that is no graze of one passage.
        NoResultError
            The orbit of the point cannot be followed to its graze.

        Examples
        --------
        >>> import grazemap as gm
        >>> text = gm.Scene.catalogue("two_sided").text.replace('hits = "left"', "")
        >>> scene = gm.Scene.parse(text)
        >>> round(scene.graze().parameters["dr"], 9)
        2.711630723
        >>> found = scene.branch("dr", (-1, -0.8), period=2, method="direct")
        >>> found.special[0]["label"]
        'GR'
        >>> round(scene.at_graze(found, 1).graze().parameters["dr"], 9)
        1.805712937

        """
        if isinstance(branch, Branch):
            text, name = branch._text, Path("branch")
        else:
            name = Path(branch)
            text = name.read_text(encoding="utf-8")
        number = _check.count("number", number, 1)
        return Scene._of(self._inner.at_graze(text, name, number))

    def map(self) -> Map:
        """Expand the local map of the grazing orbit: ``scene.graze().map()``."""
        return self.graze().map()

    @cached_property
    def _grazed(self) -> Graze:
        """Grazing orbit."""
        return Graze(self._inner.graze())

    def _own_scene(self) -> Scene:
        return self

    def _own_map(self) -> Map:
        return self.map()

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
        return Scene._of(self._inner.scene)

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
        """Expand the local map, with the scene's orders or the cheapest for its tolerance.

        Returns
        -------
        Map
            Local map, which the graze keeps.

        Raises
        ------
        NoResultError
            No map meets the tolerance, or the orbit has none.

        Examples
        --------
        >>> Scene.catalogue("linear").graze().map().orders
        (5, 6)

        """
        return self._mapped

    @cached_property
    def _mapped(self) -> Map:
        """Local map."""
        return Map(self._inner.map())

    def _own_scene(self) -> Scene:
        return self.scene

    def _own_map(self) -> Map:
        return self.map()

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
        """Write the map as source code into a folder.

        Parameters
        ----------
        folder
            Folder, which is made. Files that were not emitted are never replaced.
        target
            Language: ``"rust"``, ``"c"``, ``"python"`` and others.
        measure
            Whether the code states its error, which takes a comparison.

        Returns
        -------
        list of pathlib.Path
            Paths of the files.

        Raises
        ------
        InputError
            Unknown language, or a file that was not emitted.

        Examples
        --------
        >>> import tempfile
        >>> m = Scene.catalogue("linear").graze().map()
        >>> [path.name for path in m.emit(tempfile.mkdtemp(), "python", measure=False)]
        ['map_linear.py']

        """
        _check.choice("target", target, TARGETS)
        names = self._inner.emit(Path(folder), target, measure)
        return [Path(folder) / name for name in names or ()]

    def save(self, path: str | PathLike[str]) -> None:
        """Write the map to a file, which the program accepts in place of a scene."""
        Path(path).write_text(self.to_json(), encoding="utf-8")

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Map:
        """Read a saved map, with the bits that it had."""
        return cls.from_json(Path(path).read_text(encoding="utf-8"))

    def __call__(self, states: ArrayLike, parameters: ArrayLike | None = None) -> Array:
        """Give the images of states.

        Parameters
        ----------
        states
            Offsets of states, shape ``(..., coordinates)``.
        parameters
            Offsets of active parameters: one row for all states, or a row for each (default: 0).

        Returns
        -------
        numpy.ndarray
            Images, of the shape of the states.

        Raises
        ------
        InputError
            Array of a wrong shape.

        Examples
        --------
        >>> m = Scene.catalogue("linear").graze().map()
        >>> m([[1e-6, 0.0], [2e-6, 1e-6]], [1e-7, 0.0]).shape
        (2, 2)

        """
        rows, own, shape = self._points(states, parameters)
        return self._inner.batch(rows, own, False)[:, : shape[-1]].reshape(shape)

    def jacobian(self, states: ArrayLike, parameters: ArrayLike | None = None) -> Array:
        """Give the derivatives of the images.

        Parameters
        ----------
        states, parameters
            Offsets, as of a call of the map.

        Returns
        -------
        numpy.ndarray
            Derivatives, shape ``(..., coordinates, coordinates + parameters)``: the coordinate of
            the image, then the variable, coordinates before parameters.

        Raises
        ------
        InputError
            Array of a wrong shape.

        Examples
        --------
        >>> Scene.catalogue("linear").graze().map().jacobian([0.0, 1e-6]).shape
        (2, 4)

        """
        _, _, derivatives = self._jets(states, parameters)
        return derivatives

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
        method: ImageMethod = "map",
        precision: Precision = "f64",
    ) -> Array:
        """Give the orbits of states.

        Parameters
        ----------
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
        numpy.ndarray
            Iterates, shape ``(..., iterations, coordinates)``, without the states themselves.
            Values after the early end of an orbit are NaN.

        Raises
        ------
        InputError
            Wrong argument; the message names it.
        TooLargeError
            The result exceeds the memory of the machine.

        Examples
        --------
        >>> import numpy as np
        >>> m = Scene.catalogue("linear").graze().map()
        >>> m.iterate(np.zeros((4, 2)), iterations=10).shape
        (4, 10, 2)

        """
        rows, own, shape = self._points(states, parameters)
        check_images(iterations, method, precision)
        orbits = self._inner.orbits(rows, own, iterations, method, precision)
        return orbits.reshape((*shape[:-1], iterations, shape[-1]))

    def _jets(self, states: ArrayLike, parameters: ArrayLike | None) -> tuple[Array, Array, Array]:
        """Give the images, the depths of the passages, and the derivatives of the images."""
        rows, own, shape = self._points(states, parameters)
        passages = self._inner.orders[0]
        found = self._inner.batch(rows, own, True)
        images, depths, derivatives = np.split(found, [shape[-1], shape[-1] + passages], axis=1)
        variables = len(self.coordinates) + len(self.parameters)
        return (
            images.reshape(shape),
            depths.reshape((*shape[:-1], passages)),
            derivatives.reshape((*shape, variables)),
        )

    def _points(
        self, states: ArrayLike, parameters: ArrayLike | None
    ) -> tuple[Array, Array, tuple[int, ...]]:
        """Give states as rows, parameters as one row or one per state, and the states' shape."""
        given = _check.array("states", states)
        width, count = len(self.coordinates), len(self.parameters)
        if given.ndim == 0 or given.shape[-1] != width:
            message = f"states: a state has {width} coordinates ({', '.join(self.coordinates)}), "
            message += "found an "
            message += f"array of shape {given.shape}"
            raise InputError(message)
        rows = np.ascontiguousarray(given.reshape(-1, width))
        own = np.zeros(count) if parameters is None else _check.array("parameters", parameters)
        if own.ndim == 0 or own.shape[-1] != count or own.size not in (count, count * len(rows)):
            message = f"parameters: expected one row of {count} parameters "
            message += f"({', '.join(self.parameters)}) or a row for each of {len(rows)} states, "
            message += f"found an array of shape {own.shape}"
            raise InputError(message)
        return rows, np.ascontiguousarray(own.reshape(-1, count)), given.shape

    def _own_scene(self) -> Scene:
        return self.graze.scene

    def _own_map(self) -> Map:
        return self

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


def scenes() -> list[str]:
    """List the names of the scenes of the catalogue.

    Returns
    -------
    list of str
        Names, which :meth:`Scene.catalogue` takes.

    Examples
    --------
    >>> "mems" in scenes()
    True

    """
    return _lib.catalogue()


@overload
def catalogue() -> list[str]: ...


@overload
def catalogue(name: str) -> Scene: ...


def catalogue(name: str | None = None) -> list[str] | Scene:
    """Give a scene of the catalogue or all names: :meth:`Scene.catalogue`, :func:`scenes`."""
    return scenes() if name is None else Scene.catalogue(name)


def _portrait(graze: _lib.Graze) -> str:
    """Draw the phase portrait of a grazing orbit."""
    found = _lib.answer(graze, json.dumps({"trajectory": {"samples": SAMPLES}}), None, [])
    return next((figure for _, figure in found.figures()), "")


def _words(value: object, *lines: str) -> str:
    """Write the representation of a value, and lines of text, as HTML."""
    return f"<pre>{html.escape(chr(10).join([repr(value), *lines]))}</pre>"


def _overrides(values: Mapping[str, object]) -> list[tuple[str, str]]:
    """Give values as TOML, by key."""
    return [(key, _override(key, item)) for key, item in values.items()]


def _override(key: str, item: object) -> str:
    """Give the value of a key as TOML."""
    try:
        return _toml.value(item)
    except TypeError as fault:
        message = f"{key}: {fault}"
        raise InputError(message) from None
