"""A record as a PDF, set by Typst from a template of ours: no network, no packages, fonts of the compiler only."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import typst

from app.service.records.view import View

TEMPLATE: Final = Path(__file__).with_name("record.typ")
_LAST: Final = 0x2FFF
"""The embedded fonts know letters and signs up to here; what lies beyond is printed as its code point."""


def render_pdf(view: View, attachment: str) -> bytes:
    """The PDF, with ``attachment`` in it as record.json. The same view gives the same bytes."""
    shown = json.dumps(_printable(asdict(view) | {"outcome": view.outcome.value}), ensure_ascii=False)
    inputs = {"view": shown, "record": attachment}
    return typst.compile(TEMPLATE.read_bytes(), format="pdf", ignore_system_fonts=True, sys_inputs=inputs, timestamp=0)


def _printable(item: Any) -> Any:
    if isinstance(item, str):
        return "".join(char if ord(char) <= _LAST else f"‹U+{ord(char):04X}›" for char in item)
    if isinstance(item, dict):
        return {key: _printable(one) for key, one in item.items()}
    if isinstance(item, list | tuple):
        return [_printable(one) for one in item]
    return item
