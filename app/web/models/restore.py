"""Types of restores: what is asked for, the plan with what speaks against it, and how a restore stands."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.service.views import RawJson
from app.web.models import Failure
from app.web.models.visits import Remark, WorkOrder

Slug = Annotated[str, Field(max_length=200)]
StepKindName = Literal["write", "auxiliary", "confirm", "save", "restart", "prove"]
EndName = Literal["new", "old", "incomplete", "given-up"]
WayName = Literal["confirm", "roll-back", "resume", "unproven", "give-up"]
StateName = Literal[
    "writing",
    "awaiting-confirmation",
    "saving",
    "restarting",
    "proving",
    "done",
    "rolling-back",
    "rolled-back",
    "incomplete",
    "given-up",
]


class RestorePlace(BaseModel):
    """One object of one device."""

    model_config = ConfigDict(extra="forbid")

    device: Slug
    address: Annotated[str, Field(max_length=20)]


class RestorePlanRequest(BaseModel):
    """Which sets (ids of records, or at least 8 digits of a hash) ``station`` is to have; one a device.

    A set of the same device goes to it, any other to the device of its kind; ``motor:ID@VERSION:DEVICE`` stands for the
    set of what a motor puts into its drive. ``selected`` null takes everything that may be taken. ``restart``: a
    restart of the devices is agreed to. ``expert``: what only the maker sets is restored too; that needs the role, and
    ``other_blades_confirmed`` (the expert answers for blades that are not in feather) and ``accepted`` (rules that may
    stay broken where they are broken already) are refused without it. ``network``: what decides at which address a
    device is found goes along; never together with a restart.
    """

    model_config = ConfigDict(extra="forbid")

    station: Slug
    sets: Annotated[list[Annotated[str, Field(max_length=300)]], Field(min_length=1, max_length=20)]
    selected: Annotated[list[RestorePlace], Field(max_length=5_000)] | None = None
    restart: bool = False
    expert: bool = False
    other_blades_confirmed: bool = False
    network: bool = False
    accepted: Annotated[list[Annotated[str, Field(max_length=100)]], Field(max_length=100)] = []


class RestoreRequest(RestorePlanRequest):
    """The same once more, with the hash of the plan that was looked at; another plan is not begun.

    ``confirm_s``: how long the person has to confirm once all is written; then all is rolled back.
    """

    plan_hash: Annotated[str, Field(min_length=64, max_length=64)]
    reason: Remark = ""
    work_order: WorkOrder = ""
    confirm_s: Annotated[float, Field(ge=5, le=3_600)] = 300


class GiveUpRequest(BaseModel):
    """Why a restore is closed although the station may hold old and new values."""

    model_config = ConfigDict(extra="forbid")

    reason: Annotated[str, Field(min_length=3, max_length=500, pattern=r"\S")]


class RestoreRefusal(BaseModel):
    """One reason against it; ``device`` is empty where it is about all."""

    code: str
    text_key: str
    device: str
    details: dict[str, str]


class RestorePlanRow(BaseModel):
    """One object of the set, or of the device. ``why_key`` says why it is not restored, where it is skipped."""

    device: str
    address: str
    name: str
    group: str
    restore_class: Literal["copy", "unit", "factory", "network", "never"] | None
    save_category: str | None
    unit: str
    treatment: Literal["write", "equal", "skip"]
    why: str | None
    why_key: str | None
    details: dict[str, str]
    now_raw: RawJson | None
    wanted_raw: RawJson | None
    now_shown: str | None
    wanted_shown: str | None


class RestorePlanStep(BaseModel):
    """One step; ``device`` is empty for the confirmation. ``category``: what a save keeps, null for all."""

    kind: StepKindName
    device: str
    category: str | None
    address: str | None
    name: str | None
    shown: str | None


class RestoreFinding(BaseModel):
    """What a rule says of the station. The text is ``rule.<rule>.broken`` or ``rule.not_checked``.

    ``is_new``: it is not broken in the station as it is now; only of what is broken.
    """

    rule: str
    severity: Literal["error", "warning", "note"]
    verdict: Literal["broken", "not-checked"]
    is_new: bool
    places: list[RestorePlace]
    details: dict[str, Any]


class RestoreSource(BaseModel):
    """The set that a device is to have, and where it comes from."""

    device: str
    record: str
    hash: str
    from_device: str
    time: str
    person: str
    same_unit: bool


class RestorePlanDoc(BaseModel):
    """A plan. It can be begun where nothing is refused; ``hash`` names all that a person agrees to.

    ``findings``: what the rules say of the station as it will be; ``blockers``: those of them that forbid it;
    ``mended``: what is broken now and will not be any more. ``by_hand``: devices without a restart command.
    """

    station: str
    hash: str
    refusals: list[RestoreRefusal]
    sources: list[RestoreSource]
    rows: list[RestorePlanRow]
    steps: list[RestorePlanStep]
    needs: dict[str, list[Literal["axis-disabled", "homing-mode"]]]
    by_hand: list[str]
    restarts: list[str]
    findings: list[RestoreFinding]
    blockers: list[RestoreFinding]
    mended: list[RestoreFinding]
    unordered: list[RestorePlace]


class RestoreHead(BaseModel):
    """One restore in short. ``end`` null: it is worked on. ``cause_key``: why it did not go on."""

    id: str
    turbine: str
    station: str
    state: StateName
    end: EndName | None
    person: str
    reason: str
    work_order: str
    started_ns: int
    ended_ns: int | None
    cause_key: str | None


class RestoreValue(BaseModel):
    """One object that the restore answers for. ``written``: it was, by the last step that touched it."""

    device: str
    address: str
    name: str
    save_category: str | None
    unit: str
    before_raw: RawJson
    wanted_raw: RawJson
    before_shown: str
    wanted_shown: str
    state: Literal["equal", "waiting", "intended", "done", "failed", "unknown"]
    written: Literal["wanted", "before"] | None


class RestoreStepDoc(BaseModel):
    """One step as it was begun, and what became of it. ``category``: what a save keeps, null for all."""

    n: int
    category: str | None
    direction: Literal["forward", "resume", "back"]
    kind: StepKindName
    device: str
    address: str | None
    shown: str | None
    state: Literal["intended", "done", "failed", "unknown"]
    begun_ns: int
    ended_ns: int | None
    error: Failure | None


class RestoreDoc(RestoreHead):
    """A restore with all its values and steps.

    ``left_s``: how long the person still has to confirm; null where that is not awaited. ``proven``: by a restart;
    where it is false at the end, the values are saved and not yet proven by one. ``switching``: the device that
    somebody is to switch off and on now, for ``switch_left_s`` seconds at most. ``done`` of ``total`` steps of the
    way that runs. ``blocks``: writes, saves and restarts of the station are refused. ``can``: what a person may order.
    """

    running: bool
    left_s: float | None
    switching: str | None
    switch_left_s: float | None
    confirm_s: float | None
    confirmed_by: str | None
    proven: bool
    restart: bool
    done: int
    total: int
    blocks: bool
    can: list[WayName]
    cause_device: str | None
    cause_details: dict[str, str]
    error: Failure | None
    values: list[RestoreValue]
    steps: list[RestoreStepDoc]
    undo: dict[str, str]
    """Ids of the records with the values before, by device."""
