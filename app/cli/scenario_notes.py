"""What a recording of a scenario notes beside the frames: what was done to the twins, and what a service master did.

The notes are those that the journal of a connection would have written, with the same text keys.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

from app.model.address import Address
from app.model.datatypes import Raw, decode_raw
from app.model.description import Description, Lookup
from app.model.fault import CATALOGUE, FaultOrder, FaultTarget
from app.model.values import show
from app.recording.content import EventKind
from app.twins.scenario import Action, Clear, Control, MasterDo, MasterOrder, Scenario
from app.twins.scenario_player import ScenarioPlayer
from app.twins.service_master import Done
from app.wire.live import LiveState

BUS: Final = "can0"
_NS: Final = 1_000_000_000
_DASH: Final = "–"
Note = Callable[..., None]
"""Takes kind of event, text key, device and details; notes it now."""
CallAt = Callable[[int, Callable[[int], None]], None]


class ScenarioNotes:
    """Notes a scenario as it plays. ``slugs`` and ``descriptions`` by node; ``live`` knows what a value was before."""

    def __init__(
        self,
        scenario: Scenario,
        slugs: Mapping[int, str],
        descriptions: Mapping[int, Description],
        live: LiveState,
        note: Note,
    ) -> None:
        self._scenario = scenario
        self._slugs = slugs
        self._descriptions = descriptions
        self._live = live
        self._note = note
        self._told = 0
        self._ordered: dict[int, tuple[int, str]] = {}
        """When an order was given, and what its object showed then."""

    def schedule(self, since_ns: int, call_at: CallAt) -> None:
        """Have everything noted when it happens. To be called after the player was made, whose timers come first."""
        self._note(EventKind.NOTE, "journal.scenario_started", "", title=self._scenario.title)
        for event in self._scenario.events:
            at_ns, action = since_ns + event.at_ns, event.action
            call_at(at_ns, partial(self._happens, action))
            if isinstance(action, FaultOrder) and action.seconds is not None:
                call_at(at_ns + round(action.seconds * _NS), partial(self._fault, "journal.fault_ended", action))

    def watch(self, player: ScenarioPlayer, now_ns: int) -> None:
        """Note what the service master has finished since the last call."""
        for done in player.master.done[self._told :]:
            self._told += 1
            self._done(done, now_ns)

    # -- what the scenario does -----------------------------------------------------------

    def _happens(self, action: Action, t_ns: int) -> None:
        if isinstance(action, FaultOrder):
            self._fault("journal.fault_set", action, t_ns)
        elif isinstance(action, Clear):
            self._clear(action)
        elif isinstance(action, Control):
            order = ", ".join(f"{name} = {value}" for name, value in action.table.items())
            self._note(EventKind.NOTE, "journal.controller_order", "", order=order)
        else:
            self._order(action, t_ns)

    def _fault(self, text_key: str, order: FaultOrder, _t_ns: int) -> None:
        values = ", ".join(f"{name}={number:g}" for name, number in order.values.items())
        where = self._where(order.kind, order.blade, order.node)
        self._note(EventKind.NOTE, text_key, "", fault_key=f"fault.{order.kind}.name", values=values, **where)

    def _clear(self, clear: Clear) -> None:
        if clear.kind is None:
            self._note(EventKind.NOTE, "journal.faults_cleared", "")
        else:
            where = self._where(clear.kind, clear.blade, clear.node)
            self._note(EventKind.NOTE, "journal.fault_cleared", "", fault_key=f"fault.{clear.kind}.name", **where)

    def _where(self, kind: str, blade: int | None, node: int | None) -> dict[str, str]:
        if node is not None:
            return {"target": self._slugs.get(node, str(node))}
        if blade is not None:
            return {"target_key": f"fault_target.blade_{blade}"}
        of_bus = CATALOGUE[kind].target is FaultTarget.BUS
        return {"target_key": f"fault_target.{'bus' if of_bus else 'turbine'}"}

    # -- what the service master does --------------------------------------------------------

    def _order(self, order: MasterOrder, t_ns: int) -> None:
        """A restart has no answer; all else is noted when it is done, with what was before it."""
        if order.do is MasterDo.RESTART:
            self._note(EventKind.NOTE, "journal.restart", self._slugs.get(order.node, ""))
        elif order.address is not None:
            self._ordered[id(order)] = t_ns, self._now(order.node, order.address)
        else:
            self._ordered[id(order)] = t_ns, _DASH

    def _done(self, done: Done, now_ns: int) -> None:
        order, abort = done.order, done.answer.abort
        slug = self._slugs.get(order.node, "")
        since_ns, was = self._ordered.get(id(order), (now_ns, _DASH))
        if order.do is MasterDo.SAVE and abort is None:
            self._note(EventKind.NOTE, "journal.saved", slug, took_s=f"{(now_ns - since_ns) / _NS:.2f}")
        elif order.do is MasterDo.SAVE:
            self._note(EventKind.NOTE, "journal.save_failed", slug, reason=f"{abort:08X}h")
        elif order.do is MasterDo.WRITE and order.address is not None:
            entry = self._descriptions[order.node].entries.get(order.address)
            name = "" if entry is None else entry.title
            now = str(order.raw) if entry is None else show(entry, order.raw, self._lookup(order.node))
            shown = {"address": order.address.short, "name": name, "was": was, "now": now}
            if abort is None:
                self._note(EventKind.WRITE, "journal.written", slug, **shown)
            else:
                self._note(EventKind.WRITE, "journal.write_failed", slug, **shown, reason=f"{abort:08X}h")

    def _now(self, node: int, address: Address) -> str:
        """What an object shows, as far as it was seen on the wire."""
        entry, lookup = self._descriptions[node].entries.get(address), self._lookup(node)
        raw = lookup(address)
        return _DASH if entry is None or raw is None else show(entry, raw, lookup)

    def _lookup(self, node: int) -> Lookup:
        def look(address: Address) -> Raw | None:
            seen = self._live.value(BUS, node, address)
            entry = self._descriptions[node].entries.get(address)
            if seen is None or seen.reading is None or entry is None:
                return None
            return decode_raw(entry.type, seen.reading.data)

        return look
