"""The API page of the documentation is that of the docstrings.

`UPDATE_GENERATED=1` writes it anew.
"""

from __future__ import annotations

import inspect
import os
import re
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import grazemap as gm

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import ModuleType

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "python-api.md"

HEAD = """\
<!-- @generated from the docstrings of python/python/grazemap; written anew by
     `UPDATE_GENERATED=1 pytest tests/test_api_page.py` and checked without it. -->

# Python: every name

The [guide](python.md) says how they go together; `import grazemap as gm`. Every command is a
method of `Scene`, `Graze` and `Map` as well: `m.diagram(...)` is `gm.diagram(m, ...)`."""

#: Names that are taken for older programs.
OLDER = ("NoResult", "catalogue")
NAMES = [name for name in gm.__all__ if name not in OLDER]
COMMANDS = [name for name in NAMES if inspect.isfunction(getattr(gm, name))]
CLASSES = [name for name in NAMES if inspect.isclass(getattr(gm, name))]
MODEL = ["Scene", "Rigid", "Compliant", "Phase", "Graze", "Map"]
RAISED = [name for name in CLASSES if issubclass(getattr(gm, name), Exception)]
RESULTS = [name for name in CLASSES if name not in (*MODEL, *RAISED)]

#: Modules that need an extra.
MODULES = [gm.jax, gm.torch]


def page() -> str:
    """Write the page."""
    parts = [HEAD, "## Scenes, grazes and maps"]
    parts += [text for name in MODEL for text in of_class(name)]
    parts += ["## Commands", *(of_function(f"gm.{name}", getattr(gm, name)) for name in COMMANDS)]
    parts += [text for module in MODULES for text in of_module(module)]
    parts += ["## Results", *(text for name in RESULTS for text in of_class(name))]
    parts += ["## Errors and warnings", "| name | raised or warned of |\n|---|---|"]
    lines = [f"| `gm.{name}` | {first_line(getattr(gm, name))} |" for name in RAISED]
    parts[-1] += "\n" + "\n".join(lines)
    return "\n\n".join(parts) + "\n"


def of_module(module: ModuleType) -> Iterator[str]:
    """Describe a module: its docstring, its functions."""
    short = module.__name__.removeprefix("grazemap.")
    yield f"## {module.__name__}"
    yield body(module)
    for name in module.__all__:
        yield of_function(f"gm.{short}.{name}", getattr(module, name))


def of_class(name: str) -> Iterator[str]:
    """Describe a class: its docstring, its attributes, its own methods."""
    kind = getattr(gm, name)
    yield f"### gm.{name}"
    if "Parameters" in (inspect.getdoc(kind) or ""):
        yield signature(f"gm.{name}", kind)
    yield body(kind)
    own = {key: value for key, value in vars(kind).items() if shown(key)}
    attributes = [
        f"| `{key}` | {first_line(value)} |"
        for key, value in own.items()
        if isinstance(value, (property, cached_property)) and value.__doc__
    ]
    if attributes:
        yield "| attribute | is |\n|---|---|\n" + "\n".join(attributes)
    for key, value in own.items():
        function = value.__func__ if isinstance(value, classmethod) else value
        is_shown = inspect.isfunction(function) and name not in ("Rigid", "Compliant")
        if is_shown and function.__name__ == key:
            prefix = f"gm.{name}" if isinstance(value, classmethod) else name.lower()
            called = prefix if key == "__call__" else f"{prefix}.{key}"
            yield of_function(called, function, is_method=True)


def shown(name: str) -> bool:
    """Tell whether an attribute is one that users name or call."""
    return not name.startswith("_") or name == "__call__"


def of_function(name: str, function: Callable[..., Any], *, is_method: bool = False) -> str:
    """Describe a function; of a method the first argument is left out."""
    heading = "####" if is_method else "###"
    return (
        f"{heading} {name}\n\n{signature(name, function, is_method=is_method)}\n\n{body(function)}"
    )


def signature(name: str, function: Any, *, is_method: bool = False) -> str:
    """Write a signature, an argument a line if it is long."""
    given = inspect.signature(function)
    parameters = list(given.parameters.values())[is_method:]
    words = []
    for parameter in parameters:
        if parameter.kind is parameter.KEYWORD_ONLY and "*" not in words:
            words.append("*")
        default = parameter.default
        shown = "" if default is parameter.empty else f" = {default!r}"
        stars = "**" if parameter.kind is parameter.VAR_KEYWORD else ""
        words.append(f"{stars}{parameter.name}: {parameter.annotation}{shown}")
    result = "" if given.return_annotation in (given.empty, "None") else given.return_annotation
    arrow = f" -> {result}" if result and not inspect.isclass(function) else ""
    one = f"{name}({', '.join(words)}){arrow}"
    several = f"{name}(\n" + "".join(f"    {word},\n" for word in words) + f"){arrow}"
    return f"```python\n{one if len(one) <= 100 else several}\n```"


def body(thing: Any) -> str:
    """Write a docstring in Markdown."""
    first, *sections = re.split(r"^(\w+)\n-+\n", inspect.getdoc(thing) or "", flags=re.MULTILINE)
    parts = [plain(first)]
    for title, text in zip(sections[::2], sections[1::2], strict=True):
        if title == "Examples":
            code = text.strip().replace("  # doctest: +SKIP", "")
            parts.append(f"```python\n{code}\n```")
        elif title == "Notes":
            parts.append(plain(text))
        else:
            entries = re.split(r"^(?=\S)", text.strip(), flags=re.MULTILINE)[1:]
            parts.append(f"{title}:\n\n" + "\n".join(entry(one) for one in entries))
    return "\n\n".join(parts)


def entry(text: str) -> str:
    """Write an entry of a section as one of a list."""
    name, _, words = text.partition("\n")
    return f"- `{name}`: {plain(' '.join(words.split()))}"


def first_line(thing: Any) -> str:
    """Give the first line of a docstring."""
    return plain((thing.__doc__ or "").strip().partition("\n")[0]).replace("|", "\\|")


def plain(text: str) -> str:
    """Write inline markup of docstrings in Markdown, without doctests."""
    text = re.sub(r"(\n\n>>>.*)", "", text, flags=re.DOTALL)
    text = re.sub(r":\w+:`~?([^`]+)`", r"`\1`", text)
    return text.replace("``", "`").strip()


def test_the_page_is_that_of_the_docstrings() -> None:
    written = page()
    if os.environ.get("UPDATE_GENERATED"):
        PAGE.write_text(written, encoding="utf-8")
    assert PAGE.read_text(encoding="utf-8") == written
