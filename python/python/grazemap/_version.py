"""Version of the package."""

from __future__ import annotations

from importlib import metadata


def version() -> str:
    """Give the version; ``"unknown"`` in a checkout that is not installed."""
    try:
        return metadata.version("grazemap")
    except metadata.PackageNotFoundError:
        return "unknown"
