"""Progress of long computations."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

from ._errors import InputError

#: Function called with the units of work done and expected (0 if unknown).
Progress: TypeAlias = Callable[[int, int], object]


@contextmanager
def shown(progress: Progress | bool | None, what: str) -> Iterator[Progress | None]:
    """Give the progress function of a computation: a tqdm bar for ``True``, if installed."""
    if progress is not None and not isinstance(progress, bool) and not callable(progress):
        message = f"progress: expected a truth value or a function, found {progress!r}"
        raise InputError(message)
    if progress is not True:
        yield progress or None
        return
    try:
        from tqdm.auto import tqdm
    except ImportError:
        sys.stderr.write(f"{what}: no progress is shown without tqdm\n")
        yield None
        return
    with tqdm(desc=what) as bar:

        def show(done: int, expected: int) -> None:
            bar.total = expected or None
            bar.update(done - bar.n)

        yield show
