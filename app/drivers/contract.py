"""What every driver can do: one small contract for all buses, tested by ``tests/drivers/contract_suite.py``.

What a driver returns is for its caller. Screens and recordings rest on the frames alone (``subscribe``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final, NamedTuple, Protocol

from app.errors import HubsideError
from app.model.address import Address
from app.model.description import Verify
from app.wire.frame import Frame

TWIN_NAME: Final = "HUBSIDE TWIN"
"""With this a twin's device name begins."""

FramesCallback = Callable[[list[Frame]], None]
"""Called on the driver's own thread with frames in order, ours included; must not block. The list is the callback's."""
ProgressCallback = Callable[[int, int], None]
"""Called in the caller's event loop with done and total, at most 20 times a second and once at the end."""


class LinkState(Enum):
    """``LISTENING``: connected, nothing is sent yet. ``LOST``: gone, and opened again as soon as it can be."""

    CLOSED = "closed"
    LISTENING = "listening"
    CONNECTED = "connected"
    LOST = "lost"


class Written(Enum):
    """How a write is known to have succeeded: by its acknowledge, or, after a time-out, by reading back."""

    ACKNOWLEDGED = "acknowledged"
    READ_BACK = "read_back"


class MasterSign(Enum):
    """By what another master on the bus gave itself away."""

    SDO_REQUEST = "sdo_request"
    NMT_COMMAND = "nmt_command"
    SYNC = "sync"
    TIME_STAMP = "time_stamp"
    RPDO = "rpdo"
    NODE_GUARDING = "node_guarding"

    @property
    def text_key(self) -> str:
        """Text key of what was seen."""
        return f"master_sign.{self.value}"


class MasterSeen(NamedTuple):
    """A frame that only another master sends; ``t_ns`` is when it was seen last, ``times`` how often."""

    sign: MasterSign
    can_id: int
    t_ns: int
    times: int


class DriverStatus(NamedTuple):
    """State of the link since ``t_ns`` and why; ``dropped`` frames were lost before we could read them."""

    bus: str
    state: LinkState
    t_ns: int
    reason: str
    dropped: int
    reconnects: int
    masters: tuple[MasterSeen, ...]


@dataclass(frozen=True, slots=True)
class Identity:
    """The identity object (CiA 301, 7.5.2.19); None where the device has no such number."""

    vendor: int | None = None
    product: int | None = None
    revision: int | None = None
    serial: int | None = None


@dataclass(frozen=True, slots=True)
class FoundNode:
    """A device that a scan found; None where it does not say. ``description_id`` None: no description matches."""

    node: int
    device_type: int | None
    device_name: str | None
    hardware: str | None
    software: str | None
    identity: Identity
    description_id: str | None

    @property
    def is_twin(self) -> bool:
        """True where the device says that it is simulated."""
        return self.device_name is not None and self.device_name.startswith(TWIN_NAME)


class OrderStanding(NamedTuple):
    """Whether it is proven in which order the bytes of process data come, and the text key of why not."""

    proven: bool
    reason_key: str


class Driver(Protocol):
    """How devices of one bus are asked. All waits end: by ``timeout_s``, or by the object's own time-out where None.

    Errors: BusLostError, BusOpenError, NoAnswerError, SdoAbortError or another DeviceError, ConsentError, RefusedError.
    Cancelling a call ends its transfer; what was written by then stays written.
    """

    bus: str

    @property
    def ends_when_silent(self) -> bool:
        """Whether ``read_many`` asks no further where a device has fallen silent."""

    @property
    def ends_with_restart(self) -> bool:
        """Whether a restart of a device ends the connection to it, which is then opened again."""

    @property
    def restarts_by_hand(self) -> bool:
        """Whether ``restart`` sends nothing, and waits for somebody who switches the device off and on."""

    async def connect(self, timeout_s: float = 5.0) -> None:
        """Open the bus and listen before anything is sent. Raises BusOpenError."""

    async def close(self, timeout_s: float = 5.0) -> None:
        """End all that runs and close the bus."""

    async def read(self, node: int, address: Address, timeout_s: float | None = None, urgent: bool = False) -> bytes:
        """One object as bytes of the wire. ``urgent``: see ``write``."""

    async def read_many(
        self,
        node: int,
        addresses: Iterable[Address],
        timeout_s: float | None = None,
        on_progress: ProgressCallback | None = None,
        urgent: bool = False,
    ) -> dict[Address, bytes | HubsideError]:
        """Many objects of one node, in order: a value or the error of each. Several nodes may be read at a time."""

    async def write(
        self,
        node: int,
        address: Address,
        data: bytes,
        timeout_s: float | None = None,
        verify: Verify = Verify.EQUAL,
        urgent: bool = False,
        known: int | None = None,
    ) -> Written:
        """Write once. Without an answer the object is read, and that decides where ``verify`` is EQUAL.

        ``urgent`` goes before all that waits for the node, interrupts what runs, and needs no consent (STOP).
        ``known``: what ``commanded`` said when the write was decided on; where an urgent one has come since, nothing
        is sent (OvertakenError). Raises UnverifiedError where it was sent and its outcome is open or another than
        wanted.
        """

    def commanded(self, node: int, address: Address) -> int:
        """How many urgent commands went to the object so far."""

    async def save(self, node: int, category: str | None = None) -> tuple[int, int] | None:
        """Make the values of ``category`` (None: all) non-volatile by the device's own command, and wait for its end.

        Gives the date and time that the save bears, where the device keeps them (``bears``). Raises UsageError (it has
        no such command), UnverifiedError, and what reads and writes raise; a driver may refuse (PreconditionError).
        """

    async def bears(self, node: int, stamp: tuple[int, int]) -> bool:
        """Whether the device holds the stamp of a save: after a restart, whether that save is in force."""

    async def restart(self, node: int, timeout_s: float = 10.0) -> None:
        """Restart the device and wait until it says that it is back. Raises NoAnswerError."""

    async def scan(
        self, nodes: Sequence[int] | None = None, on_progress: ProgressCallback | None = None
    ) -> list[FoundNode]:
        """Find and identify the devices."""

    def says_twin(self, node: int) -> bool | None:
        """Whether ``node`` says by its bus that it is simulated; None: by its name (1008h), or not at all."""

    def subscribe(self, callback: FramesCallback) -> Callable[[], None]:
        """Have every frame handed to ``callback``; the returned function ends that."""

    @property
    def status(self) -> DriverStatus:
        """The present state of the link."""
