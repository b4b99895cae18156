"""The record of one restore: everything that somebody must know years later, and nothing that only we can look up.

Names, units and texts of values are kept with the raw values, so that the record is read without descriptions. Times
are ISO 8601, UTC. Its canonical JSON is what is signed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from app.model.datatypes import Raw
from app.model.restore.plan import Need, StepKind, Treatment, Why
from app.model.rules.rule import Detail, Severity, Verdict
from app.service.records.plain_json import RecordShapeError, canonical, from_plain, parsed, to_plain

FORMAT: Final = "hubside-restore-record/1"


class Outcome(Enum):
    """What stands in the devices at the end; the value is the end of its text key ``record.outcome.…``."""

    NEW = "new"
    """Everything is as the set wants it: verified, saved and proven."""
    OLD = "old"
    """Everything is as it was before."""
    INCOMPLETE = "incomplete"
    """Something between; motion is blocked until it is resumed or rolled back."""
    GIVEN_UP = "given-up"
    """Something between, and an expert has taken it upon himself to go on so."""

    @property
    def text_key(self) -> str:
        """Text key of its word."""
        return f"record.outcome.{self.value}"


class StepOutcome(Enum):
    """What became of one step; the value is the end of its text key ``record.step_outcome.…``."""

    DONE = "done"
    """Written and read back equal; confirmed; saved; booted again; read again and equal."""
    FAILED = "failed"
    UNKNOWN = "unknown"
    """Begun, and cut off before anybody could tell."""
    SKIPPED = "skipped"
    """Not done: it was not agreed, or an earlier step failed."""

    @property
    def text_key(self) -> str:
        """Text key of its word."""
        return f"record.step_outcome.{self.value}"


@dataclass(frozen=True, slots=True)
class Value:
    """One value: ``raw`` on the wire, ``shown`` as the page shows it, without its unit."""

    raw: Raw
    shown: str


@dataclass(frozen=True, slots=True)
class SetReference:
    """A set, by its hash (SHA-256, hexadecimal), the id of its record in the library, and where it comes from."""

    hash: str
    record: str = ""
    device: str = ""
    """Slug of the device that it was taken from."""
    time: str = ""
    person: str = ""
    reason: str = ""
    work_order: str = ""


@dataclass(frozen=True, slots=True)
class DeviceRecord:
    """One device of the station, and its sets: as it was before, the one restored, and as it was at the end."""

    slug: str
    description_id: str
    description_version: str
    node: int
    identity: Mapping[str, int | str]
    """What it said of itself, by the names of ``model.sets.Identity``; what it did not answer is not in it."""
    nameplate: str | None
    """Serial number on its nameplate, typed and confirmed; None where nobody did."""
    same_unit: bool | None
    """True where the restored set is proven to come from this very unit; None where nobody can tell."""
    before: SetReference
    restored: SetReference | None
    after: SetReference | None
    undo: SetReference | None
    """The set that takes everything back."""
    needs: tuple[Need, ...] = ()
    restarted: bool = False
    simulated: bool = False
    """True for a twin (its device name 1008h says so)."""


@dataclass(frozen=True, slots=True)
class RowRecord:
    """One object: ``was`` before, ``wanted`` by the set, ``now`` at the end (all in RAM); None where not known.

    ``why`` only where it was not restored. ``verified``: read back equal. ``saved``: the device acknowledged a save
    after it. ``proven``: read again equal after a restart.
    """

    device: str
    address: str
    name: str
    """As the description has it, in English."""
    unit: str
    treatment: Treatment
    was: Value | None
    wanted: Value | None
    now: Value | None
    why: Why | None = None
    details: Mapping[str, str] = field(default_factory=dict)
    verified: bool = False
    saved: bool = False
    proven: bool = False


@dataclass(frozen=True, slots=True)
class StepRecord:
    """One step as it was carried out. ``address`` and ``value`` for writes; ``note`` is an error's text in English."""

    kind: StepKind
    device: str
    time: str
    outcome: StepOutcome
    address: str = ""
    value: Value | None = None
    note: str = ""


@dataclass(frozen=True, slots=True)
class PlaceRecord:
    """One object of one device."""

    device: str
    address: str


@dataclass(frozen=True, slots=True)
class FindingRecord:
    """What a rule said of the station as it was to be."""

    rule_id: str
    severity: Severity
    verdict: Verdict
    places: tuple[PlaceRecord, ...] = ()
    details: Mapping[str, Detail] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class CheckRecord:
    """One check before the first write. ``text_key`` names its text, filled with ``details``.

    ``confirmed_by`` is the expert who took it upon himself where it was not met.
    """

    text_key: str
    passed: bool
    details: Mapping[str, str] = field(default_factory=dict)
    confirmed_by: str = ""


@dataclass(frozen=True, slots=True)
class EventRecord:
    """Something that happened to the restore as a whole. ``text_key`` names its text, filled with ``details``."""

    time: str
    text_key: str
    person: str = ""
    details: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class RestoreRecord:
    """One restore of one station, from its plan to its end."""

    id: str
    station: str
    """Slug: turbine/station."""
    outcome: Outcome
    person: str
    reason: str
    work_order: str
    started: str
    confirmed: str | None
    """When the person confirmed; None where nobody did."""
    confirmed_by: str
    ended: str
    plan_hash: str
    tool: str
    simulated: bool
    """True where any of the devices is a twin."""
    devices: tuple[DeviceRecord, ...]
    rows: tuple[RowRecord, ...]
    steps: tuple[StepRecord, ...]
    findings: tuple[FindingRecord, ...] = ()
    checks: tuple[CheckRecord, ...] = ()
    events: tuple[EventRecord, ...] = ()
    """What happened to it as a whole: begun, interrupted, resumed, rolled back, by whom."""
    note: str = ""
    """Why it ended otherwise than new, in English; empty where it did not."""


def dump_record(record: RestoreRecord) -> str:
    """Its canonical JSON: keys sorted, no blanks. The same record gives the same text, byte for byte."""
    return canonical({"format": FORMAT, "record": to_plain(record)})


def load_record(text: str) -> RestoreRecord:
    """The record of a canonical JSON. Raises RecordShapeError: no record, of another format, or not canonical."""
    content = parsed(text)
    if not isinstance(content, dict) or set(content) != {"format", "record"}:
        raise RecordShapeError("no record of a restore")
    if content["format"] != FORMAT:
        raise RecordShapeError(f"its format is {content['format']!r}, this version reads {FORMAT!r}")
    record = from_plain(RestoreRecord, content["record"])
    if dump_record(record) != text:
        raise RecordShapeError("its JSON is not canonical")
    return record
