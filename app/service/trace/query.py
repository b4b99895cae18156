"""What a page asks of the trace, as it stands in its address, made into a filter over rows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Literal

from app.errors import UsageError
from app.model.address import Address
from app.model.description import Description
from app.model.texts import LANGUAGES, load_texts
from app.service.devices import Target
from app.service.trace.text import Namer, TraceNote, details_text, notes_of
from app.wire.frame import Direction
from app.wire.trace.filter import MeansText, TraceFilter, addresses_of, parse_data, parse_ids
from app.wire.trace.service import Service
from app.wire.trace.tracer import Tone, TraceRow

_PLAIN: Final = (Service.SDO_REQUEST, Service.SDO_RESPONSE, Service.TPDO, Service.RPDO, Service.FDL_SAME)


@dataclass(frozen=True, slots=True)
class TraceQuery:
    """Empty means any; all that is given must hold.

    ``ids``: identifiers and ranges in hexadecimal; ``data``: a pattern of bytes; ``q``: part of an object's name or
    address, or of what a row says, in any language. ``id`` is given back with the answers.
    """

    id: int = 0
    nodes: tuple[int, ...] = ()
    services: tuple[str, ...] = ()
    buses: tuple[str, ...] = ()
    direction: Literal["rx", "tx"] | None = None
    ids: str = ""
    data: str = ""
    q: str = ""
    errors: bool = False
    from_t_ns: int | None = None
    to_t_ns: int | None = None


def filter_of(query: TraceQuery, targets: list[Target], namer: Namer) -> TraceFilter:
    """The filter. Raises UsageError where an identifier, a pattern or a service cannot be understood."""
    return TraceFilter(
        buses=frozenset(query.buses),
        nodes=frozenset(query.nodes),
        services=frozenset(_service(name) for name in query.services),
        direction=None if query.direction is None else Direction(query.direction),
        ids=parse_ids(query.ids),
        data=parse_data(query.data),
        only_errors=query.errors,
        from_ns=query.from_t_ns,
        to_ns=query.to_t_ns,
        means=_means(query.q, targets, namer),
    )


def _service(name: str) -> Service:
    try:
        return Service(name)
    except ValueError as error:
        raise UsageError(reason=f"'{name}' is no service") from error


def _means(q: str, targets: list[Target], namer: Namer) -> MeansText | None:
    wanted = q.strip().casefold()
    if not wanted:
        return None
    by_description = {target.description.id: objects_named(target.description, wanted) for target in targets}
    named = {(target.device.bus, target.node): by_description[target.description.id] for target in targets}

    def means(row: TraceRow) -> bool:
        objects = named.get((row.item.bus, row.speaker.node), frozenset())
        for address in addresses_of(row):
            if address in objects or wanted in address.short.casefold():
                return True
        if row.fdl is not None and row.step is not None and wanted in _text(row.step.text_key):
            return True
        notes = () if _says_nothing(row) else notes_of(row, namer)
        return any(wanted in words for note in notes for words in _words(note))

    return means


def _says_nothing(row: TraceRow) -> bool:
    """True for the bulk of the traffic, SDO, PDO and PROFIBUS without news: its notes are figures at most."""
    return row.tone is Tone.PLAIN and row.speaker.service in _PLAIN


@lru_cache(maxsize=8192)
def _folded(english: str) -> str:
    """A name in all languages, folded."""
    return "\n".join((english, *(load_texts(language).name(english) for language in LANGUAGES))).casefold()


@lru_cache(maxsize=256)
def _text(key: str) -> str:
    """A text in all languages, folded."""
    return "\n".join(load_texts(language)(key) for language in LANGUAGES).casefold()


def objects_named(description: Description, wanted: str) -> frozenset[Address]:
    """Objects whose name holds ``wanted`` (folded), in any language."""
    return frozenset(
        entry.address
        for entry in description
        if any(wanted in _folded(name) for name in (entry.title, entry.name, entry.object_name))
    )


def _words(note: TraceNote) -> list[str]:
    """All that a note says, folded, in each language."""
    found = []
    for language in LANGUAGES:
        texts = load_texts(language)
        found.append(f"{texts(note.key)} {details_text(note.details, texts)}".casefold())
    return found
