"""Byte codec of network management, node guarding and heartbeat (CiA 301, 7.2.8). Pure.

An NMT command is CAN id 0 with two bytes; heartbeat and boot-up are one byte on 700h + node.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final, NamedTuple

NMT_COB_ID: Final = 0x000
HEARTBEAT_BASE: Final = 0x700
ALL_NODES: Final = 0
MAX_NODE: Final = 127


class NmtState(IntEnum):
    """State byte of heartbeat and node guarding (7.2.8.3.2.1). BOOT_UP is the boot-up message."""

    BOOT_UP = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127

    @property
    def text_key(self) -> str:
        """Text key of the state's name."""
        return f"nmt.state.{self.name.lower()}"


class NmtCommand(IntEnum):
    """Command specifier of an NMT message (7.2.8.3.1)."""

    START = 1
    STOP = 2
    PRE_OPERATIONAL = 128
    RESET_NODE = 129
    RESET_COMMUNICATION = 130

    @property
    def text_key(self) -> str:
        """Text key of the command's name."""
        return f"nmt.command.{self.name.lower()}"

    @property
    def leads_to(self) -> NmtState | None:
        """State that a node takes on the command; None for the resets, which end in a boot-up message."""
        return _LEADS_TO.get(self)


_LEADS_TO: Final = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
}


class NmtMessage(NamedTuple):
    """A command to ``node``, or to all where it is 0."""

    command: NmtCommand
    node: int


class Heartbeat(NamedTuple):
    """Heartbeat, boot-up, or an answer to node guarding (``toggle`` alternates there, and is 0 in a heartbeat)."""

    state: NmtState
    toggle: bool = False


def nmt_message(command: NmtCommand, node: int) -> bytes:
    """Two bytes for CAN id 0. Raises ValueError where ``node`` is outside 0..127."""
    if not 0 <= node <= MAX_NODE:
        raise ValueError(f"node {node} is outside 0..127")
    return bytes((command, node))


def parse_nmt_message(data: bytes) -> NmtMessage:
    """Read an NMT command. Raises ValueError on a wrong length, an unknown command or node."""
    if len(data) != 2 or data[1] > MAX_NODE:
        raise ValueError(f"{data.hex()} is no NMT command")
    return NmtMessage(NmtCommand(data[0]), data[1])


def heartbeat(state: NmtState) -> bytes:
    """One byte for 700h + node; BOOT_UP gives the boot-up message."""
    return bytes((state,))


def parse_heartbeat(data: bytes) -> Heartbeat:
    """Read heartbeat, boot-up or node guarding. Raises ValueError on a wrong length or an unknown state."""
    if len(data) != 1:
        raise ValueError(f"{data.hex()} is no heartbeat")
    return Heartbeat(NmtState(data[0] & 0x7F), bool(data[0] & 0x80))
