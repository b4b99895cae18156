"""The types of the settings: adapters, the site file, what is polled."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.model.site import HEARTBEAT_NODE
from app.model.slaves import MASTER, MAX_SLAVE
from app.web.models import Failure

Slug = Annotated[str, Field(max_length=60, pattern=r"^[a-z0-9]+(-[a-z0-9]+)*$")]
Short = Annotated[str, Field(max_length=200)]
Bitrate = Annotated[int, Field(ge=9_600, le=12_000_000)]
"""On CAN 10 kbit/s to 1 Mbit/s, on PROFIBUS 9.6 kbit/s to 12 Mbit/s: which of them, the connection says."""
Node = Annotated[int, Field(ge=1, le=247)]
"""On Modbus TCP up to 247, on CAN up to 127, on PROFIBUS up to 126: the site file knows which bus it is."""
Master = Annotated[int, Field(ge=1, le=MAX_SLAVE)]
RateName = Literal["fast", "slow", "rare"]
VerdictName = Literal["listening", "fits", "errors", "silent"]
HealthName = Literal["ok", "no_driver", "failed", "timed_out", "unsupported"]


# -- adapters -------------------------------------------------------------------------


class AdapterDoc(BaseModel):
    """An adapter. ``connection`` is INTERFACE:CHANNEL; ``bitrates`` empty: any of CiA 301 is offered."""

    connection: str
    interface: str
    title: str
    silent: bool
    sets_bitrate: bool
    bitrates: list[int]
    found: bool
    turbines: list[str]
    in_use: bool


class PlaceDoc(BaseModel):
    """One kind of adapter, and how the look for it ended."""

    interface: str
    health: HealthName
    reason: str
    found: int


class AdaptersDoc(BaseModel):
    """All adapters that are known, and where they were looked for."""

    adapters: list[AdapterDoc]
    places: list[PlaceDoc]


class TestRequest(BaseModel):
    """``sure``: the bit rate is known, so an adapter without a silent mode may listen at it."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"connection": "socketcan:can0"}]})

    connection: Short
    bitrate: Bitrate = 500_000
    sure: bool = False


class SearchRequest(BaseModel):
    """Which adapter."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"connection": "slcan:/dev/ttyACM0"}]})

    connection: Short


class ScanRequest(BaseModel):
    """``consent``: ask the devices although another master is on the bus. ``master``: our own address on PROFIBUS."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"connection": "socketcan:can0"}]})

    connection: Short
    bitrate: Bitrate = 500_000
    consent: bool = False
    master: Master = MASTER


class IdentifyRequest(BaseModel):
    """One address of Modbus TCP, HOST[:PORT][/UNIT]; a bus of the site must allow it."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"address": "192.168.2.20"}]})

    address: Short


class IdentifiedDoc(BaseModel):
    """The device at an address, as it says itself; null where it does not say. ``twin``: it is simulated."""

    address: str
    description_id: str | None
    variant: str | None
    device_name: str | None
    hardware: str | None
    software: str | None
    serial: str | None
    twin: bool


class MasterDoc(BaseModel):
    """Another master, by the frame that gave it away."""

    sign: str
    can_id: int
    times: int


class HeardDoc(BaseModel):
    """What a test has heard so far; ``load`` 0..1."""

    connection: str
    bitrate: int
    shared: bool
    silent: bool
    heard_s: float
    frames: int
    errors: int
    frames_per_s: float
    load: float
    nodes: list[int]
    masters: list[MasterDoc]
    verdict: VerdictName


class RateTriedDoc(BaseModel):
    """One bit rate of a search."""

    bitrate: int
    frames: int
    errors: int


class SearchDoc(BaseModel):
    """A search for the bit rate so far."""

    connection: str
    rates: list[int]
    tried: list[RateTriedDoc]
    trying: int | None
    bitrate: int | None


class FoundDoc(BaseModel):
    """A device that answered, and where it might belong; null where it does not say."""

    node: int
    device_type: int | None
    device_name: str | None
    hardware: str | None
    software: str | None
    vendor: int | None
    product: int | None
    revision: int | None
    serial: int | None
    description_id: str | None
    twin: bool
    station: str
    blade: int | None
    device: str


class ScanDoc(BaseModel):
    """What a scan found."""

    connection: str
    bitrate: int
    found: list[FoundDoc]


class SettingsJobDoc(BaseModel):
    """Work on an adapter or an address.

    One of ``heard``, ``search``, ``scan`` and ``identified`` is given as soon as there is anything to tell.
    """

    id: str
    kind: str
    state: Literal["running", "done", "failed", "cancelled"]
    done: int
    total: int
    error: Failure | None
    heard: HeardDoc | None
    search: SearchDoc | None
    scan: ScanDoc | None
    identified: IdentifiedDoc | None


# -- the site -------------------------------------------------------------------------


class BusDoc(BaseModel):
    """A bus of a turbine; ``bitrate`` 0: the connection names it.

    ``heartbeat_node``: as whom this tool beats on it while axes are moved. ``connection`` ``modbus-tcp``: its devices
    have addresses, all within ``ranges``; it has no bit rate (0) then. ``profibus:PORT`` is a line of PROFIBUS-DP, on
    which ``master`` is our own address.
    """

    model_config = ConfigDict(extra="forbid")

    name: Slug
    connection: Short
    bitrate: Annotated[int, Field(ge=0, le=12_000_000)]
    heartbeat_node: Annotated[int, Field(ge=1, le=127)] = HEARTBEAT_NODE
    ranges: Annotated[list[Annotated[str, Field(max_length=100)]], Field(max_length=64)] = []
    master: Master = MASTER


class SiteDeviceDoc(BaseModel):
    """A device; ``slug`` is its own part of the path.

    ``address`` (HOST[:PORT][/UNIT]) is where it listens on Modbus TCP. ``external_stop`` says what stops this axis from
    outside where its bus cannot prove that it stops by itself; experts change it. ``telegram`` (null: the one it is set
    to), ``pzd_order`` (``high-high`` and the like, empty: not known), ``gsd`` and ``modules`` are of PROFIBUS-DP.
    """

    model_config = ConfigDict(extra="forbid")

    slug: Slug
    name: Short
    description_id: Short
    bus: Slug
    node: Node
    address: Short = ""
    external_stop: Short = ""
    telegram: Annotated[int, Field(ge=1, le=999)] | None = None
    pzd_order: Annotated[str, Field(max_length=20)] = ""
    gsd: Short = ""
    modules: Annotated[list[Short], Field(max_length=64)] = []


class SiteStationDoc(BaseModel):
    """A blade (1 to 3) or a bench (null); ``slug`` is its own part of the path."""

    model_config = ConfigDict(extra="forbid")

    slug: Slug
    name: Short
    blade: Annotated[int, Field(ge=1, le=3)] | None
    devices: Annotated[list[SiteDeviceDoc], Field(max_length=127)]


class SiteTurbineDoc(BaseModel):
    """A turbine of the site file."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [
                {
                    "slug": "wtg-08",
                    "name": "WTG-08",
                    "buses": [{"name": "can0", "connection": "socketcan:can0", "bitrate": 500_000}],
                    "stations": [
                        {
                            "slug": "blade-1",
                            "name": "blade 1",
                            "blade": 1,
                            "devices": [
                                {
                                    "slug": "pmm",
                                    "name": "PMM",
                                    "description_id": "oat-pmm",
                                    "bus": "can0",
                                    "node": 1,
                                }
                            ],
                        }
                    ],
                }
            ]
        },
    )

    slug: Slug
    name: Short
    buses: Annotated[list[BusDoc], Field(max_length=16)]
    stations: Annotated[list[SiteStationDoc], Field(max_length=64)]


class DescriptionRef(BaseModel):
    """A description that devices of a bus of this kind may name."""

    id: str
    name: str
    bus: Literal["canopen", "modbus-tcp", "profibus-dp"]


class SiteDoc(BaseModel):
    """The site file. ``made`` false: the first change makes it; ``problem`` (a text key): nothing can be changed."""

    file: str | None
    made: bool
    problem: str | None
    revision: str
    connected: str | None
    turbines: list[SiteTurbineDoc]
    descriptions: list[DescriptionRef]


class TurbineChange(BaseModel):
    """A turbine as it is to be; ``revision`` is that of the file that the person saw."""

    model_config = ConfigDict(extra="forbid")

    revision: Annotated[str, Field(max_length=64)]
    turbine: SiteTurbineDoc


# -- polling --------------------------------------------------------------------------


class PollItem(BaseModel):
    """An object that is read; ``bits`` is what reading it takes on the bus. ``usual`` null: it is not usual."""

    address: str
    name: str
    rate: RateName
    usual: RateName | None
    bits: int


class PollDevice(BaseModel):
    """What is read of one kind of device, and what usually would be."""

    description_id: str
    name: str
    items: list[PollItem]
    usual: list[PollItem]


class PollBus(BaseModel):
    """A bus of a known turbine, and how much of its time polling takes (0..1); ``counts`` of devices by description.

    One without a bit rate (0), as of Modbus TCP, has no such share: null.
    """

    turbine: str
    bus: str
    bitrate: int
    counts: dict[str, int]
    load: float | None


class PollingDoc(BaseModel):
    """The polling list in force."""

    period_s: float
    slow_every: int
    rare_every: int
    load_cap: float
    devices: list[PollDevice]
    buses: list[PollBus]


class PollChoice(BaseModel):
    """An object that can be read."""

    address: str
    name: str
    group: str
    bits: int


class PollingChange(BaseModel):
    """The polling list as it is to be; devices that are not named get the usual list."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [
                {
                    "period_s": 0.1,
                    "slow_every": 10,
                    "rare_every": 100,
                    "load_cap": 0.6,
                    "devices": {"oat-pmm": {"3110:01": "slow"}},
                }
            ]
        },
    )

    period_s: Annotated[float, Field(ge=0.05, le=10)]
    slow_every: Annotated[int, Field(ge=2, le=1000)]
    rare_every: Annotated[int, Field(ge=2, le=1000)]
    load_cap: Annotated[float, Field(ge=0.05, le=0.9)]
    devices: Annotated[
        dict[Annotated[str, Field(max_length=100)], dict[Annotated[str, Field(max_length=12)], RateName]],
        Field(max_length=50),
    ]


# -- about ----------------------------------------------------------------------------


class LibraryDoc(BaseModel):
    """A library that the program is made of."""

    name: str
    version: str
    licence: str


class AboutDoc(BaseModel):
    """The program: its version, where it keeps things, what it is made of."""

    version: str
    python: str
    system: str
    data: str | None
    free_bytes: int | None
    libraries: list[LibraryDoc]
