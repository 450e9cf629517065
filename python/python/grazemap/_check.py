"""Checks of arguments. An error names the argument and says what was expected."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ._errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

#: First number beyond all counts.
_MOST = 2**32


def meant(name: str, known: Iterable[str]) -> str:
    """Give the hint that names the nearest known name; empty if none is near.

    >>> meant("linaer", ["linear", "mems"])
    ' (did you mean `linear`?)'
    """
    near = difflib.get_close_matches(name, list(known), 1, 0.6)
    return f" (did you mean `{near[0]}`?)" if near else ""


def choice(argument: str, value: str, known: Sequence[str]) -> str:
    """Accept one of the known words."""
    if not isinstance(value, str) or value not in known:
        hint = meant(value, known) if isinstance(value, str) else ""
        message = f"{argument} is one of {', '.join(known)}, found {value!r}{hint}"
        raise InputError(message)
    return value


def choices(argument: str, value: str | Iterable[str], known: Sequence[str]) -> list[str]:
    """Accept one of the known words, or several."""
    return [choice(argument, word, known) for word in texts(argument, value)]


def texts(argument: str, value: str | Iterable[str]) -> list[str]:
    """Give a list of texts; a single text is a list of one.

    >>> texts("itineraries", "10")
    ['10']
    """
    if isinstance(value, str):
        return [value]
    found = list(value) if isinstance(value, Iterable) else [value]
    if not all(isinstance(text, str) for text in found):
        message = f"{argument}: expected a text or a list of texts, found {value!r}"
        raise InputError(message)
    return [str(text) for text in found]


def text(argument: str, value: str) -> str:
    """Accept one text."""
    if not isinstance(value, str):
        message = f"{argument}: expected a text, found {value!r}"
        raise InputError(message)
    return value


def names(
    argument: str, value: str | Iterable[str], known: Iterable[str], kind: str = "active parameter"
) -> list[str]:
    """Accept known names, one or several."""
    found, known = texts(argument, value), list(known)
    for name in found:
        if name not in known:
            message = f"{argument}: no {kind} `{name}`{meant(name, known)}; "
            raise InputError(message + f"expected one of {', '.join(known) or 'none'}")
    return found


def pair(argument: str, value: Iterable[str], known: Iterable[str], kind: str) -> list[str]:
    """Accept two known names."""
    found = names(argument, value, known, kind)
    if len(set(found)) != 2:  # noqa: PLR2004
        message = f"{argument}: expected two different names, found {value!r}"
        raise InputError(message)
    return found


def count(argument: str, value: Any, least: int = 0, most: int = _MOST - 1) -> int:
    """Accept a whole number of a range."""
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not whole or not least <= value <= most:
        message = f"{argument}: expected a whole number from {least} to {most}, found {value!r}"
        raise InputError(message)
    return int(value)


def counts(argument: str, value: Any, least: int, most: int) -> int | list[int]:
    """Accept a whole number, or two: one for each axis."""
    if not isinstance(value, Iterable):
        return count(argument, value, least, most)
    found = [count(argument, one, least, most) for one in value]
    if len(found) != 2:  # noqa: PLR2004
        message = f"{argument}: expected a whole number or two, found {value!r}"
        raise InputError(message)
    return found


def number(argument: str, value: Any) -> float:
    """Accept a finite number."""
    real = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if not real or not math.isfinite(value):
        message = f"{argument}: expected a finite number, found {value!r}"
        raise InputError(message)
    return float(value)


def span(argument: str, value: Any, *, is_open: bool = False) -> list[float | None]:
    """Accept the first and the last number of a range; of an open one either may be ``None``."""
    found = list(value) if isinstance(value, Iterable) and not isinstance(value, str) else []
    if len(found) != 2:  # noqa: PLR2004
        message = f"{argument}: expected two numbers, the first and the last, found {value!r}"
        raise InputError(message)
    first, last = (None if is_open and end is None else number(argument, end) for end in found)
    return [first, last]


def rising(argument: str, value: Any, *, is_open: bool = False) -> list[float | None]:
    """Accept two numbers, the first one smaller; of an open range either may be ``None``."""
    first, last = span(argument, value, is_open=is_open)
    if first is not None and last is not None and first >= last:
        message = f"{argument}: expected a smaller number and a larger one, found {value!r}"
        raise InputError(message)
    return [first, last]


def spans(argument: str, value: Any) -> list[list[float | None]]:
    """Accept two ranges, one for each axis."""
    found = list(value) if isinstance(value, Iterable) and not isinstance(value, str) else []
    if len(found) != 2:  # noqa: PLR2004
        message = f"{argument}: expected two ranges, one for each axis, found {value!r}"
        raise InputError(message)
    return [rising(f"{argument}[{place}]", one) for place, one in enumerate(found)]


def mapping(argument: str, value: Any) -> dict[Any, Any]:
    """Accept values by name."""
    if not isinstance(value, Mapping):
        message = f"{argument}: expected numbers by name, such as {{'alpha': 1e-5}}, "
        raise InputError(message + f"found {value!r}")
    return dict(value)


def flag(argument: str, value: Any) -> bool:
    """Accept a truth value."""
    if not isinstance(value, (bool, np.bool_, int)):
        message = f"{argument}: expected True or False, found {value!r}"
        raise InputError(message)
    return bool(value)


def numbers(
    argument: str,
    value: Any,
    known: Iterable[str] | None = None,
    kind: str = "active parameter",
) -> dict[str, float]:
    """Accept finite numbers by name."""
    named = mapping(argument, value)
    if known is not None:
        names(argument, named, known, kind)
    return {str(name): number(f"{argument}[{name!r}]", one) for name, one in named.items()}


def list_of_numbers(
    argument: str,
    value: Any,
    known: Iterable[str] | None = None,
    kind: str = "coordinate of the section",
) -> list[dict[str, float]]:
    """Accept numbers by name once or several times."""
    several = [value] if isinstance(value, Mapping) else value
    if not isinstance(several, Iterable):
        several = [value]
    return [numbers(argument, one, known, kind) for one in several]


def array(argument: str, values: ArrayLike) -> NDArray[np.float64]:
    """Accept an array of numbers."""
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as fault:
        message = f"{argument}: expected an array of numbers ({fault})"
        raise InputError(message) from None


def items(argument: str, value: Any) -> list[Any]:
    """Accept a list, or anything that can be iterated."""
    if not isinstance(value, Iterable) or isinstance(value, str):
        message = f"{argument}: expected a list, found {value!r}"
        raise InputError(message)
    return list(value)


def given(check: Callable[..., Any], argument: str, value: Any, *more: Any) -> Any:
    """Check an argument unless it is ``None``."""
    return None if value is None else check(argument, value, *more)
