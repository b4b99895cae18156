"""How an answer says that it is a file to keep, and what it is called (RFC 6266)."""

from __future__ import annotations

from typing import Final
from urllib.parse import quote

_ATTR_CHARS: Final = "!#$&+-.^_`|~"
"""What an extended value holds as it is besides letters and digits (RFC 5987, 3.2.1)."""
_NO_NAME: Final = '/\\:*?"<>|'
"""In no file name everywhere; quotation mark and backslash would end or escape a quoted string besides."""


def as_attachment(name: str) -> dict[str, str]:
    """The header for a file of that name. What no file name can hold, control characters too, is ``_``.

    Where it is not ASCII, the name is told twice: in ASCII for old clients, and as it is.
    """
    safe = "".join("_" if one in _NO_NAME or not one.isprintable() else one for one in name)
    plain = "".join(one if one.isascii() else "_" for one in safe)
    told = f'attachment; filename="{plain}"'
    if plain != safe:
        told += f"; filename*=UTF-8''{quote(safe, safe=_ATTR_CHARS)}"
    return {"Content-Disposition": told}
