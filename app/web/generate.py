"""``python -m app.web.generate FILE`` writes the API's types as OpenAPI, those of the socket included.

The page's types are made from that file (``npm run generate``). The same code gives the same bytes.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from pydantic import TypeAdapter

from app.web.app import create_api
from app.web.documentation import document as documented
from app.web.models import ClientMessage, ServerMessage

SOCKET: Final[dict[str, Any]] = {"ServerMessage": ServerMessage, "ClientMessage": ClientMessage}
"""Names under which the socket's messages are found in the schemas."""
_REFERENCE: Final = "#/components/schemas/{model}"


def openapi() -> dict[str, Any]:
    """The OpenAPI document."""
    document = documented(create_api(None))
    schemas = document["components"]["schemas"]
    for name, model in SOCKET.items():
        mode: Any = "serialization" if name == "ServerMessage" else "validation"
        schema = TypeAdapter[Any](model).json_schema(ref_template=_REFERENCE, mode=mode)
        for part, definition in schema.pop("$defs", {}).items():
            if schemas.setdefault(part, definition) != definition:
                raise ValueError(f"two types are named {part}")
        schemas[name] = schema
    return document


def text() -> str:
    """The document as text: keys sorted, a line feed at the end."""
    return json.dumps(openapi(), ensure_ascii=False, sort_keys=True, indent=2) + "\n"


def main(arguments: Sequence[str]) -> int:
    """Write the file that is named. Gives the exit code."""
    if len(arguments) != 1:
        print("usage: python -m app.web.generate FILE", file=sys.stderr)
        return 2
    Path(arguments[0]).write_text(text(), encoding="utf-8", newline="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
