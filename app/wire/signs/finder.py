"""Finds signs in the records of decoders: fed record by record, of all buses, in the order of time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from app.model.address import Address
from app.model.description import Description
from app.model.values import show
from app.wire import emcy, sdo
from app.wire.events import Severity, tell_emcy
from app.wire.nmt import ALL_NODES, NmtCommand
from app.wire.profibus.pkw import error_text_key
from app.wire.records import (
    BootUpSeen,
    EmcySeen,
    GapSeen,
    NmtCommandSeen,
    Outcome,
    Protocol,
    Record,
    RestartSeen,
    SdoAccess,
    SdoSeen,
    Source,
    StateSeen,
    ValueSeen,
)
from app.wire.signs.condition import Condition
from app.wire.signs.node import ERROR_CODES, NodeSigns, Watch, is_set_up
from app.wire.signs.sign import Sign, SignKind

_NOTHING: Final[tuple[Sign, ...]] = ()
_HEARTBEAT_PRODUCER: Final = Address(0x1017)
_TOLD_COMMANDS: Final = frozenset(
    {NmtCommand.STOP, NmtCommand.PRE_OPERATIONAL, NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION}
)
_NEVER: Final = 1 << 63


class SignFinder:
    """Streaming. ``descriptions`` by bus and node; of a node without one only what every CANopen node tells is known.

    A sign that a condition has **ended** comes about a second after its time (``t_ns``), because what comes again
    within that is chatter: sort by ``t_ns``. ``folded`` puts how often it came into the begin. Call ``finish`` at the
    end of a recording.
    """

    def __init__(self, descriptions: Mapping[tuple[str, int], Description]) -> None:
        self._descriptions = dict(descriptions)
        self._nodes: dict[tuple[str, int], NodeSigns] = {}
        self._leaving: list[Condition] = []
        self._settles_ns = _NEVER
        self._handlers: dict[type, Callable[[Any], Sequence[Sign]]] = {
            ValueSeen: self._on_value,
            SdoSeen: self._on_sdo,
            StateSeen: self._on_state,
            EmcySeen: self._on_emcy,
            BootUpSeen: self._on_boot_up,
            RestartSeen: self._on_boot_up,
            NmtCommandSeen: self._on_nmt,
            GapSeen: self._on_gap,
        }
        for bus, node in self._descriptions:
            self._node(bus, node)

    def watched(self, bus: str, node: int) -> frozenset[Address]:
        """The objects of a node whose values matter here: a change of another one need not be fed."""
        found = self._nodes.get((bus, node))
        return frozenset((_HEARTBEAT_PRODUCER, *(found.watches if found is not None else ())))

    def feed(self, record: Record) -> Sequence[Sign]:
        """What one record tells. Records come in the order of time."""
        handler = self._handlers.get(type(record))
        if handler is None:
            return _NOTHING
        if record.t_ns >= self._settles_ns:
            return (*self._settled(record.t_ns), *handler(record))
        return handler(record)

    def tick(self, now_ns: int) -> Sequence[Sign]:
        """Time has gone on: overdue heartbeats, and conditions that have been away for long enough."""
        signs = list(self._settled(now_ns)) if now_ns >= self._settles_ns else []
        for node in self._nodes.values():
            sign = node.fell_silent(now_ns)
            if sign is not None:
                signs.append(sign)
        return signs

    def finish(self, now_ns: int) -> Sequence[Sign]:
        """The end of the recording: begins of what chatters still are told again, with their count."""
        signs = [*self.tick(now_ns)]
        for node in self._nodes.values():
            signs += [sign for one in node.conditions() if (sign := one.told_again()) is not None]
        return signs

    # -- values ------------------------------------------------------------------

    def _on_value(self, seen: ValueSeen) -> Sequence[Sign]:
        t_ns, bus, number, address, data, source = seen
        node = self._nodes.get((bus, number)) or self._node(bus, number)
        heard_ns = node.heard_ns
        if source is not Source.PDO_RX:
            node.heard_ns = t_ns
        watch = node.watches.get(address)
        if watch is None:
            if address == _HEARTBEAT_PRODUCER and len(data) == 2:
                node.period_ns = int.from_bytes(data, "little") * 1_000_000 or None
            return _NOTHING
        before_ns, watch.t_ns = watch.t_ns, t_ns
        if data == watch.data:
            return _NOTHING
        if source is not Source.SDO_READ:  # a PDO comes with the change, unless its node was not heard
            before_ns = node.looked_ns(before_ns, heard_ns)
        watch.data = data
        raw = watch.number(data)
        if raw is None:
            return _NOTHING
        for limit in node.written_limits.get(address, ()):
            limit.limit_raw = raw
        if address in ERROR_CODES:
            return self._on_error_code(node, t_ns, raw)
        return self._judge(watch, t_ns, before_ns, raw)

    def _judge(self, watch: Watch, t_ns: int, before_ns: int | None, raw: int) -> Sequence[Sign]:
        signs: list[Sign] = []
        for test, condition, details in watch.tests:
            sign = self._see(condition, t_ns, test.holds(raw), before_ns, details)
            if sign is not None:
                signs.append(sign)
        for limit, condition in watch.limits:
            beyond = limit.holds(raw)
            if beyond is not None and beyond is not condition.on:
                sign = self._see(condition, t_ns, beyond, before_ns, limit.details(raw))
                if sign is not None:
                    signs.append(sign)
        return signs

    def _see(
        self, condition: Condition, t_ns: int, on: bool, before_ns: int | None, details: Mapping[str, Any]
    ) -> Sign | None:
        if condition.on is on:
            return None
        sign = condition.see(t_ns, on, before_ns, details)
        settles_ns = condition.settles_ns
        if settles_ns is not None:
            self._leaving.append(condition)
            self._settles_ns = min(self._settles_ns, settles_ns)
        return sign

    def _settled(self, now_ns: int) -> list[Sign]:
        signs = [sign for one in self._leaving if (sign := one.settle(now_ns)) is not None]
        self._leaving = list(dict.fromkeys(one for one in self._leaving if one.settles_ns is not None))
        self._settles_ns = min((one.settles_ns or _NEVER for one in self._leaving), default=_NEVER)
        return signs

    def _on_error_code(self, node: NodeSigns, t_ns: int, code: int) -> Sequence[Sign]:
        """603Fh names warnings too, and errors that were raised while nobody heard the node."""
        before, node.error_code = node.error_code, code
        if code in (emcy.NO_ERROR, before) or code in node.told_codes:
            return _NOTHING
        details = {**_error_details(code, node.description), "subject": f"{code:04X}"}
        return (self._sign(t_ns, node, SignKind.ERROR_CODE, Severity.WARNING, details),)

    # -- services ------------------------------------------------------------------

    def _on_sdo(self, seen: SdoSeen) -> Sequence[Sign]:
        if seen.access is not SdoAccess.WRITE:
            return _NOTHING
        node = self._node(seen.bus, seen.node)
        details: dict[str, Any] = {"address": seen.address.short, "client": seen.client.value}
        if seen.outcome is Outcome.ABORTED and seen.abort_code is not None:
            of_pkw = seen.protocol is Protocol.PKW
            details |= {
                "subject": seen.address.short,
                "abort_code": seen.abort_code,
                "abort_code_hex": str(seen.abort_code) if of_pkw else f"{seen.abort_code:08X}h",
                "reason_key": (error_text_key if of_pkw else sdo.abort_text_key)(seen.abort_code),
            }
            return (self._sign(seen.t_ns, node, SignKind.WRITE_ABORTED, Severity.WARNING, details),)
        return self._on_written(node, seen, details) if seen.outcome is Outcome.DONE else _NOTHING

    def _on_written(self, node: NodeSigns, seen: SdoSeen, details: dict[str, Any]) -> Sequence[Sign]:
        """A parameter was changed; its value record comes next, so that ``data`` of its watch is still the old one."""
        watch = node.watches.get(seen.address)
        entry = None if node.description is None else node.description.entries.get(seen.address)
        if watch is None or entry is None or seen.data is None or seen.data == watch.data:
            return _NOTHING
        if not entry.is_parameter or not is_set_up(entry.address):
            return _NOTHING
        details |= {"subject": seen.address.short, "name": entry.title, "unit": entry.quantity.unit}
        for form, data in (("", seen.data), ("was_", watch.data)):
            raw = None if data is None else watch.number(data)
            if raw is not None:
                details |= {f"{form}raw": raw, f"{form}shown": show(entry, raw, lambda _: None)}
        return (self._sign(seen.t_ns, node, SignKind.PARAMETER_WRITTEN, Severity.INFO, details),)

    def _on_state(self, seen: StateSeen) -> Sequence[Sign]:
        node = self._node(seen.bus, seen.node)
        if node.silent.on:
            node.back(node.silent_ns, seen.t_ns)
        node.heard_ns = seen.t_ns
        node.beat(seen.t_ns)
        self._see(node.silent, seen.t_ns, False, None, {})
        out = node.is_out(seen.state)
        if out is None:
            return _NOTHING
        sign = self._see(node.not_operational, seen.t_ns, out, None, {"state_key": seen.state.text_key})
        return _NOTHING if sign is None else (sign,)

    def _on_emcy(self, seen: EmcySeen) -> Sequence[Sign]:
        node = self._node(seen.bus, seen.node)
        node.heard_ns = seen.t_ns
        _, severity, _, details = tell_emcy(seen, node.description)
        details = {**details, "subject": f"{seen.code:04X}"}
        if seen.code == emcy.NO_ERROR:
            node.told_codes.clear()
            return (self._sign(seen.t_ns, node, SignKind.EMCY_RESET, severity, details),)
        node.told_codes.add(seen.code)
        return (self._sign(seen.t_ns, node, SignKind.EMCY, severity, details),)

    def _on_boot_up(self, seen: BootUpSeen | RestartSeen) -> Sequence[Sign]:
        node = self._node(seen.bus, seen.node)
        before_ns, node.heard_ns = node.heard_ns, seen.t_ns
        node.back(before_ns, seen.t_ns)
        node.forget_heartbeat()
        node.forget_values()
        node.period_ns, node.was_operational = None, False
        node.told_codes.clear()
        for condition in (node.silent, node.not_operational):
            self._see(condition, seen.t_ns, False, None, {})
        details: dict[str, Any] = {"first": True} if before_ns is None else {"since_ns": before_ns}
        severity = Severity.INFO if before_ns is None else Severity.WARNING
        return (self._sign(seen.t_ns, node, SignKind.BOOT_UP, severity, details),)

    def _on_nmt(self, seen: NmtCommandSeen) -> Sequence[Sign]:
        if seen.command not in _TOLD_COMMANDS:
            return _NOTHING
        details = {
            "subject": seen.command.name.lower(),
            "command_key": seen.command.text_key,
            "client": seen.client.value,
        }
        severity = Severity.WARNING if self._takes_out(seen) else Severity.INFO
        kind = SignKind.NMT_COMMAND
        return (Sign(seen.t_ns, seen.bus, seen.node, kind, kind.text_key, details, severity),)

    def _takes_out(self, seen: NmtCommandSeen) -> bool:
        """Whether it reaches a node that was operational."""
        nodes = (one for one in self._nodes.values() if one.bus == seen.bus and seen.node in (ALL_NODES, one.node))
        return any(one.was_operational for one in nodes)

    def _on_gap(self, seen: GapSeen) -> Sequence[Sign]:
        for node in self._nodes.values():
            if node.bus == seen.bus:
                node.forget_heartbeat()
                node.forget_values()
        kind = SignKind.GAP
        return (Sign(seen.t_ns, seen.bus, 0, kind, kind.text_key, {"reason_key": seen.reason}, Severity.WARNING),)

    # -- bookkeeping -------------------------------------------------------------

    def _node(self, bus: str, number: int) -> NodeSigns:
        node = self._nodes.get((bus, number))
        if node is None:
            description = self._descriptions.get((bus, number))
            node = self._nodes[bus, number] = NodeSigns(bus, number, description)
        return node

    @staticmethod
    def _sign(t_ns: int, node: NodeSigns, kind: SignKind, severity: Severity, details: Mapping[str, Any]) -> Sign:
        return Sign(t_ns, node.bus, node.node, kind, kind.text_key, details, severity)


def _error_details(code: int, description: Description | None) -> dict[str, Any]:
    known = None if description is None else description.errors.get(code)
    reason_key = emcy.emcy_text_key(code) if known is None else known.text_key
    return {"code": code, "code_hex": f"{code:04X}h", "reason_key": reason_key}
