"""Local maps of oscillators that graze a stop.

A :class:`Scene` describes an impact oscillator, :meth:`Scene.graze` finds the orbit that just
touches the stop, and :meth:`Graze.map` expands the Poincaré map near it:

>>> import grazemap as gm
>>> m = gm.Scene.catalogue("linear").graze().map()
>>> m.coordinates, m.parameters
(('x', 'theta'), ('alpha', 'omega'))
>>> diagram = m.diagram("alpha", (-1e-4, 1e-4), points=20)

Every command of the program is a method of scenes, grazes and maps, and a function of the package
that takes one of them first. Missing steps are computed.
"""

from typing import TYPE_CHECKING

# Modules that need an extra are not in `__all__`: their names are those of the libraries.
from . import jax as jax
from . import torch as torch
from ._commands import (
    basin,
    branch,
    chart,
    contact,
    converge,
    curve,
    derivatives,
    diagram,
    fit,
    gallery,
    image,
    loci,
    nearest,
    noise,
    orbits,
    report,
    safe,
    trajectory,
)
from ._errors import (
    GrazemapError,
    GrazemapNote,
    GrazemapWarning,
    InputError,
    NoResult,
    NoResultError,
    SceneError,
    TooLargeError,
)
from ._model import Compliant, Phase, Rigid
from ._pipeline import Graze, Map, Scene, catalogue, scenes
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
    StableRange,
    Study,
    Table,
    Trajectory,
)

if TYPE_CHECKING:
    #: Version of the package.
    __version__: str


def __getattr__(name: str) -> str:
    """Give the version, which is looked up when it is asked for."""
    if name == "__version__":
        from ._version import version

        return version()
    message = f"module {__name__!r} has no attribute {name!r}"
    raise AttributeError(message)


__all__ = [
    "Basin",
    "Branch",
    "Chart",
    "Compliant",
    "Curve",
    "Derivatives",
    "Diagram",
    "Fit",
    "Gallery",
    "Graze",
    "GrazemapError",
    "GrazemapNote",
    "GrazemapWarning",
    "Image",
    "InputError",
    "Loci",
    "Map",
    "Nearest",
    "NoResult",
    "NoResultError",
    "Noise",
    "Orbits",
    "Phase",
    "Rigid",
    "Safety",
    "Scene",
    "SceneError",
    "SoftStops",
    "StableRange",
    "Study",
    "Table",
    "TooLargeError",
    "Trajectory",
    "__version__",
    "basin",
    "branch",
    "catalogue",
    "chart",
    "contact",
    "converge",
    "curve",
    "derivatives",
    "diagram",
    "fit",
    "gallery",
    "image",
    "loci",
    "nearest",
    "noise",
    "orbits",
    "report",
    "safe",
    "scenes",
    "trajectory",
]
