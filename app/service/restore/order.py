"""What is ordered, what speaks against it, and why a restore ended otherwise."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Final

from app.errors import HubsideError, RestoreBrokenError
from app.model.restore.wanted import PlanOptions
from app.model.sets import ParameterSet
from app.model.station import Place


@dataclass(frozen=True, slots=True)
class Given:
    """The set that one device is to have; ``record`` is its id in the library, empty where it came from a file."""

    parameters: ParameterSet
    record: str = ""


@dataclass(frozen=True, slots=True)
class Order:
    """A restore of ``station`` (turbine/station) as a person asks for it.

    ``given`` by slug of the device. ``selected``: None takes everything that may be taken. ``confirm_s``: how long the
    person has to confirm before all is rolled back; None: confirmed already. ``others_confirmed``: an expert answers
    for the other blades, which are not in feather. ``accepted``: rules that an expert lets stay broken. ``network``:
    what decides at which address a device is found goes along.
    ``homeless``: sets that no device of the station is of the kind for.
    """

    station: str
    given: Mapping[str, Given]
    person: str
    selected: frozenset[Place] | None = None
    restart: bool = False
    expert: bool = False
    reason: str = ""
    work_order: str = ""
    confirm_s: float | None = 300.0
    others_confirmed: bool = False
    accepted: frozenset[str] = frozenset()
    homeless: tuple[Given, ...] = ()
    network: bool = False

    def options(self, same_unit: Mapping[str, bool]) -> PlanOptions:
        """What the planner needs of it."""
        return PlanOptions(
            selected=self.selected,
            same_unit=same_unit,
            expert=self.expert,
            restart=self.restart,
            accepted=self.accepted,
            network=self.network,
        )


@dataclass(frozen=True, slots=True)
class Timing:
    """How long is waited. ``ready_s``: for a device that starts or saves; ``quiet_s``: for an axis to stand still.

    ``boot_s``: for the boot-up message after a restart that we ask for; ``hand_s``: for somebody who is to switch a
    device off and on; ``mode_s``: for a mode of operation to show.
    ``status_s``: a statusword younger than this need not be read again.
    """

    ready_s: float = 20.0
    quiet_s: float = 30.0
    boot_s: float = 15.0
    hand_s: float = 300.0
    mode_s: float = 2.0
    status_s: float = 0.5


class Objection(Enum):
    """Why the pre-check refuses; the value is the end of its text key ``restore.refusal.…``."""

    NOTHING_GIVEN = "nothing-given"
    NOTHING_TO_DO = "nothing-to-do"
    NO_DEVICE = "no-device"
    OTHER_DEVICE_TYPE = "other-device-type"
    OTHER_VARIANT = "other-variant"
    """Another device of the same description, with another motor: an expert may answer for it."""
    DESCRIPTION = "description"
    FIRMWARE = "firmware"
    IDENTITY = "identity"
    DRIVE_ENABLED = "drive-enabled"
    DRIVE_MOVING = "drive-moving"
    DRIVE_UNKNOWN = "drive-unknown"
    SUPPLY = "supply"
    BATTERY = "battery"
    OTHER_MASTER = "other-master"
    NOT_RECORDING = "not-recording"
    OTHER_BLADES = "other-blades"
    RESTORE_OPEN = "restore-open"
    RULES = "rules"
    NO_ORDER = "no-order"
    CANNOT_SAVE = "cannot-save"
    """In its state the device takes no save: what is written could not be kept."""
    NEW_ADDRESS = "new-address"
    """A restart would bring another address into force: the device could not be read again at the end."""

    @property
    def text_key(self) -> str:
        """Key of its text."""
        return f"restore.refusal.{self.value}"


@dataclass(frozen=True, slots=True)
class Refusal:
    """One reason against a restore. ``device`` is a slug, empty where it is about all; ``details`` fill its text."""

    objection: Objection
    device: str = ""
    details: Mapping[str, str] = field(default_factory=dict)

    def as_detail(self) -> dict[str, str]:
        """As a detail of an error."""
        return {
            **self.details,
            "code": self.objection.value,
            "text_key": self.objection.text_key,
            "device": self.device,
        }


class Cause(Enum):
    """Why a restore did not go on; the value is the end of its text key ``restore.cause.…``."""

    DEVICE_REFUSED = "device-refused"
    NO_ANSWER = "no-answer"
    UNVERIFIED = "unverified"
    CHANGED = "changed"
    """RAM holds another value than it was to hold: somebody else writes, or the device lost it."""
    DEVICE_RESTARTED = "device-restarted"
    DRIVE_ENABLED = "drive-enabled"
    NOT_FIT = "not-fit"
    """Something speaks against going on; ``details`` have the ``objection_key``, and what fills its text."""
    OVERTAKEN = "overtaken"
    """Somebody sent STOP or FEATHER, and the next step would have undone it."""
    SAVE_FAILED = "save-failed"
    PROOF_FAILED = "proof-failed"
    NOT_CONFIRMED = "not-confirmed"
    CANCELLED = "cancelled"
    OTHER_DEVICE = "other-device"
    """Another device than that of the restore answers in its place."""
    OTHER_FIRMWARE = "other-firmware"
    """A device got another firmware meanwhile."""
    BUS_LOST = "bus-lost"
    STORE_FAILED = "store-failed"
    TOOL_ENDED = "tool-ended"
    DEFECT = "defect"

    @property
    def text_key(self) -> str:
        """Key of its text."""
        return f"restore.cause.{self.value}"

    @property
    def is_decision(self) -> bool:
        """True where nothing went wrong: a person did not want the new values, or did not say so."""
        return self in (Cause.NOT_CONFIRMED, Cause.CANCELLED)

    @property
    def allows_rollback(self) -> bool:
        """True where the old values can be put back at once: devices and store can be reached, nobody wants a halt."""
        return self not in _HALTING


_HALTING: Final = frozenset(
    {
        Cause.BUS_LOST,
        Cause.STORE_FAILED,
        Cause.TOOL_ENDED,
        Cause.DEFECT,
        Cause.OTHER_DEVICE,
        Cause.OTHER_FIRMWARE,
        Cause.OVERTAKEN,
        Cause.NOT_FIT,
    }
)


class Broken(Exception):  # noqa: N818 - no error of the tool: how one part of a restore tells another that it ended
    """The restore cannot go on. ``error`` where the bus or the device gave one."""

    def __init__(self, cause: Cause, device: str = "", error: HubsideError | None = None, **details: Any) -> None:
        super().__init__(cause.value)
        self.cause = cause
        self.device = device
        self.error = error
        self.details = details

    def as_error(self, station: str) -> HubsideError:
        """For whoever ordered the restore."""
        if self.error is not None:
            return self.error
        details = {"cause_key": self.cause.text_key, **self.details}
        if "objection_key" in details:
            details["cause_key"] = details.pop("objection_key")
        return RestoreBrokenError(**{**details, "station": station, "device": self.device})

    @classmethod
    def by(cls, refusals: Iterable[Refusal]) -> Broken | None:
        """Because of the first of ``refusals``; None where there is none."""
        first = next(iter(refusals), None)
        if first is None:
            return None
        return cls(Cause.NOT_FIT, first.device, None, **{**first.details, "objection_key": first.objection.text_key})
