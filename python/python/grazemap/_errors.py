"""Exceptions of the package."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._table import Table


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

    @property
    def words(self) -> str:
        """Message without the place of the fault."""
        return re.sub(r"^.*?:\d+:\d+: ", "", str(self))

    def __reduce__(self) -> tuple[type[SceneError], tuple[str, str, int | None, int | None]]:
        """Keep the place when the error goes to another process."""
        return type(self), (str(self), self.file, self.line, self.column)


class InputError(GrazemapError, ValueError):
    """Wrong input: the message says what was expected."""


class TooLargeError(InputError, MemoryError):
    """Results that exceed the machine's memory; nothing was computed."""


class NoResultError(GrazemapError):
    """No result (no grazing orbit, no branch), although the input was right.

    Attributes
    ----------
    result
        Empty table with its document, remarks and figures; ``None`` if there is none.

    """

    def __init__(self, message: str, result: Table | None = None) -> None:
        """Keep the reason and the empty result."""
        super().__init__(message)
        self.result = result


#: Older name of :class:`NoResultError`.
NoResult = NoResultError


class GrazemapWarning(UserWarning):
    """Remark on the accuracy or completeness of a result."""


class GrazemapNote(GrazemapWarning):
    """Remark of lesser weight, which the program prints as a note."""
