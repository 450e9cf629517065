"""The notebooks run as they stand: cells of Python text, which Jupyter and editors open.

`UPDATE_GENERATED=1` writes their pages in the documentation anew, with what they print and draw.
"""

from __future__ import annotations

import ast
import contextlib
import io
import os
import re
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import grazemap as gm

if TYPE_CHECKING:
    from collections.abc import Iterator

FOLDER = Path(__file__).parents[1] / "notebooks"
PAGES = Path(__file__).parents[2] / "docs" / "notebooks"

HEAD = """\
<!-- @generated from python/notebooks/{name}.py; written anew by
     `UPDATE_GENERATED=1 pytest tests/test_notebooks.py` and checked without it. -->

"""


@dataclass
class Cell:
    """Cell of a notebook: text, or code with what it prints and draws."""

    first: int
    is_code: bool
    lines: list[str] = field(default_factory=list)
    printed: str = ""
    pictures: list[bytes] = field(default_factory=list)

    @property
    def text(self) -> str:
        """Lines of code, or Markdown."""
        lines = self.lines if self.is_code else [line.removeprefix("# ") for line in self.lines]
        return "\n".join("" if line == "#" else line for line in lines).strip("\n")


def cells(path: Path) -> list[Cell]:
    """Give the cells, each with the number of its first line."""
    found: list[Cell] = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        if line.startswith("# %%"):
            found.append(Cell(number, "[markdown]" not in line))
        else:
            found[-1].lines.append(line)
    return found


def run(cell: Cell, path: Path, names: dict[str, object], plt: Any) -> None:
    """Run a cell of code. The value of its last expression is shown, as in a notebook."""
    # Line numbers of a fault are those of the file.
    tree = ast.parse("\n" * cell.first + "\n".join(cell.lines), path)
    last = tree.body[-1]
    shown = ast.Expression(last.value) if isinstance(last, ast.Expr) else None
    tree.body = tree.body[:-1] if shown else tree.body
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, path, "exec"), names)  # noqa: S102
        value = eval(compile(shown, path, "eval"), names) if shown else None  # noqa: S307
        if value is not None and not type(value).__module__.startswith("matplotlib"):
            print(repr(value))  # noqa: T201
    cell.printed = printed.getvalue()
    for number in plt.get_fignums():
        picture = io.BytesIO()
        plt.figure(number).savefig(picture, format="png", dpi=110, bbox_inches="tight")
        cell.pictures.append(picture.getvalue())
    plt.close("all")


def page(name: str, notebook: list[Cell]) -> tuple[str, dict[str, bytes]]:
    """Write the page of a notebook that was run, and its pictures by name."""
    parts: list[str] = []
    pictures: dict[str, bytes] = {}
    told = ""
    for cell in notebook:
        if not cell.is_code:
            told = cell.text.rpartition("\n\n")[2]
            parts.append(cell.text)
            continue
        parts.append(f"```python\n{cell.text}\n```")
        if cell.printed:
            # Times are those of one machine.
            printed = re.sub(r"[\d.]+ ms\b", "... ms", cell.printed.rstrip())
            parts.append(f"```text\n{printed}\n```")
        for picture in cell.pictures:
            file = f"{name}-{len(pictures) + 1}.png"
            pictures[file] = picture
            sentence = " ".join(told.split()).partition(". ")[0].rstrip(".")
            parts.append(f"![{sentence}](images/{file})")
    return HEAD.format(name=name) + "\n\n".join(parts) + "\n", pictures


def words(text: str) -> Iterator[str]:
    """Give the lines of a page. Numbers that were computed are left out: last digits may differ."""
    is_output = False
    for line in text.splitlines():
        if line.startswith("```"):
            is_output = line == "```text"
        plain = re.sub(r"[-+]?\d[\d.]*(e[-+]?\d+)?", "#", line)
        yield " ".join(plain.split()) if is_output else line


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_a_notebook_runs_and_its_page_is_current(path: Path) -> None:
    if path.stem == "solve_ivp":
        pytest.importorskip("scipy")
    mpl = pytest.importorskip("matplotlib")
    plt = pytest.importorskip("matplotlib.pyplot")
    mpl.use("agg")
    notebook = cells(path)
    names: dict[str, object] = {"__name__": path.stem}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", gm.GrazemapNote)
        for cell in notebook:
            if cell.is_code:
                run(cell, path, names, plt)
    text, pictures = page(path.stem, notebook)
    written = PAGES / f"{path.stem}.md"
    if os.environ.get("UPDATE_GENERATED"):
        (PAGES / "images").mkdir(parents=True, exist_ok=True)
        written.write_text(text, encoding="utf-8")
        for file, picture in pictures.items():
            (PAGES / "images" / file).write_bytes(picture)
    assert list(words(written.read_text(encoding="utf-8"))) == list(words(text))
    assert all((PAGES / "images" / file).is_file() for file in pictures)
