"""Values as TOML text."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping

import numpy as np


def value(item: object) -> str:
    """Write one value.

    >>> value([1e-5, {"x": True}])
    '[1e-05, { x = true }]'
    """
    if isinstance(item, np.generic):
        item = item.item()
    if isinstance(item, bool):
        return "true" if item else "false"
    if isinstance(item, (int, float)):
        return repr(item)
    if isinstance(item, str):
        return json.dumps(item, ensure_ascii=False)
    if isinstance(item, Mapping):
        return "{ " + ", ".join(f"{key} = {value(held)}" for key, held in item.items()) + " }"
    if isinstance(item, Iterable):
        return "[" + ", ".join(value(held) for held in item) + "]"
    message = f"expected a number, text, list or mapping, found {type(item).__name__}"
    raise TypeError(message)


def table(kind: str, entries: Mapping[str, object]) -> str:
    """Write one table of a list of tables; entries that are `None` are omitted."""
    lines = [f"{key} = {value(item)}" for key, item in entries.items() if item is not None]
    return "\n".join([f"[[{kind}]]", *lines, ""])
