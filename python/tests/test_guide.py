"""The code of the documentation and of the README runs as it stands."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

#: Pages, with the libraries that their code needs.
PAGES = {
    "docs/how-to/jax-and-torch.md": ["jax", "torch"],
    "docs/reference/python.md": ["matplotlib", "xarray"],
    "docs/tutorials/a-fit.md": ["matplotlib"],
    "python/README.md": [],
}


@pytest.mark.parametrize("page", PAGES)
def test_code_of_a_page_runs(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs the blocks of a page in order, in a copy of the folder of files beside it."""
    for library in PAGES[page]:
        pytest.importorskip(library)
    if (files := ROOT / page.replace(".md", ".in")).is_dir():
        shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.DOTALL)
    assert blocks
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, page, "exec"), names)  # noqa: S102
