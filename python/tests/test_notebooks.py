"""The notebooks run as they stand: cells of Python text, which Jupyter and editors open."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

import grazemap as gm

FOLDER = Path(__file__).parents[1] / "notebooks"


def cells(path: Path) -> list[tuple[int, str]]:
    """Give the cells of code, each with its first line."""
    found: list[tuple[int, list[str]]] = []
    code = False
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if line.startswith("# %%"):
            code = "[markdown]" not in line
            if code:
                found.append((number, []))
        elif code:
            found[-1][1].append(line)
    return [(first, "\n".join(lines)) for first, lines in found]


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_a_notebook_runs(path: Path) -> None:
    if path.stem == "solve_ivp":
        pytest.importorskip("scipy")
    mpl = pytest.importorskip("matplotlib")
    plt = pytest.importorskip("matplotlib.pyplot")
    mpl.use("agg")
    names: dict[str, object] = {"__name__": path.stem}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", gm.GrazemapNote)
        for first, code in cells(path):
            # Line numbers of a fault are those of the file.
            exec(compile("\n" * first + code, path, "exec"), names)  # noqa: S102
            # A notebook shows the figures of a cell, and draws them for that.
            for number in plt.get_fignums():
                plt.figure(number).canvas.draw()
            plt.close("all")
