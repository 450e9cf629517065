"""Remarks on results as warnings of Python."""

from __future__ import annotations

import os
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from ._errors import GrazemapNote, GrazemapWarning

if TYPE_CHECKING:
    from collections.abc import Iterable

#: Folder of the package: a warning belongs to the first caller outside of it.
_PACKAGE = str(Path(__file__).parent) + os.sep


def warn(remarks: Iterable[str]) -> None:
    """Warn of every remark at the line that called the package.

    >>> with warnings.catch_warnings(record=True) as seen:
    ...     warnings.simplefilter("always")
    ...     warn(["note: a", "warning: b"])
    >>> [(type(one.message).__name__, str(one.message)) for one in seen]
    [('GrazemapNote', 'a'), ('GrazemapWarning', 'b')]
    """
    for remark in remarks:
        kind, separator, words = remark.partition(": ")
        category = GrazemapNote if kind == "note" else GrazemapWarning
        plain = words if separator and kind in ("note", "warning") else remark
        warnings.warn(plain, category, stacklevel=_depth())


def _depth() -> int:
    """Count the frames of the package above the caller of this function."""
    depth = 1
    frame = sys._getframe(1)
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        frame = frame.f_back
        depth += 1
    return depth
