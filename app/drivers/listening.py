"""What can be told of a bus by listening: which nodes are there, and whether another master is at work.

Identifiers by the predefined connection set (CiA 301, 7.3.5). Runs on the receive thread, reads frames only.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from app.drivers.contract import MasterSeen, MasterSign
from app.wire.frame import Can, Direction, Frame

_NODE_BASES: Final = frozenset({0x080, 0x180, 0x280, 0x380, 0x480, 0x580, 0x700})
"""EMCY, TPDO 1 to 4, SDO answers, heartbeat: what nodes send."""
_MASTER_BASES: Final = {
    0x200: MasterSign.RPDO,
    0x300: MasterSign.RPDO,
    0x400: MasterSign.RPDO,
    0x500: MasterSign.RPDO,
    0x600: MasterSign.SDO_REQUEST,
}
_GUARDING_BASE: Final = 0x700
_MASTER_IDS: Final = {0x000: MasterSign.NMT_COMMAND, 0x080: MasterSign.SYNC, 0x100: MasterSign.TIME_STAMP}


class BusWatch:
    """Notes nodes and other masters from received frames; our own transmissions count for nothing."""

    def __init__(self) -> None:
        self._kinds: dict[int, MasterSign | None] = {}
        self._nodes: dict[int, None] = {}
        self._masters: dict[int, MasterSeen] = {}

    @property
    def nodes(self) -> tuple[int, ...]:
        """Nodes of which anything was seen, in ascending order."""
        return tuple(sorted(self._nodes.copy()))

    @property
    def masters(self) -> tuple[MasterSeen, ...]:
        """What only another master sends, by identifier."""
        return tuple(seen for _, seen in sorted(self._masters.copy().items()))

    def last_seen_ns(self, sign: MasterSign) -> int | None:
        """When ``sign`` was seen last (``t_ns`` of its frame)."""
        return max((seen.t_ns for seen in self._masters.copy().values() if seen.sign is sign), default=None)

    def forget(self) -> None:
        """Begin anew, as on another bus."""
        self._kinds = {}
        self._nodes = {}
        self._masters = {}

    def on_frames(self, frames: Sequence[Frame]) -> None:
        """Take what was received; a node that is known costs one look-up."""
        kinds = self._kinds
        for t_ns, _, direction, can, _ in frames:
            if direction is not Direction.RX or type(can) is not Can:
                continue
            can_id, _, extended, remote, error, _ = can
            if extended or error:
                continue
            if remote:
                if can_id & 0x780 == _GUARDING_BASE:
                    self._note(MasterSign.NODE_GUARDING, can_id, t_ns)
                continue
            if can_id not in kinds:
                self._classify(can)
            sign = kinds[can_id]
            if sign is not None:
                self._note(sign, can_id, t_ns)

    def _note(self, sign: MasterSign, can_id: int, t_ns: int) -> None:
        before = self._masters.get(can_id)
        self._masters[can_id] = MasterSeen(sign, can_id, t_ns, 1 if before is None else before.times + 1)

    def _classify(self, can: Can) -> None:
        node, base = can.can_id & 0x7F, can.can_id & 0x780
        if node == 0:
            self._kinds[can.can_id] = _MASTER_IDS.get(can.can_id)
            return
        self._kinds[can.can_id] = _MASTER_BASES.get(base)
        if base in _NODE_BASES:
            self._nodes[node] = None
