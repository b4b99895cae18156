"""What matched, in words."""

from __future__ import annotations

from app.model.texts import load_texts
from app.recording.node_table import NodeKey
from app.service.analysis.look import Look
from app.service.analysis.search.match import Found
from app.service.analysis.search.query import Level, Query
from app.service.analysis.search.stretches import Held
from app.service.analysis.steps import Step
from app.service.analysis.trips import Trip
from app.service.analysis.words import Teller, Words, big, in_words, tellers
from app.wire.signs import Sign

MS = 1_000_000


def tell(look: Look, found: Found) -> Words:
    """The parts of a place that matches, each later one with its time behind the first."""
    return in_words(
        {language: _told(look, teller, language, found) for language, teller in tellers(look.places).items()}
    )


def _told(look: Look, teller: Teller, language: str, found: Found) -> str:
    texts = load_texts(language)
    if not found.what:
        return big(texts("analysis.nothing_of_it"))
    parts, start_ns = [], _begin(found.what[0][1], found)
    for number, (query, what) in enumerate(found.what):
        told = _part(look, teller, query, what, language)
        if number:
            dt = teller.lasting(_begin(what, found) - start_ns)
            told = texts("analysis.later", dt=dt, told=told)
        parts.append(told)
    return big("; ".join(parts))


def _begin(what: Sign | Trip | Held, found: Found) -> int:
    if isinstance(what, Sign):
        return what.t_ns
    return what.t0_ns if isinstance(what, Trip) else max(what.from_ns, found.from_ns)


def _part(look: Look, teller: Teller, query: Query, what: Sign | Trip | Held, language: str) -> str:
    if isinstance(what, Sign):
        return teller.ended(what) if what.ends else teller.step(Step((what,)))
    if isinstance(what, Trip):
        return load_texts(language)("analysis.trip", headline=teller.headline(what))
    assert isinstance(query, Level)  # only a level is held
    return _level(look, teller, query, what.key, what, language)


def _level(look: Look, teller: Teller, level: Level, key: NodeKey, held: Held, language: str) -> str:
    entry = look.entry(key, level.address)
    assert entry is not None  # it was found by its description
    texts, quantity = load_texts(language), look.quantity(key, entry)
    shown = f"{held.extreme * float(quantity.scale):.6g}"
    return texts(
        "analysis.held_on" if held.open else "analysis.held",
        who=teller.who([key]),
        name=texts.name(entry.title),
        address=level.address.short,
        comparison=level.comparison.value,
        bound=teller.number(f"{level.number:g}"),
        unit=level.unit or quantity.unit,
        extreme=teller.number(shown),
        own_unit=quantity.unit,
        lasting=teller.lasting(held.to_ns - held.from_ns),
        gaps=texts("analysis.interrupted") if held.interrupted else "",
    )
