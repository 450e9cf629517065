"""Computations in shares on the workers of a cluster.

A share is defined by the text of the computation and a number, so that any worker can compute it
again if another one dies.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

from ._errors import InputError
from ._version import version

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

#: Number of shares per thread of a cluster; several, so that a fast worker can take more.
SHARES = 4


class Client(Protocol):
    """Interface of a Dask client: :class:`distributed.Client`, or a class like it."""

    def nthreads(self) -> Mapping[str, int]:
        """Give the number of threads of every worker."""

    def submit(self, function: Callable[..., Any], *args: Any, **options: Any) -> Any:
        """Begin a call on a worker."""

    def gather(self, futures: Sequence[Any]) -> Any:
        """Wait for the results of calls."""


def shares(client: Client | None, find: Callable[..., bytes], *what: object) -> list[bytes]:
    """Compute all shares of a computation on the workers of a client; give their pieces.

    ``find`` is called as ``find(*what, number, of)``, with the share's number from 1. Without a
    client the list is empty, and the caller computes everything.
    """
    if client is None:
        return []
    if not all(hasattr(client, name) for name in ("nthreads", "submit", "gather")):
        message = f"client: expected a Dask client, found {client!r}"
        raise InputError(message)
    of = SHARES * max(1, sum(client.nthreads().values()))
    futures = [
        client.submit(_found, version(), find, *what, number, of, pure=False)
        for number in range(1, of + 1)
    ]
    return list(client.gather(futures))


def _found(expected: str, find: Callable[..., bytes], *what: object) -> bytes:
    """Compute a share, on a worker."""
    if version() != expected:
        message = f"the worker has grazemap {version()}, its client {expected}; install the same"
        raise InputError(message)
    return find(*what)
