"""Older names of arguments."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, ParamSpec, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

P = ParamSpec("P")
R = TypeVar("R")


def older(**names: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Accept older names of arguments too.

    >>> @older(using="method")
    ... def chosen(method: str = "map") -> str:
    ...     return method
    >>> chosen(**{"using": "direct"})
    'direct'
    """

    def decorated(function: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(function)
        def called(*args: P.args, **kwargs: P.kwargs) -> R:
            for old, new in names.items():
                if old in kwargs:
                    if new in kwargs:
                        message = f"{function.__name__}() got `{new}` and its older name `{old}`"
                        raise TypeError(message)
                    kwargs[new] = kwargs.pop(old)
            return function(*args, **kwargs)

        return called

    return decorated
