"""What analysis tells of recordings: trips in words, events to jump to, curves on a common axis. Times are in t_ns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.model.address import parse_address
from app.recording.node_table import NodeKey
from app.service.analysis.align import Aligned, SignalAt, Track, Window
from app.service.analysis.because import Reason
from app.service.analysis.key_events import KeyEvent, KeyKind
from app.service.analysis.look import Look
from app.service.analysis.places import Places
from app.service.analysis.steps import Step
from app.service.analysis.trips import Role, Trip
from app.service.analysis.words import Teller, Words, in_words, tellers
from app.wire.events import Severity
from app.wire.signs import Sign, SignKind

MS = 1_000_000
Tellers = dict[str, Teller]


class WordsDoc(BaseModel):
    """A sentence in every language."""

    en: str
    de: str

    @classmethod
    def of(cls, words: Words) -> WordsDoc:
        """As it is told."""
        return cls(en=words.en, de=words.de)


class NodeAt(BaseModel):
    """A node and the frame that told: jump to ``t_ns`` on ``bus``. ``device`` is its slug where it is known."""

    bus: str
    node: int
    device: str | None
    t_ns: int

    @classmethod
    def of(cls, sign: Sign, t_ns: int, places: Places) -> NodeAt:
        """Where a sign was told."""
        place = places.get((sign.bus, sign.node))
        return cls(bus=sign.bus, node=sign.node, device=None if place is None else place.slug, t_ns=t_ns)


class TripStepDoc(BaseModel):
    """One step of a trip: like signs of one or several nodes (``at``, in the order of time).

    ``dt_ms`` counts from what came first, ``t0_ms`` from T0. ``says`` is who and what, with the time behind the first
    (``sentence``). ``because`` is the place of the step that explains it, ``reason`` why, ``because_words`` both in a
    sentence that names what stands behind the contacts in between. ``since_ns``: it may have begun as early as then.
    ``standing``: it was so when it was first seen. ``times``: how often it came while it chattered.
    """

    t_ns: int
    dt_ms: float
    t0_ms: float
    role: Role
    kind: SignKind
    severity: Severity
    says: WordsDoc
    sentence: WordsDoc
    because: int | None
    reason: Reason | None
    because_words: WordsDoc | None
    at: list[NodeAt]
    since_ns: int | None
    standing: bool
    times: int
    details: dict[str, Any]


class TripDoc(BaseModel):
    """One trip. ``t0_ns`` is the moment at which the safety chain opened or an axis faulted.

    ``first``, ``trigger`` and ``at`` are places in ``steps``: what came first of all, the last fault, command or loss
    before T0, and the step at T0. ``known`` false: nothing on the bus tells why. ``ended_ns`` null: it lasts to the
    end of the recording. ``headline`` is the trip in one sentence. ``already`` tells which units were tripped before
    the recording began, and were so at T0; null where none was.
    """

    number: int
    t0_ns: int
    ended_ns: int | None
    known: bool
    first: int
    trigger: int
    at: int
    headline: WordsDoc
    already: WordsDoc | None
    steps: list[TripStepDoc]

    @classmethod
    def of(cls, look: Look, number: int, told: Tellers) -> TripDoc:
        """The trip of this place."""
        trip = look.trips[number]
        return cls(
            number=number,
            t0_ns=trip.t0_ns,
            ended_ns=trip.ended_ns,
            known=trip.known,
            first=trip.first,
            trigger=trip.trigger,
            at=trip.at,
            headline=_headline(told, trip),
            already=_already(told, trip.already),
            steps=[_step(look, told, trip, place) for place in range(len(trip.steps))],
        )


class TripsDoc(BaseModel):
    """The trips of a recording, by time. ``already`` tells which units were tripped when it began; null: none."""

    name: str
    turbine: str
    from_ns: int
    to_ns: int
    already: WordsDoc | None
    trips: list[TripDoc]

    @classmethod
    def of(cls, look: Look) -> TripsDoc:
        """All trips of the recording."""
        told = tellers(look.places)
        begin, end = look.span_ns
        trips = [TripDoc.of(look, number, told) for number in range(len(look.trips))]
        already = _already(told, look.tripped_before)
        turbine = look.info.turbine
        return cls(name=look.name, turbine=turbine, from_ns=begin, to_ns=end, already=already, trips=trips)


def _headline(told: Tellers, trip: Trip) -> WordsDoc:
    return WordsDoc.of(in_words({language: one.headline(trip) for language, one in told.items()}))


def _already(told: Tellers, nodes: Sequence[NodeKey]) -> WordsDoc | None:
    if not nodes:
        return None
    return WordsDoc(**{language: one.already(nodes) or "" for language, one in told.items()})


def _says(told: Tellers, step: Step) -> WordsDoc:
    return WordsDoc.of(in_words({language: one.sentence(step) for language, one in told.items()}))


def _step(look: Look, told: Tellers, trip: Trip, place: int) -> TripStepDoc:
    one = trip.steps[place]
    step, sign, first = one.step, one.step.sign, trip.steps[trip.first].step
    because = {language: teller.because_of(trip, place) for language, teller in told.items()}
    unsure = step.t_ns == sign.t_ns and sign.since_ns < sign.t_ns
    return TripStepDoc(
        t_ns=step.t_ns,
        dt_ms=(step.t_ns - first.t_ns) / MS,
        t0_ms=(step.t_ns - trip.t0_ns) / MS,
        role=one.role,
        kind=step.kind,
        severity=step.severity,
        says=_says(told, step),
        sentence=WordsDoc.of(in_words({language: teller.step_of(trip, place) for language, teller in told.items()})),
        because=None if one.because is None else one.because.cause,
        reason=None if one.because is None else one.because.reason,
        because_words=None if one.because is None else WordsDoc(**{key: text or "" for key, text in because.items()}),
        at=[NodeAt.of(each, Step((each,)).t_ns, look.places) for each in step.signs],
        since_ns=sign.since_ns if unsure else None,
        standing=sign.standing,
        times=sign.times,
        details=dict(sign.details),
    )


class KeyEventDoc(BaseModel):
    """Something to jump to, at ``t_ns``. ``trip`` is the place of a trip among those of the recording."""

    t_ns: int
    kind: KeyKind
    sign: SignKind
    says: WordsDoc
    trip: int | None
    at: list[NodeAt]

    @classmethod
    def of(cls, look: Look, event: KeyEvent, told: Tellers) -> KeyEventDoc:
        """One event."""
        what = event.what
        return cls(
            t_ns=event.t_ns,
            kind=event.kind,
            sign=event.step.kind,
            says=_headline(told, what) if isinstance(what, Trip) else _says(told, what),
            trip=event.number,
            at=[NodeAt.of(each, Step((each,)).t_ns, look.places) for each in event.step.signs],
        )


# -- alignment ------------------------------------------------------------------

Name = Annotated[str, Field(max_length=250)]
_HOUR_MS = 3_600_000


class AnchorAt(BaseModel):
    """A recording and its zero: T0 of its trip number ``trip``, or the moment ``t_ns``; exactly one of them."""

    model_config = ConfigDict(extra="forbid")

    name: Name
    trip: Annotated[int | None, Field(ge=0, le=100_000)] = None
    t_ns: Annotated[int | None, Field(ge=0, le=2**62)] = None


class SignalWanted(BaseModel):
    """An object such as ``6064``, on one blade or all, of ``pmm``, ``pmc`` or both; or of exactly one node of a bus."""

    model_config = ConfigDict(extra="forbid")

    address: Annotated[str, Field(max_length=20)]
    blade: Annotated[int | None, Field(ge=1, le=9)] = None
    device: Annotated[str | None, Field(max_length=40)] = None
    bus: Annotated[str | None, Field(max_length=40)] = None
    node: Annotated[int | None, Field(ge=1, le=127)] = None

    def signal(self) -> SignalAt:
        """As the use case takes it. Raises UsageError on an address that is none."""
        node: NodeKey | None = None if self.bus is None or self.node is None else (self.bus, self.node)
        return SignalAt(parse_address(self.address), self.blade, self.device, node)


class AlignRequest(BaseModel):
    """Recordings side by side, each by its own zero, from ``before_ms`` before to ``after_ms`` behind it.

    ``points``: how many stretches the window has at most, such as the pixels of the plot.
    """

    model_config = ConfigDict(extra="forbid")

    recordings: Annotated[list[AnchorAt], Field(min_length=1, max_length=50)]
    signals: Annotated[list[SignalWanted], Field(min_length=1, max_length=16)]
    before_ms: Annotated[float, Field(ge=0, le=_HOUR_MS)] = 10_000
    after_ms: Annotated[float, Field(gt=0, le=_HOUR_MS)] = 20_000
    points: Annotated[int, Field(ge=10, le=4000)] = 1000

    def window(self) -> Window:
        """As the use case takes it."""
        return Window(round(self.before_ms * MS), round(self.after_ms * MS), self.points)


class TrackDoc(BaseModel):
    """One signal of one recording, scaled, in ``unit``; times in ms from the zero.

    ``exact``: values as they came (``low`` equals ``high``); else least and greatest of a stretch of ``step_ms`` from
    each time on. No line may cross ``breaks_ms``.
    """

    bus: str
    node: int
    device: str | None
    blade: int | None
    address: str
    name: str
    unit: str
    exact: bool
    step_ms: float
    t_ms: list[float]
    low: list[float]
    high: list[float]
    breaks_ms: list[float]

    @classmethod
    def of(cls, track: Track) -> TrackDoc:
        """One track."""
        return cls(
            bus=track.key[0],
            node=track.key[1],
            device=track.device,
            blade=track.blade,
            address=track.address.short,
            name=track.name,
            unit=track.unit,
            exact=track.exact,
            step_ms=track.step_ms,
            t_ms=track.t_ms.tolist(),
            low=track.low.tolist(),
            high=track.high.tolist(),
            breaks_ms=track.breaks_ms.tolist(),
        )


class AlignedDoc(BaseModel):
    """One recording: its turbine and its zero (for the label), how far it reaches, its curves.

    ``problem`` says why there are none: a text key with its details.
    """

    name: str
    turbine: str
    t0_ns: int | None
    from_ms: float
    to_ms: float
    tracks: list[TrackDoc]
    problem: str | None = None
    problem_details: dict[str, Any] = {}

    @classmethod
    def of(cls, aligned: Aligned) -> AlignedDoc:
        """One recording."""
        return cls(
            name=aligned.file,
            turbine=aligned.turbine,
            t0_ns=aligned.t0_ns,
            from_ms=aligned.from_ms,
            to_ms=aligned.to_ms,
            tracks=[TrackDoc.of(track) for track in aligned.tracks],
        )


class AlignDoc(BaseModel):
    """Recordings on one axis, in the order in which they were asked for."""

    recordings: list[AlignedDoc]


Direction = Literal["after", "before"]
