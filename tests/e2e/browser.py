"""Headless Chromium for the browser tests."""

from __future__ import annotations

import os
import shutil
from typing import Final

CHROMIUM: Final = os.environ.get("CHROMIUM") or shutil.which("chromium") or "/usr/bin/chromium"
FLAGS: Final = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
SOFTWARE_3D: Final = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
"""Renders the 3D view without a graphics card, at the cost of whole cores."""
