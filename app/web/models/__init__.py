"""The types of the HTTP API and of the socket. The page's types are generated from these."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, StrictFloat, StrictInt, StrictStr

from app.service.cylinder_view import CylindersLine
from app.service.instructor import InstructorLine
from app.service.link import LinkLine, Mode
from app.service.motion.line import MotionLine
from app.service.rotor_view import RotorLine
from app.service.shown import CursorLine
from app.service.trace.tail import TraceBatch
from app.service.views import AxisLine, EventLine, NodeLine, RawJson, ValueCell
from app.web.models.trace import TraceFilter

RoleName = Literal["viewer", "technician", "expert"]
Language = Literal["en", "de"]
API_VERSION: Literal[1] = 1


class Problem(BaseModel):
    """What went wrong (RFC 9457). ``text`` is the operator's text in the language that was asked for (Accept-Language).

    It is made of ``text_key`` and ``details``; ``device_state`` is a text key.
    """

    type: str
    title: str
    status: int
    code: str
    text: str
    text_key: str
    details: dict[str, Any]
    device_state: str | None


class Session(BaseModel):
    """Who is served, and in which languages. ``user`` is null where a launch token opened the session.

    ``login_needed``: users exist, so nobody gets in without a login.
    """

    version: str
    role: RoleName
    person: str
    user: str | None
    login_needed: bool
    languages: list[Language]
    locale: Language


class DeviceRef(BaseModel):
    """One device: ``slug`` is its whole path, ``axis`` tells whether it has a controlword.

    ``verifies``: its description can be held against it now, for its bus gives the list of its objects.
    """

    slug: str
    node: int
    description_id: str
    name: str
    axis: bool
    verifies: bool


class StationRef(BaseModel):
    """A blade, or a bench (``blade`` null)."""

    slug: str
    name: str
    blade: int | None
    devices: list[DeviceRef]


class BusRef(BaseModel):
    """The bus; ``interface`` is the adapter as it was named."""

    name: str
    bitrate: int
    interface: str


class Turbine(BaseModel):
    """The connected turbine."""

    slug: str
    name: str
    mode: Mode
    bus: BusRef
    stations: list[StationRef]


class KnownTurbine(BaseModel):
    """A turbine of the site file; ``buses`` are the adapters that it is reached by, ``blades`` how many it has."""

    slug: str
    name: str
    buses: list[str]
    blades: int
    connected: bool


class ConnectRequest(BaseModel):
    """``turbine`` is the slug of one that is known."""

    model_config = ConfigDict(extra="forbid")

    turbine: Annotated[str, Field(max_length=200)]


class ReadRequest(BaseModel):
    """``addresses`` null reads all readable objects."""

    addresses: Annotated[list[str], Field(max_length=5_000)] | None = None


class WriteRequest(BaseModel):
    """``raw``: a number, a text, or octets as hexadecimal digits.

    ``address_confirmed``: the person knows that the device will be found at another network address.
    """

    model_config = ConfigDict(extra="forbid")

    address: str
    raw: StrictInt | StrictFloat | Annotated[StrictStr, Field(max_length=60_000)]
    address_confirmed: bool = False


class Nothing(BaseModel):
    """An empty object: the request needs nothing more."""


class Press(BaseModel):
    """Which STOP or FEATHER of which page, counted by the page; nulls where nobody counts.

    The same may come by a request and over the socket: it is done once, and after a later one of the page not at all.
    """

    page: Annotated[str, Field(min_length=1, max_length=64)] | None = None
    number: Annotated[int, Field(ge=1, le=2**53)] | None = None


class Failure(BaseModel):
    """What did not succeed, and why. ``address`` is empty where it is about the whole job."""

    address: str
    code: str
    text_key: str
    details: dict[str, Any]


class JobRowDoc(BaseModel):
    """One object of a job that writes.

    ``was_raw`` and ``read_raw`` are what RAM held before and after. "unproven": acknowledged, but only an effect would
    prove it; "not_saved": verified in RAM, but the save was not acknowledged.
    """

    device: str
    address: str
    state: Literal["waiting", "sent", "verified", "unproven", "saving", "saved", "refused", "not_saved"]
    was_raw: RawJson | None
    read_raw: RawJson | None
    error: Failure | None


class JobDoc(BaseModel):
    """Work that runs in the background. ``error`` says why it failed as a whole; ``rows`` are those of a write."""

    id: str
    kind: str
    device: str
    state: Literal["running", "done", "failed", "cancelled"]
    done: int
    total: int
    failed: list[Failure]
    error: Failure | None
    rows: list[JobRowDoc]


class WriteDone(BaseModel):
    """A write that was verified, or whose description proves it by other means (``verified`` false)."""

    address: str
    sent_raw: RawJson
    read_raw: RawJson | None
    verified: bool
    was_raw: RawJson | None
    t_ns: int


class SaveRequest(BaseModel):
    """``category``: what of the device is saved, one of its description's ``save``; null saves all."""

    model_config = ConfigDict(extra="forbid")

    category: Annotated[str, Field(max_length=40)] | None = None


class SaveDone(BaseModel):
    """The device acknowledged the save, and says that it has ended. Not proven before a restart."""

    t_ns: int
    took_s: float
    category: str | None


class RestartDone(BaseModel):
    """The device has booted again.

    ``proven``: whether the last save before it is in force, by its date and time (1020h); null where the device keeps
    none, or no save of it was seen. Values are proven when they are read.
    """

    boot_up_t_ns: int
    took_s: float
    proven: bool | None


class AxisDone(BaseModel):
    """STOP or FEATHER at one axis. ``confirmed_t_ns`` null: sent, and nothing more is known."""

    device: str
    sent_t_ns: int
    confirmed_t_ns: int | None
    how: Literal["rpdo", "sdo", "replaced", "failed"]
    error: Failure | None


class StopDone(BaseModel):
    """STOP or FEATHER at all axes."""

    axes: list[AxisDone]


# -- the socket ----------------------------------------------------------------------


class Hello(BaseModel):
    """The first message of a connection."""

    version: str
    server_t_ns: int


class ValuesData(BaseModel):
    """Objects of one device by address. ``full``: these are all, drop what was known before."""

    device: str
    full: bool
    values: dict[str, ValueCell]


class _Envelope(BaseModel):
    """``ctx`` is ``live``, or ``replay/`` and the name of a recording; ``seq`` counts the messages of one context.

    ``t_ns`` is the time that is shown: of the bench when it was sent, or of the recording at its cursor.
    """

    model_config = ConfigDict(json_schema_serialization_defaults_required=True)

    v: Literal[1] = API_VERSION
    ctx: str = "live"
    seq: int
    t_ns: int


class HelloMessage(_Envelope):
    """The connection stands."""

    type: Literal["hello"] = "hello"
    data: Hello


class HeartbeatMessage(_Envelope):
    """Nothing new, but the bench is there. Every quarter of a second."""

    type: Literal["heartbeat"] = "heartbeat"
    data: Nothing = Nothing()


class LinkMessage(_Envelope):
    """Topic ``link``: once a second, and at once where the state changes."""

    type: Literal["link"] = "link"
    data: LinkLine


class VisitRef(BaseModel):
    """The open visit; ``started_ns`` is in t_ns."""

    id: str
    person: str
    started_ns: int


class BenchData(BaseModel):
    """What is connected; ``epoch`` is raised with every connection that is made or ended."""

    epoch: int
    turbine: str | None
    visit: VisitRef | None


class BenchMessage(_Envelope):
    """Always, first and whenever it changes: all that was told of another connection is void."""

    type: Literal["bench"] = "bench"
    data: BenchData


class NodesMessage(_Envelope):
    """Topic ``nodes``: all devices, where one changed."""

    type: Literal["nodes"] = "nodes"
    data: tuple[NodeLine, ...]


class AxesMessage(_Envelope):
    """Topic ``axes``: all blades, where one changed, at most 20 times a second and at least once."""

    type: Literal["axes"] = "axes"
    data: tuple[AxisLine, ...]


class RotorMessage(_Envelope):
    """Topic ``rotor``: rotor and wind, where they changed, at most twice a second."""

    type: Literal["rotor"] = "rotor"
    data: RotorLine


class CylindersMessage(_Envelope):
    """Topic ``cylinders``: hydraulic cylinders by station, where they changed, at most 20 times a second."""

    type: Literal["cylinders"] = "cylinders"
    data: tuple[CylindersLine, ...]


class InstructorMessage(_Envelope):
    """Topic ``instructor``: faults and scenario of the twins that this server started, where they changed."""

    type: Literal["instructor"] = "instructor"
    data: InstructorLine


class MotionMessage(_Envelope):
    """Topic ``motion``: who may move the axes, what is prepared and under way, where it changed."""

    type: Literal["motion"] = "motion"
    data: MotionLine


class ValuesMessage(_Envelope):
    """Topic ``values:<slug>``: all that is known, then what changed."""

    type: Literal["values"] = "values"
    data: ValuesData


class EventMessage(_Envelope):
    """Topic ``events``: the latest hundreds, then each as it comes."""

    type: Literal["event"] = "event"
    data: EventLine


class TraceMessage(_Envelope):
    """Topic ``trace``: ten times a second while it is subscribed, with as many rows as a page can show."""

    type: Literal["trace"] = "trace"
    data: TraceBatch


class CursorMessage(_Envelope):
    """Topic ``cursor``: where a replay stands, where it moved, at most 50 times a second."""

    type: Literal["cursor"] = "cursor"
    data: CursorLine


class GoneMessage(_Envelope):
    """The replay ``ctx`` is not open, or no longer: open it again to hear of it."""

    type: Literal["gone"] = "gone"
    data: Nothing = Nothing()


class UrgentTold(BaseModel):
    """Of the STOP or FEATHER of that number: first that it is ``taken``, then its end; not taken: ask by a request."""

    number: int
    taken: bool
    done: StopDone | None


class UrgentMessage(_Envelope):
    """The answers to a STOP or FEATHER that came over this socket."""

    type: Literal["urgent"] = "urgent"
    data: UrgentTold


ServerMessage = Annotated[
    HelloMessage
    | BenchMessage
    | HeartbeatMessage
    | LinkMessage
    | NodesMessage
    | AxesMessage
    | RotorMessage
    | CylindersMessage
    | InstructorMessage
    | MotionMessage
    | ValuesMessage
    | EventMessage
    | TraceMessage
    | CursorMessage
    | GoneMessage
    | UrgentMessage,
    Field(discriminator="type"),
]
"""What the socket sends."""


class Subscribe(BaseModel):
    """What the page wants to hear of a context; replaces what it wanted before of it.

    ``trace`` is the filter of the topic ``trace``.
    """

    model_config = ConfigDict(extra="forbid")

    type: Literal["subscribe"]
    ctx: Annotated[str, Field(max_length=300)] = "live"
    topics: Annotated[list[Annotated[str, Field(max_length=200)]], Field(max_length=200)]
    trace: TraceFilter | None = None


class Beat(BaseModel):
    """The dead man: a page that has the lease says that it is there, and whether its person holds what moves an axis.

    ``fence`` is the number of the lease, ``number`` rises with each beat, ``order`` is that of what is held,
    ``sent_ms`` the page's own clock when the beat left it: by it the server knows a line that grows slower.
    """

    model_config = ConfigDict(extra="forbid")

    type: Literal["beat"]
    page: Annotated[str, Field(min_length=1, max_length=64)]
    fence: int
    number: int
    holding: bool
    order: int = 0
    sent_ms: Annotated[float, Field(ge=0, allow_inf_nan=False)]


class Urgent(BaseModel):
    """STOP or FEATHER to every axis, or to that of ``device``; ``urgent`` of the same ``number`` answers.

    ``page`` and ``number`` as in ``Press``. Here as well as by a request: a browser has six connections to a server,
    and where each of them waits for the end of something long, a request waits until one is free.
    """

    model_config = ConfigDict(extra="forbid")

    type: Literal["urgent"]
    command: Literal["stop", "feather"]
    page: Annotated[str, Field(min_length=1, max_length=64)]
    number: Annotated[int, Field(ge=1, le=2**53)]
    device: Annotated[str, Field(max_length=200)] | None = None


ClientMessage = Annotated[Subscribe | Beat | Urgent, Field(discriminator="type")]
"""What the socket takes."""
