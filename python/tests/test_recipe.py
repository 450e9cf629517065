"""The conda recipe says what the package says of itself."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
RECIPE = (ROOT / "python" / "conda" / "recipe.yaml").read_text(encoding="utf-8")
PROJECT = (ROOT / "python" / "pyproject.toml").read_text(encoding="utf-8")


def one(pattern: str, text: str) -> str:
    """Give the only match of a pattern."""
    (found,) = re.findall(pattern, text, re.MULTILINE)
    return str(found)


def test_the_recipe_has_the_version_and_the_requirements_of_the_package() -> None:
    workspace = (ROOT / "Cargo.toml").read_text(encoding="utf-8")
    assert one(r'^  version: "(.*)"$', RECIPE) == one(r'^version = "(.*)"$', workspace)
    assert one(r"^    - numpy (.*)$", RECIPE) == one(r'"numpy(>.*?)"', PROJECT)
    assert one(r"^    - maturin (.*)$", RECIPE) == one(r'"maturin(>.*?)"', PROJECT)
    assert one(r"^      - grazemap = (.*)$", RECIPE) == one(r'^grazemap = "(.*)"$', PROJECT)


def test_the_recipe_bundles_every_licence() -> None:
    listed = one(r"license_file:\n((?:    - .*\n?)+)", RECIPE).split("\n")
    files = {line.removeprefix("    - ") for line in listed if line}
    # Those of the packages of Rust are collected by the build.
    collected = one(r"cargo-bundle-licenses .* --output (.*)$", RECIPE)
    own = {path.name for path in ROOT.glob("LICENSE-*")} | {"NOTICE"}
    assert files == own | {collected}
