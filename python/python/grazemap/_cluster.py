"""Computations in shares on the workers of a cluster.

A share is a text that says what is computed, and its number: a worker that dies takes nothing along
that another cannot compute again.
"""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any, Protocol

from ._errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

#: Shares for every thread of a cluster: as many as let a fast worker take more than a slow one.
SHARES = 4


class Client(Protocol):
    """What is asked of a client of Dask: :class:`distributed.Client`, or one made like it."""

    def nthreads(self) -> Mapping[str, int]:
        """Give the threads of every worker."""

    def submit(self, function: Callable[..., Any], *args: Any, **options: Any) -> Any:
        """Begin a call on a worker."""

    def gather(self, futures: Sequence[Any]) -> Any:
        """Wait for the results of calls."""


def shares(client: Client | None, find: Callable[..., bytes], *what: object) -> list[bytes]:
    """Give what all shares of a computation find on the workers of a client.

    ``find`` is called as ``find(*what, number, of)``, with the share's number from 1. Without a
    client nothing is found, and all is left to the caller.
    """
    if client is None:
        return []
    of = SHARES * max(1, sum(client.nthreads().values()))
    futures = [
        client.submit(_found, _version(), find, *what, number, of, pure=False)
        for number in range(1, of + 1)
    ]
    return list(client.gather(futures))


def _found(expected: str, find: Callable[..., bytes], *what: object) -> bytes:
    """Find a share, on a worker."""
    if _version() != expected:
        message = f"the worker has grazemap {_version()}, its client {expected}; install the same"
        raise InputError(message)
    return find(*what)


def _version() -> str:
    try:
        return version("grazemap")
    except PackageNotFoundError:  # a checkout that is not installed
        return "unknown"
