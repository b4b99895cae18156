"""Every text key that the wire gives has a text in both languages."""

from __future__ import annotations

import string

import pytest

from app.model.texts import LANGUAGES, load_texts
from app.wire import emcy
from app.wire.events import EventKind
from app.wire.modbus.functions import ModbusException, exception_text_key
from app.wire.nmt import NmtCommand, NmtState
from app.wire.records import Fault
from app.wire.sdo import Abort, GatewayAbort, abort_text_key

KEYS = (
    *(abort_text_key(code) for code in (*Abort, *GatewayAbort)),
    *(exception_text_key(code) for code in (0, *ModbusException)),
    abort_text_key(0),
    *(f"emcy.{code:04x}" for code in emcy.ERROR_CLASSES),
    "emcy.unknown",
    "event.device_fault_unknown",
    "event.malformed_adu",
    *(item.text_key for enum in (NmtState, NmtCommand, Fault, EventKind) for item in enum),
)


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_key_has_a_text(language: str) -> None:
    texts = load_texts(language).flat
    assert [key for key in KEYS if not texts.get(key)] == []


def test_both_languages_have_the_same_placeholders() -> None:
    english, german = (load_texts(language).flat for language in ("en", "de"))
    for key in KEYS:
        names = [
            {field for _, field, _, _ in string.Formatter().parse(texts[key]) if field} for texts in (english, german)
        ]
        assert names[0] == names[1], key
