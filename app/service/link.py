"""What the page is told of the link: bus, load, recording, other masters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Final, Literal, Protocol

from app.drivers.contract import TWIN_NAME, DriverStatus, LinkState
from app.model.address import Address
from app.recording.writer import RecorderState, RecorderStatus
from app.service.bus_feed import BusFeed
from app.service.devices import Target

DEVICE_NAME: Final = Address(0x1008)

Mode = Literal["live", "twin", "none", "replay"]
LinkName = Literal["connected", "lost", "disconnected"]

_LINK: Final[Mapping[LinkState, LinkName]] = {
    LinkState.CONNECTED: "connected",
    LinkState.LISTENING: "connected",
    LinkState.LOST: "lost",
    LinkState.CLOSED: "disconnected",
}
_WORST_FIRST: Final = (LinkState.LOST, LinkState.CLOSED, LinkState.LISTENING, LinkState.CONNECTED)


class Bus(Protocol):
    """What is needed of one bus of a connection."""

    @property
    def bitrate(self) -> int:
        """In bit/s."""

    @property
    def adapter(self) -> str:
        """Interface and channel."""

    @property
    def frames(self) -> int:
        """Frames since the connection was opened."""

    @property
    def status(self) -> DriverStatus:
        """State of the link."""

    @property
    def needs_consent(self) -> bool:
        """Nothing is sent before somebody consents, because another master is there."""

    def bus_load(self, now_ns: int) -> float:
        """Load of the last second, 0..1."""

    def says_twin(self, node: int) -> bool | None:
        """Whether ``node`` says by its bus that it is simulated; None where it would say so by its name."""


@dataclass(frozen=True, slots=True)
class RecordingLine:
    """The recording: ``reason`` is a text key, given where it stands still or lost frames."""

    state: Literal["on", "off", "stopped"]
    file: str | None
    since_ns: int | None
    size_bytes: int
    frames: int
    lost: int
    reason: str | None


@dataclass(frozen=True, slots=True)
class MasterLine:
    """Another master on the bus, and by which frame it gave itself away."""

    bus: str
    sign: str
    can_id: int
    t_ns: int
    count: int


@dataclass(frozen=True, slots=True)
class LinkLine:
    """The connection as a whole. With several buses: the state of the worst one, and the highest load."""

    state: LinkName
    reason: str | None
    mode: Mode
    bus: str
    bitrate: int
    load: float
    frames: int
    dropped: int
    recording: RecordingLine
    other_masters: tuple[MasterLine, ...]
    needs_consent: bool


class TwinWatch:
    """Whether all devices of a connection are simulated, by what they say themselves. For one thread.

    ``ours``: this server has started them, so they need not say it.
    A restart makes a device's name unknown until somebody reads it again; until then what it said last is held. It is
    not held over a gap, nor from one connection to the next: another bus may be connected since.
    """

    def __init__(self, targets: Iterable[Target], buses: Mapping[str, Bus], ours: bool = False) -> None:
        self._targets = tuple(targets)
        self._ours = ours
        self._buses = buses
        self._said: dict[str, tuple[bool, int]] = {}

    def all_twins(self) -> bool:
        """True where each device says, or said last, that it is simulated. To be asked a few times a second."""
        statuses = {name: bus.status for name, bus in self._buses.items()}
        answers = [self._is_twin(target, statuses[target.device.bus]) for target in self._targets]
        return self._ours or (bool(answers) and all(answers))

    def _is_twin(self, target: Target, status: DriverStatus) -> bool:
        by_bus = self._buses[target.device.bus].says_twin(target.node)
        view = target.live.value(target.device.bus, target.node, DEVICE_NAME)
        if by_bus is not None:
            self._said[target.slug] = by_bus, status.reconnects
        elif view is not None and view.stale:
            self._said.pop(target.slug, None)
        elif view is not None and view.reading is not None:
            self._said[target.slug] = view.reading.data.startswith(TWIN_NAME.encode()), status.reconnects
        return self._said.get(target.slug) == (True, status.reconnects)


def link_line(buses: Mapping[str, Bus], recording: RecorderStatus | None, twins: bool, now_ns: int) -> LinkLine:
    """The state of the link at ``now_ns``. ``twins``: every device says that it is simulated."""
    known = {name: (bus, bus.status) for name, bus in buses.items()}
    if not known:
        return LinkLine("disconnected", None, "none", "", 0, 0.0, 0, 0, recording_line(recording), (), False)
    name, (bus, status) = min(known.items(), key=lambda item: _WORST_FIRST.index(item[1][1].state))
    masters = tuple(
        MasterLine(each, sign.value, can_id, t_ns, count)
        for each, (_, at) in known.items()
        for sign, can_id, t_ns, count in at.masters
    )
    return LinkLine(
        state=_LINK[status.state],
        reason=status.reason or None,
        mode="twin" if twins else "live",
        bus=name,
        bitrate=bus.bitrate,
        load=round(min(1.0, max(each.bus_load(now_ns) for each, _ in known.values())), 3),
        frames=sum(each.frames for each, _ in known.values()),
        dropped=sum(at.dropped for _, at in known.values()),
        recording=recording_line(recording),
        other_masters=masters,
        needs_consent=any(each.needs_consent for each, _ in known.values()),
    )


def replay_line(buses: Mapping[str, BusFeed], now_ns: int) -> LinkLine:
    """The bus as it was at ``now_ns`` of a recording. Of several buses the one with the highest load."""
    loads = {name: bus.bus_load(now_ns) for name, bus in buses.items()}
    name = max(loads, key=lambda one: loads[one], default="")
    return LinkLine(
        state="connected",
        reason=None,
        mode="replay",
        bus=name,
        bitrate=buses[name].bitrate if name else 0,
        load=round(min(1.0, loads.get(name, 0.0)), 3),
        frames=sum(bus.frames for bus in buses.values()),
        dropped=0,
        recording=recording_line(None),
        other_masters=(),
        needs_consent=False,
    )


class Served(Protocol):
    """What is needed of a bench."""

    @property
    def stamper(self) -> Callable[[], int]:
        """Time of the bench, in ns."""

    @property
    def connection(self) -> Connected | None:
        """The connection while there is one."""

    @property
    def twins(self) -> TwinWatch | None:
        """Whether its devices are simulated."""


class Connected(Protocol):
    """What is needed of a connection."""

    @property
    def buses(self) -> Mapping[str, Bus]:
        """Its buses by name."""

    @property
    def recording(self) -> Recorded | None:
        """Its recording, where it is recorded."""


class Recorded(Protocol):
    """What is needed of a recording."""

    def status(self) -> RecorderStatus:
        """What the recorder does."""


def bench_line(bench: Served) -> LinkLine:
    """The state of the link now; without a connection a line that says so."""
    now_ns = bench.stamper()
    connection = bench.connection
    if connection is None or bench.twins is None:
        return link_line({}, None, False, now_ns)
    recording = None if connection.recording is None else connection.recording.status()
    return link_line(connection.buses, recording, bench.twins.all_twins(), now_ns)


def link_urgent(line: LinkLine) -> tuple[object, ...]:
    """The part of the line whose change must be told at once; counters and load are not in it."""
    recording = (line.recording.state, line.recording.reason, line.recording.lost, line.recording.file)
    signs = tuple((master.bus, master.sign, master.can_id) for master in line.other_masters)
    return (line.state, line.reason, line.mode, line.dropped, recording, signs, line.needs_consent)


def recording_line(status: RecorderStatus | None) -> RecordingLine:
    """What the recorder does; None where nothing is recorded."""
    if status is None:
        return RecordingLine("off", None, None, 0, 0, 0, None)
    state: Literal["on", "stopped"] = "on" if status.state is RecorderState.RECORDING else "stopped"
    reason = None if status.reason is None else f"recording_stopped.{status.reason.value}"
    file = None if status.file is None else str(status.file)
    return RecordingLine(state, file, status.since_ns, status.size_bytes, status.frames, status.lost, reason)
