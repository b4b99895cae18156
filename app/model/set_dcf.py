"""Parameter sets as DCF (device configuration file, CiA 306): out for configuration tools, and in from them.

A DCF is an EDS with the values of one device (ParameterValue) and the node they belong to. What it has no place for,
such as person, reason and what was unread, stands in its comments, so that the very set comes back from the file.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from app.errors import DescriptionError, SetFileError, UsageError
from app.model.datatypes import Raw
from app.model.description import Bus, Description, Entry
from app.model.eds import read_eds
from app.model.eds.ini import Warnings, decode, parse
from app.model.eds.numbers import parse_value
from app.model.eds_write import Configured, to_eds, value_text
from app.model.set_head import Imported, Taking, Value, head_of, with_head, without_head
from app.model.sets import ParameterSet
from app.model.texts import load_texts

_MARK: Final = "hubside-set"
_CHUNK: Final = 180
"""Characters of the head in one comment: lines of an EDS have at most 255."""
_LINE: Final = re.compile(r"hubside-set \|(.*)\|")
_FATAL: Final = frozenset(
    f"eds.{name}"
    for name in (
        "value_unreadable",
        "node_id_unknown",
        "key_twice",
        "section_twice",
        "section_not_closed",
        "line_not_understood",
        "listed_not_described",
        "too_many_entries",
    )
)
"""Warnings about a data sheet that are errors in a set: a value would be missing, or another than was meant."""


def dump_dcf(parameters: ParameterSet, description: Description, file_name: str | None = None) -> str:
    """The set as a DCF. ``description`` is that of the set. Raises UsageError where it is no CANopen device."""
    if description.bus is not Bus.CANOPEN:
        raise UsageError(reason=f"{description.id} is no CANopen device, so there is no DCF of it: take JSON or CSV")
    texts, others = {}, {}
    for address, raw in parameters.values.items():
        entry = description.entries.get(address)
        text = None if entry is None else _text(entry, raw)
        if text is None:
            others[address] = raw
        else:
            texts[address] = text
    origin = parameters.origin
    configured = Configured(
        node=origin.node,
        name=origin.device,
        network=origin.turbine,
        serial=parameters.identity.serial or 0,
        values=texts,
        comments=tuple(_comments(head_of(parameters, others))),
    )
    of_set = replace(description, version=parameters.description_version)
    return to_eds(of_set, _one_line(file_name or dcf_name(parameters)), configured)


def dcf_name(parameters: ParameterSet) -> str:
    """File name of a set's DCF."""
    return f"{parameters.origin.device.replace('/', '_')}.dcf"


def load_dcf(data: bytes, file: str, taking: Taking) -> Imported:
    """Read a DCF, our own or another tool's. Raises SetFileError with line and reason."""
    head, line = _head(data)
    try:
        loaded = read_eds(data, file)
    except DescriptionError as error:
        reason = str(error.details["reason"])
        raise SetFileError(file=file, line=int(error.details["line"]) or 1, reason=reason) from error
    english = load_texts("en")
    for warning in loaded.warnings:
        if warning.text_key in _FATAL:
            raise SetFileError(file=file, line=warning.line or 1, reason=english(warning.text_key, **warning.details))
    entries = loaded.description.entries
    values = {
        address: Value(raw, entries[address].line or 1, entries[address].title)
        for address, raw in loaded.values.items()
    }
    if head is not None and not taking.as_values:
        return Imported(with_head(head, values, file, line))
    if not values:
        raise SetFileError(file=file, line=1, reason="it describes a device and holds no values: an EDS, no DCF")
    return without_head(values, taking, file, loaded.node_id)


def _text(entry: Entry, raw: Raw) -> str | None:
    """The value as the file has it, where exactly this value comes back from it."""
    try:
        text = value_text(entry, raw)
        same = text is not None and repr(parse_value(text, entry.type).raw) == repr(raw)  # 0.0 is not 0
    except (ValueError, OverflowError, TypeError):
        return None
    return text if same and text else None


def _one_line(text: str) -> str:
    """A name of elsewhere that begins no line and no section of its own; as it is it stands in the head."""
    return "".join(character if character.isprintable() else "_" for character in text)


def _comments(head: str) -> Iterator[str]:
    """The head in pieces; ``;`` and ``#`` would begin a comment for some readers."""
    plain = head.replace(";", "\\u003b").replace("#", "\\u0023").replace("%", "\\u0025")
    for start in range(0, len(plain), _CHUNK):
        yield f"{_MARK} |{plain[start : start + _CHUNK]}|"


def _head(data: bytes) -> tuple[str | None, int]:
    """The head in the comments, and the line in which it begins."""
    quiet = Warnings()
    section = parse(decode(data, quiet), quiet).get("Comments")
    if section is None:
        return None, 1
    pieces, lines = [], []
    for value in section.values.values():
        if match := _LINE.fullmatch(value.text):
            pieces.append(match[1])
            lines.append(value.line)
    return ("".join(pieces), lines[0]) if pieces else (None, 1)
