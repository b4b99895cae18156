"""One node of the live state: its row of the node table, and its memory. Touched by ``live`` only, under its lock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from app.wire.memory import NodeMemory
from app.wire.nmt import NmtState


@dataclass(frozen=True, slots=True)
class NodeView:
    """One node now. ``state`` None: not known; ``commanded``: it was told so and has not said so itself yet.

    ``heartbeat_ns`` and ``boot_ns`` are the times of the latest heartbeat and boot-up. ``period_ns`` is that of 1017h
    where known, else the longest interval measured. ``silent``: a heartbeat is overdue. ``emcy_code`` is
    that of the latest emergency message, 0 after "no error". ``other_client_ns``: the latest transfer of a foreign
    SDO client. ``answered_ns``: on a bus without heartbeats the latest answer to anybody, a refusal included.
    """

    bus: str
    node: int
    state: NmtState | None = None
    commanded: bool = False
    heartbeat_ns: int | None = None
    period_ns: int | None = None
    silent: bool = False
    boot_ns: int | None = None
    boots: int = 0
    emcy_code: int | None = None
    emcy_ns: int | None = None
    other_client_ns: int | None = None
    answered_ns: int | None = None
    version: int = 0


class LiveNode:
    """All that is kept of a node. ``seen``: it has said something itself."""

    __slots__ = (
        "answered_ns", "boot_ns", "boots", "bus", "commanded", "diagnosis", "emcy_code", "emcy_ns", "exchanging",
        "first_interval_ns", "heartbeat_ns", "interval_ns", "memory", "number", "other_client_ns", "period_ns",
        "reset_communication", "seen", "silent", "state", "version",
    )  # fmt: skip

    def __init__(self, bus: str, number: int) -> None:
        self.bus = bus
        self.number = number
        self.memory = NodeMemory(bus, number)
        self.seen = False
        self.state: NmtState | None = None
        self.commanded = False
        self.heartbeat_ns: int | None = None
        self.interval_ns: int | None = None
        self.first_interval_ns: int | None = None
        self.period_ns: int | None = None
        self.silent = False
        self.boot_ns: int | None = None
        self.boots = 0
        self.emcy_code: int | None = None
        self.emcy_ns: int | None = None
        self.other_client_ns: int | None = None
        self.answered_ns: int | None = None
        self.diagnosis: str | None = None
        """What a PROFIBUS slave told of itself last, to tell what is new."""
        self.exchanging: bool | None = None
        """A PROFIBUS slave exchanges data, or does not any more; None where it was not seen to."""
        self.reset_communication = False
        self.version = 0

    def measured(self, interval_ns: int) -> None:
        """Two heartbeats came so far apart. One interval alone says little: a change of state may send one early."""
        if self.first_interval_ns is None:
            self.first_interval_ns = interval_ns
        else:
            self.interval_ns = max(interval_ns, self.interval_ns or self.first_interval_ns)

    def forget_heartbeat(self) -> None:
        """Heartbeats start anew."""
        self.heartbeat_ns = self.interval_ns = self.first_interval_ns = None

    def view(self) -> NodeView:
        """What a reader gets."""
        return NodeView(
            self.bus, self.number, self.state, self.commanded, self.heartbeat_ns, self.period_ns or self.interval_ns,
            self.silent, self.boot_ns, self.boots, self.emcy_code, self.emcy_ns, self.other_client_ns,
            self.answered_ns, self.version,
        )  # fmt: skip

    def snapshot(self) -> dict[str, Any]:
        """JSON-able state, without the description."""
        kept = {name: getattr(self, name) for name in _KEPT}
        return {"bus": self.bus, "node": self.number, **kept, "memory": self.memory.snapshot()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from ``snapshot()``. Raises KeyError or ValueError on another state."""
        for name in _KEPT:
            setattr(self, name, state.get(name) if name in _ADDED else state[name])
        self.state = None if state["state"] is None else NmtState(state["state"])
        self.memory.restore(state["memory"])


_KEPT: Final = tuple(name for name in LiveNode.__slots__ if name not in ("bus", "number", "memory", "version"))
_ADDED: Final = frozenset({"answered_ns", "diagnosis", "exchanging"})
"""Not in states of older recordings."""
