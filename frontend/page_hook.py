"""The build hook of the package: no wheel and no source archive without the built page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class PageHook(BuildHookInterface[Any]):
    """Refuses to build what would have no page to serve; an editable install serves the source tree's."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """See hatchling."""
        page = Path(self.root, "frontend", "dist", "index.html")
        if version != "editable" and not page.is_file():
            raise SystemExit(f"{page} does not exist: build the page first (make page), or both at once (make wheel)")
