"""Exceptions of the package."""

from __future__ import annotations


class GrazemapError(Exception):
    """Any error of the package."""


class SceneError(GrazemapError, ValueError):
    """Fault in a scene.

    Attributes
    ----------
    file
        Name of the file, as it was given.
    line, column
        Place of the fault, both from 1, columns in characters; ``None`` without a place.

    """

    def __init__(self, message: str, file: str, line: int | None, column: int | None) -> None:
        """Keep the message and the place of the fault."""
        super().__init__(message)
        self.file = file
        self.line = line
        self.column = column

    def __reduce__(self) -> tuple[type[SceneError], tuple[str, str, int | None, int | None]]:
        """Keep the place when the error goes to another process."""
        return type(self), (str(self), self.file, self.line, self.column)


class InputError(GrazemapError, ValueError):
    """Wrong input: the message says what was expected."""


class TooLargeError(InputError, MemoryError):
    """Results that exceed the machine's memory; nothing was computed."""


class NoResult(GrazemapError):  # noqa: N818
    """No result (no grazing orbit, for example), although the input was right."""
