"""Trips in words, in every language of the catalogue."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from app.model.texts import LANGUAGES, load_texts
from app.recording.node_table import NodeKey
from app.service.analysis.because import Because, Reason
from app.service.analysis.places import Place, Places
from app.service.analysis.steps import Step
from app.service.analysis.trips import TRIP_KINDS, Trip
from app.wire.signs import Sign, SignKind

MS: Final = 1_000_000
_IN_SECONDS_FROM_MS: Final = 10_000
_POWER_UNIT: Final = "oat-pmm"
_CONTACTS: Final = frozenset({SignKind.CHAIN_OPEN, SignKind.EFC_INPUT})
_CARRIERS: Final = TRIP_KINDS | {SignKind.PMM_FAULT, SignKind.WATCHDOG_OPEN}


@dataclass(frozen=True, slots=True)
class Words:
    """One sentence by language."""

    en: str
    de: str


class Teller:
    """Tells signs, steps and trips of one recording, in one language."""

    def __init__(self, language: str, places: Places) -> None:
        self._english = language == "en"
        self._texts = load_texts(language)
        self._places = places

    # -- who -----------------------------------------------------------------------

    def who(self, nodes: Sequence[NodeKey]) -> str:
        """``blade 2 PMC``, ``blades 1, 2, 3 PMM``, ``node 100``."""
        blades: dict[str, list[int]] = {}
        others: list[str] = []
        for key in nodes:
            place = self._places.get(key)
            if place is not None and place.blade is not None:
                blades.setdefault(place.device.upper(), []).append(place.blade)
            else:
                others.append(self._other(key, place))
        told = [self._blades(device, sorted(set(numbers))) for device, numbers in blades.items()]
        return ", ".join([*told, *others])

    def _blades(self, device: str, numbers: Sequence[int]) -> str:
        key = "analysis.place.blade" if len(numbers) == 1 else "analysis.place.blades"
        return self._texts(key, numbers=", ".join(map(str, numbers)), device=device)

    def _other(self, key: NodeKey, place: Place | None) -> str:
        if place is not None:
            return place.slug.partition("/")[2] or place.slug
        return self._texts("analysis.place.everybody" if key[1] == 0 else "analysis.place.node", node=key[1])

    # -- what ----------------------------------------------------------------------

    def sign(self, sign: Sign, counted: bool = True) -> str:
        """What a sign says, without who; how often it came where ``counted``."""
        details: dict[str, Any] = dict(sign.details)
        if "name" in details:
            details["name"] = ": ".join(self._texts.name(part) for part in str(details["name"]).split(": "))
        for shown in ("shown", "was_shown", "amount", "bound"):
            if shown in details:
                details[shown] = self.number(str(details[shown]))
        told = self._texts(sign.text_key, **details)
        return self._texts("analysis.times", told=told, count=sign.times) if counted and sign.times > 1 else told

    def number(self, text: str) -> str:
        """A number as it is written here."""
        return text.replace(".", self._texts("analysis.decimal_point"))

    def lasting(self, dt_ns: int) -> str:
        """A time: in milliseconds, from ten seconds on in seconds."""
        dt_ms = dt_ns / MS
        return self.number(f"{dt_ms / 1000:.1f}") + " s" if abs(dt_ms) >= _IN_SECONDS_FROM_MS else f"{dt_ms:.0f} ms"

    def step(self, step: Step, counted: bool = False) -> str:
        """Who and what."""
        if step.kind is SignKind.GAP:
            return self._texts(step.sign.text_key, **step.sign.details)
        return self._texts("analysis.who_what", who=self.who(step.nodes), what=self._what(step, counted))

    def ended(self, sign: Sign) -> str:
        """Who, and which condition is over."""
        return self._texts("analysis.who_what", who=self.who([(sign.bus, sign.node)]), what=self.sign(sign))

    def _what(self, step: Step, counted: bool = False) -> str:
        """Inside a sentence an English word has no capital; abbreviations keep theirs, German nouns too."""
        told = self.sign(step.sign, counted)
        return told[:1].lower() + told[1:] if self._english and told[1:2].islower() else told

    def sentence(self, step: Step) -> str:
        """Who and what, with a capital, and how often it came."""
        return big(self.step(step, counted=True))

    def step_of(self, trip: Trip, number: int) -> str:
        """A step with its time behind what came first, or before it."""
        step, first = trip.steps[number].step, trip.steps[trip.first].step
        told = self.step(step, counted=True)
        if number == trip.first:
            return big(told)
        dt_ns = step.t_ns - first.t_ns
        key = "analysis.after" if dt_ns >= 0 else "analysis.before"
        return big(self._texts(key, told=told, dt=self.lasting(abs(dt_ns)), first=self._short(first)))

    def because_of(self, trip: Trip, number: int) -> str | None:
        """Why a step came, with the step that explains it; None where nothing does."""
        told = _told_cause(trip, number)
        if told is None:
            return None
        reason = self._texts(told.reason.text_key)
        return self._texts("analysis.because", reason=reason, cause=self.step(trip.steps[told.cause].step))

    def _short(self, first: Step) -> str:
        """What came first as part of another sentence; where all power units lost the mains, the turbine did."""
        units = [key for key, place in self._places.items() if place.description_id == _POWER_UNIT]
        if first.kind in (SignKind.MAINS_LOW, SignKind.ON_BATTERY) and set(units) <= set(first.nodes):
            return self._texts("analysis.mains_failure")
        return self.step(first)

    # -- the trip --------------------------------------------------------------------

    def headline(self, trip: Trip) -> str:
        """The trip in one sentence: what did it, and how long after what came first."""
        first, trigger, at = (trip.steps[n].step for n in (trip.first, trip.trigger, trip.at))
        if not trip.known:
            return big(self._texts("analysis.no_reason", told=self.step(at)))
        if trigger.kind is SignKind.EMCY:
            return big(self._after(trigger, first))
        if trip.first == trip.at:
            return big(self.step(at))
        tripped = self._texts(_tripped(at), who=self.who(at.nodes))
        dt = self.lasting(trip.t0_ns - first.t_ns)
        return big(self._texts("analysis.after", told=tripped, dt=dt, first=self._short(first)))

    def already(self, nodes: Sequence[NodeKey]) -> str | None:
        """Which units were tripped before the recording began; None where none was."""
        return self._texts("analysis.already", who=self.who(nodes)) if nodes else None

    def _after(self, trigger: Step, first: Step) -> str:
        told, dt = self.step(trigger), self.lasting(trigger.t_ns - first.t_ns)
        if trigger is first:
            return told
        if trigger.nodes == first.nodes:
            return self._texts("analysis.seen_before", told=told, dt=dt, first=self._what(first))
        return self._texts("analysis.after", told=told, dt=dt, first=self._short(first))


def _tripped(at: Step) -> str:
    """Text key of what happened at T0."""
    if at.kind is SignKind.AXIS_FAULT:
        return "analysis.tripped_axis"
    return "analysis.tripped_efc" if at.kind in (SignKind.EFC_INPUT, SignKind.EFC_COMMAND) else "analysis.tripped_chain"


def _told_cause(trip: Trip, number: int) -> Because | None:
    """Behind contacts and inputs stands what opened them: of those that is the cause a person wants to read."""
    because = trip.steps[number].because
    if trip.steps[number].step.kind not in _CONTACTS:
        return because
    seen = {number}
    while because is not None and because.cause not in seen and trip.steps[because.cause].step.kind in _CARRIERS:
        seen.add(because.cause)
        deeper = trip.steps[because.cause].because
        if deeper is None:
            break
        because = Because(deeper.cause, because.reason if deeper.reason is Reason.SAME_EVENT else deeper.reason)
    return because


def big(text: str) -> str:
    """With a capital, as a sentence begins."""
    return text[:1].upper() + text[1:]


def tellers(places: Places) -> dict[str, Teller]:
    """One for each language."""
    return {language: Teller(language, places) for language in LANGUAGES}


def in_words(told: Mapping[str, str]) -> Words:
    """The sentence of each language."""
    return Words(**told)
