"""Where the data that comes with the program lies."""

from __future__ import annotations

from pathlib import Path


def bundled_folder(in_checkout: str, in_wheel: str) -> Path:
    """A folder of data: inside the package in a wheel, else beside the package in a checkout."""
    package = Path(__file__).resolve().parent.parent
    bundled = package / "_bundle" / in_wheel
    return bundled if bundled.is_dir() else package.parent / in_checkout
