"""The program that is compiled into the module is the program."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = os.environ.get("GRAZEMAP_PROGRAM")


def run(*command: str) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(command, capture_output=True, check=False)


@pytest.mark.skipif(PROGRAM is None, reason="GRAZEMAP_PROGRAM names no program")
@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["locate", "linear", "--json", "-"], 0),
        (["--version"], 0),
        (["locate", "linear", "--set", "alpha=x"], 2),
        (["locate", "nothing"], 2),
        (["paint"], 2),
    ],
)
def test_the_module_runs_the_program(arguments: list[str], code: int) -> None:
    own = run(sys.executable, "-m", "grazemap", *arguments)
    of_program = run(str(PROGRAM), *arguments)
    assert own.returncode == of_program.returncode == code
    assert (own.stdout, own.stderr) == (of_program.stdout, of_program.stderr)


def test_the_program_is_an_entry_point() -> None:
    text = (Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8")
    assert 'grazemap = "grazemap.__main__:main"' in text
