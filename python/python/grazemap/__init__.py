"""Local maps of oscillators that graze a stop.

A :class:`Scene` describes an impact oscillator, :meth:`Scene.graze` finds the orbit that just
touches the stop, and :meth:`Graze.map` expands the Poincaré map near it:

>>> import grazemap as gm
>>> m = gm.Scene.catalogue("linear").graze().map()
>>> m.coordinates, m.parameters
(('x', 'theta'), ('alpha', 'omega'))
>>> diagram = gm.diagram(m, "alpha", (-1e-4, 1e-4), points=20, method="guarded")
"""

from ._commands import (
    basin,
    branch,
    chart,
    converge,
    curve,
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
from ._errors import GrazemapError, InputError, NoResult, SceneError, TooLargeError
from ._pipeline import Graze, Map, Scene, catalogue
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
    Table,
    Trajectory,
)

__all__ = [
    "Basin",
    "Branch",
    "Chart",
    "Curve",
    "Diagram",
    "Fit",
    "Gallery",
    "Graze",
    "GrazemapError",
    "Image",
    "InputError",
    "Loci",
    "Map",
    "Nearest",
    "NoResult",
    "Noise",
    "Orbits",
    "Safety",
    "Scene",
    "SceneError",
    "Study",
    "Table",
    "TooLargeError",
    "Trajectory",
    "basin",
    "branch",
    "catalogue",
    "chart",
    "converge",
    "curve",
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
    "trajectory",
]
