from collections.abc import Callable
from os import PathLike
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

_Array: TypeAlias = NDArray[np.float64]
_Progress: TypeAlias = Callable[[int, int], object] | None
_Overrides: TypeAlias = list[tuple[str, str]]

def catalogue() -> list[str]: ...
def program(arguments: list[str]) -> int: ...
def words() -> tuple[list[str], list[str], list[str]]: ...
def draw(
    m: Map,
    tables: str,
    progress: _Progress = None,
    shares: list[bytes] = ...,
    device: str = "cpu",
) -> Computed: ...
def draw_share(m: Map, tables: str, device: str, number: int, of: int) -> bytes: ...
def answer(
    source: Scene | Graze | Map | None,
    command: str,
    progress: _Progress = None,
    shares: list[bytes] = ...,
) -> Computed: ...
def answer_share(source: Scene | Graze | Map, command: str, number: int, of: int) -> bytes: ...
def fit(
    m: Map,
    keys: str,
    lengths: list[int],
    points: _Array,
    controls: _Array,
    progress: _Progress = None,
) -> Computed: ...
def report(
    source: Scene | Graze | Map, folder: str | PathLike[str], progress: _Progress = None
) -> str: ...

class Computed:
    document: str
    figures: list[tuple[str, str]]
    remarks: list[str]
    ended: str | None
    def columns(self) -> dict[str, _Array | tuple[NDArray[np.int32], list[str]]]: ...

class Scene:
    text: str
    file_name: str
    name: str
    digest: str
    states: list[str]
    parameters: list[tuple[str, float]]
    active: list[str]
    warnings: list[str]
    @staticmethod
    def load(path: str | PathLike[str], overrides: _Overrides) -> Scene: ...
    @staticmethod
    def parse(text: str, name: str, overrides: _Overrides) -> Scene: ...
    @staticmethod
    def catalogue_text(name: str) -> str | None: ...
    def graze(self) -> Graze: ...

class Graze:
    scene: Scene
    @staticmethod
    def from_json(text: str) -> Graze: ...
    def to_json(self) -> str: ...
    def verdict(self) -> list[str]: ...
    def map(self) -> Map: ...

class Map:
    graze: Graze
    coordinates: list[str]
    parameters: list[str]
    orders: tuple[int, int, int]
    window: tuple[float, list[float], list[float]]
    errors: list[float | None]
    @staticmethod
    def from_json(text: str) -> Map: ...
    def to_json(self) -> str: ...
    def emit(self, folder: str | PathLike[str], target: str, measure: bool) -> list[str] | None: ...
    def polynomials(self) -> Computed: ...
    def batch(self, states: _Array, parameters: _Array, derivatives: bool) -> _Array: ...
    def inside(self, states: _Array, parameters: _Array) -> NDArray[np.bool_]: ...
    def orbits(
        self, states: _Array, parameters: _Array, iterations: int, using: str, precision: str
    ) -> _Array: ...
    def image(
        self, states: _Array, parameters: _Array, iterations: int, using: str, precision: str
    ) -> Computed: ...
