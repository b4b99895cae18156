"""What the passive decoder says about frames: one small record a fact, each with time, bus and node.

``t_ns`` is that of the frame which made the fact known; node 0 means all nodes, or none in particular.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from app.model.address import Address
from app.wire.frame import Direction
from app.wire.nmt import NmtCommand, NmtState
from app.wire.twin_environment import TwinEnvironment


class Source(Enum):
    """How a value came to be known."""

    SDO_READ = "sdo_read"
    SDO_WRITE = "sdo_write"
    """Written by an acknowledged download; the device may hold something else."""
    PDO_TX = "pdo_tx"
    """Sent by the device."""
    PDO_RX = "pdo_rx"
    """Sent to the device by somebody; never acknowledged."""
    EMCY = "emcy"


class SdoAccess(Enum):
    """What an SDO client did."""

    READ = "read"
    WRITE = "write"


class Protocol(Enum):
    """The SDO protocol used (CiA 301, 7.2.4.2), or the function of Modbus that stands for one."""

    EXPEDITED = "expedited"
    SEGMENTED = "segmented"
    BLOCK = "block"
    OBJECT = "object"
    """One object by Modbus FC 43, an SDO transfer in one message each way."""
    FRAMES = "frames"
    """One of many objects by Modbus FC 103."""
    REGISTERS = "registers"
    """Mapped into registers that were written by Modbus FC 6, 16 or 23."""
    PKW = "pkw"
    """One parameter by the PKW channel of PROFIBUS; an abort code is the error code of that channel."""


class Outcome(Enum):
    """How an SDO transfer ended.

    LOST: nobody ended it, a new transfer, a boot-up or a gap did: what a write did to the device is unknown.
    BROKEN: it was ended properly, but what was seen of it makes no whole.
    """

    DONE = "done"
    ABORTED = "aborted"
    LOST = "lost"
    BROKEN = "broken"


class Side(Enum):
    """Who aborted a transfer."""

    CLIENT = "client"
    SERVER = "server"


class Fault(Enum):
    """Why a frame makes no sense."""

    LENGTH = "length"
    """The data field has a length that its protocol does not know."""
    COMMAND = "command"
    """An unknown SDO or NMT command."""
    STATE = "state"
    """An unknown NMT state in a heartbeat."""
    TOGGLE = "toggle"
    """The toggle bit of a segment did not alternate."""
    SIZE = "size"
    """A transfer gave another number of bytes than it announced, or too many to follow."""
    SEQUENCE = "sequence"
    """Segments of a block are missing which the receiver acknowledged."""
    CRC = "crc"
    """The CRC of a block transfer does not fit its data."""
    PDO_LENGTH = "pdo_length"
    """A PDO is shorter than its mapping."""
    PROTOCOL = "protocol"
    """The protocol identifier of a Modbus TCP header is not 0."""
    FUNCTION = "function"
    """A function code of Modbus that the device does not document."""
    COUNT = "count"
    """A count that does not fit its limits, or what it counts."""
    FIELD = "field"
    """A field has a value that the protocol does not know."""
    OPTION = "option"
    """An option that the device does not have."""
    DELIMITER = "delimiter"
    """A PROFIBUS telegram does not begin or end with its delimiter."""
    CHECKSUM = "checksum"
    """The check sum (FCS) of a PROFIBUS telegram does not fit its bytes."""

    @property
    def text_key(self) -> str:
        """Text key of the explanation."""
        return f"fault.{self.value}"


class ValueSeen(NamedTuple):
    """The bytes of an object, least significant first, as an SDO or a PDO carried them."""

    t_ns: int
    bus: str
    node: int
    address: Address
    data: bytes
    source: Source


class SdoSeen(NamedTuple):
    """A finished SDO transfer. ``data`` is None unless DONE; of an unfinished write nothing is claimed.

    ``dt_ns`` runs from the first request to the end. ``client`` is TX where the transfer was ours. ``aborted_by`` is
    None unless ABORTED.
    """

    t_ns: int
    bus: str
    node: int
    access: SdoAccess
    address: Address
    outcome: Outcome
    data: bytes | None
    abort_code: int | None
    aborted_by: Side | None
    protocol: Protocol
    dt_ns: int
    client: Direction


class OrphanSeen(NamedTuple):
    """An SDO answer, segment or abort that belongs to no open transfer: most often a late one.

    ``address`` is None where the frame carries none.
    """

    t_ns: int
    bus: str
    node: int
    address: Address | None
    side: Side
    data: bytes


class SaveSeen(NamedTuple):
    """'save' was written to 1010h; ``done`` tells whether it was acknowledged. The sub-index is the category."""

    t_ns: int
    bus: str
    node: int
    address: Address
    done: bool


class LoadSeen(NamedTuple):
    """'load' (restore default parameters) was written to 1011h; ``done`` tells whether it was acknowledged."""

    t_ns: int
    bus: str
    node: int
    address: Address
    done: bool


class NmtCommandSeen(NamedTuple):
    """An NMT command; node 0 addresses all."""

    t_ns: int
    bus: str
    node: int
    command: NmtCommand
    client: Direction


class StateSeen(NamedTuple):
    """A heartbeat, or an answer to node guarding."""

    t_ns: int
    bus: str
    node: int
    state: NmtState


class BootUpSeen(NamedTuple):
    """The boot-up message: the node has started anew and is pre-operational."""

    t_ns: int
    bus: str
    node: int


class EmcySeen(NamedTuple):
    """An emergency message: code, error register and 5 bytes of the maker."""

    t_ns: int
    bus: str
    node: int
    code: int
    register: int
    data: bytes


class SyncSeen(NamedTuple):
    """A SYNC; ``counter`` is None where it carries none. ``node`` is 0."""

    t_ns: int
    bus: str
    node: int
    counter: int | None


class EnvironmentSeen(NamedTuple):
    """A twin told rotor and wind (``app.wire.twin_environment``). ``node`` is 0."""

    t_ns: int
    bus: str
    node: int
    environment: TwinEnvironment


class GapSeen(NamedTuple):
    """Frames are missing before ``t_ns``; ``reason`` is a text key. ``node`` is 0."""

    t_ns: int
    bus: str
    node: int
    reason: str


class MalformedSeen(NamedTuple):
    """A frame, or what it completed, makes no sense. ``node`` is 0 where it names none."""

    t_ns: int
    bus: str
    node: int
    can_id: int
    fault: Fault
    data: bytes


class TransactionSeen(NamedTuple):
    """A Modbus request that is no access to one object (those are SdoSeen), or that an exception code refused.

    ``function`` is its function code. ``exception`` and ``abort_code`` are None unless ABORTED by such a one. ``dt_ns``
    runs from the request to the end. ``client`` is TX where the request was ours.
    """

    t_ns: int
    bus: str
    node: int
    function: int
    outcome: Outcome
    exception: int | None
    abort_code: int | None
    dt_ns: int
    client: Direction


class RestartSeen(NamedTuple):
    """A device that sends no boot-up message has started anew: its uptime fell, or it was told to and is back."""

    t_ns: int
    bus: str
    node: int


class FaultSeen(NamedTuple):
    """A device that sends no emergency messages shows a fault or a warning, its reason, or that it is over.

    ``fault``: its statusword tells that the axis is in Fault; None where that was not seen. ``code`` is the error code
    that it holds, 0 where it holds none or that was not seen yet.
    """

    t_ns: int
    bus: str
    node: int
    fault: bool | None
    code: int

    @property
    def over(self) -> bool:
        """Nothing is wrong any more."""
        return not self.fault and not self.code


class MalformedAduSeen(NamedTuple):
    """A Modbus ADU or a PROFIBUS telegram makes no sense from its byte ``offset`` on.

    ``link`` is the connection that carried an ADU, empty for a telegram.
    """

    t_ns: int
    bus: str
    node: int
    link: str
    fault: Fault
    offset: int
    data: bytes


class SlaveState(Enum):
    """What a PROFIBUS slave was seen to do.

    PRESENT: it answers. WAITING: it wants parameters or a configuration before it exchanges data.
    """

    ABSENT = "absent"
    PRESENT = "present"
    WAITING = "waiting"
    EXCHANGING = "exchanging"

    @property
    def text_key(self) -> str:
        """Text key of what it does."""
        return f"profibus.slave.{self.value}"


class SlaveSeen(NamedTuple):
    """A PROFIBUS slave went into another state: found, lost, ready or not."""

    t_ns: int
    bus: str
    node: int
    state: SlaveState


class DiagnosisSeen(NamedTuple):
    """A PROFIBUS slave told its diagnosis: three bytes of status (the first lowest), master, ident number, blocks."""

    t_ns: int
    bus: str
    node: int
    status: int
    master: int
    ident: int
    extended: bytes


Record = (
    ValueSeen
    | SdoSeen
    | OrphanSeen
    | SaveSeen
    | LoadSeen
    | NmtCommandSeen
    | StateSeen
    | BootUpSeen
    | EmcySeen
    | SyncSeen
    | EnvironmentSeen
    | GapSeen
    | MalformedSeen
    | TransactionSeen
    | RestartSeen
    | FaultSeen
    | MalformedAduSeen
    | SlaveSeen
    | DiagnosisSeen
)
