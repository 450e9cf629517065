"""What the package raises."""

from __future__ import annotations


class GrazemapError(Exception):
    """Any error of the package."""


class SceneError(GrazemapError, ValueError):
    """A scene with a fault.

    Attributes
    ----------
    file
        Name of the file, as it was given.
    line, column
        Place of the fault, both from 1, columns in characters; ``None`` where it has none.

    """

    def __init__(self, message: str, file: str, line: int | None, column: int | None) -> None:
        """Say what is wrong and where."""
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
    """Results that the machine has no memory for; nothing was computed."""


class NoResult(GrazemapError):  # noqa: N818
    """The input was right, and the mathematics ended without what was asked for."""
