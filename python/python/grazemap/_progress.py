"""Progress of long computations."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

#: Called with the units of work that are done and that are expected (0 where not known).
Progress: TypeAlias = Callable[[int, int], object]


@contextmanager
def shown(progress: Progress | bool | None, what: str) -> Iterator[Progress | None]:
    """Give what a computation is to call: a bar of tqdm for ``True``, where there is tqdm."""
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
