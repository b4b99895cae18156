"""The page's own files: read once, compressed once, with the caching that their names allow."""

from __future__ import annotations

import gzip
import mimetypes
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Final

from fastapi import Request, Response

from app.model.bundled import bundled_folder

_TYPES: Final = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".json": "application/json",
    ".woff2": "font/woff2",
}
"""Named here because Windows takes types from its registry, where others may have changed them."""
_COMPRESSED: Final = (".html", ".js", ".css", ".svg", ".json")
_HASHED: Final = "assets"
"""The build puts a hash into the names of the files in this folder: their contents never change."""


@dataclass(frozen=True, slots=True)
class _File:
    data: bytes
    packed: bytes | None
    media_type: str
    tag: str
    modified_ns: int


class PageFiles:
    """The built page in ``folder``; every path that is no file is a route of the page and gives its index."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder.resolve()
        self._files: dict[Path, _File] = {}

    def answer(self, request: Request, path: str) -> Response | None:
        """The answer for ``path``, or None where the page was not built or a named file does not exist."""
        found = self._find(path)
        if found is None:
            return None
        file = self._load(found)
        hashed = found.parent.name == _HASHED
        headers = {
            "Cache-Control": "public, max-age=31536000, immutable" if hashed else "no-cache",
            "ETag": file.tag,
            "Vary": "Accept-Encoding",
        }
        if request.headers.get("if-none-match") == file.tag:
            return Response(status_code=304, headers=headers)
        if file.packed is not None and "gzip" in request.headers.get("accept-encoding", ""):
            return Response(file.packed, headers=headers | {"Content-Encoding": "gzip"}, media_type=file.media_type)
        return Response(file.data, headers=headers, media_type=file.media_type)

    def _find(self, path: str) -> Path | None:
        wanted = (self._folder / path.lstrip("/")).resolve()
        if wanted.is_relative_to(self._folder) and wanted.is_file():
            return wanted
        index = self._folder / "index.html"
        return index if not Path(path).suffix and index.is_file() else None

    def _load(self, path: Path) -> _File:
        modified_ns = path.stat().st_mtime_ns
        known = self._files.get(path)
        if known is None or known.modified_ns != modified_ns:
            data = path.read_bytes()
            packed = gzip.compress(data, 9, mtime=0) if path.suffix in _COMPRESSED else None
            kind = _TYPES.get(path.suffix) or mimetypes.guess_type(path.name)[0] or "application/octet-stream"
            known = _File(data, packed, kind, f'"{sha256(data).hexdigest()[:20]}"', modified_ns)
            self._files[path] = known
        return known


def page_folder() -> Path:
    """Where the built page lies: inside the installed package, else in the source tree."""
    return bundled_folder("frontend/dist", "page")
