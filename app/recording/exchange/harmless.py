"""What of an event may be told of a recording that is nobody's: numbers, keys and values from lists, nothing typed."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any, Final

from app.errors import UsageError
from app.model.address import parse_address
from app.model.description import Description
from app.recording.content import Event, EventKind
from app.recording.exchange.hiding import Hider
from app.recording.writer import BlockReason, LossReason

PERSON: Final = "person"
TEXT_KEYS: Final = frozenset(
    f"journal.{end}"
    for end in """
    connected disconnected bus_lost bus_back other_master consent recording_started recording_stopped recording_lost
    written write_failed saved saved_part save_failed save_refused save_proven save_not_proven restart stop_sent
    feather_sent foreign_written store_failed store_back
    settings_changed controller_order fault_set fault_seen fault_cleared faults_cleared fault_ended scenario_started
    scenario_stopped scenario_ended incident_made restore_begun restore_confirmed restore_turned_back restore_resumed
    restore_unproven
    restore_done restore_rolled_back restore_incomplete restore_given_up nmt_sent lease_taken lease_ended
    motion_prepared motion_unwatched external_stop motion_lost motion_put_back motion_begun motion_ended motion_stopped
    fault_reset homed home_found pdo_changed pdo_put_back
    pdo_rolled_back pdo_broken
    battery_test_begun battery_test_ended battery_changed
    scope_armed scope_captured verified
    """.split()
)
"""The texts of events that recordings of this bench bear."""
_NUMBERS: Final = frozenset({"count", "from_ns", "to_ns", "step_ns", "wall_ns", "free_bytes", "limit_bytes"})
_REASONS: Final = frozenset(one.value for kind in (BlockReason, LossReason) for one in kind)
_ABORT: Final = re.compile(r"[0-9A-F]{8}h")
_ADDRESS: Final = re.compile(r"[0-9A-F]{4}(:[0-9A-F]{2})?")
_CATEGORY: Final = re.compile(r"category\.[a-z0-9_]{1,20}")
_VALUE: Final = re.compile(r"[-+]?[0-9]{1,12}(\.[0-9]{1,9})?|[0-9A-Fa-f]{1,8}h")


class Harmless:
    """Goes through the events of one recording; ``left_out`` counts what was not told."""

    def __init__(
        self,
        slugs: Mapping[str, tuple[str, int]],
        descriptions: Mapping[tuple[str, int], Description],
        hider: Hider,
        slug: Callable[[str], str],
    ) -> None:
        """``slugs`` tells which node a device is, ``slug`` the other name of a device."""
        self._slugs, self._descriptions, self._hider, self._slug = slugs, descriptions, hider, slug
        self.left_out = 0

    def details(self, event: Event) -> dict[str, Any]:
        """What stays of the details."""
        kept: dict[str, Any] = {}
        for key, value in event.details.items():
            if key == "device" and isinstance(value, str):
                kept[key] = self._slug(value)
            elif key == "person" and value is not None:
                kept[key] = PERSON
            elif value is None or self._tells_nobody(event, key, value):
                kept[key] = value
            else:
                self.left_out += 1
        return kept

    def _tells_nobody(self, event: Event, key: str, value: Any) -> bool:
        if key in _NUMBERS:
            return type(value) is int
        if not isinstance(value, str):
            return False
        if key == "text_key":
            return value in TEXT_KEYS
        if key == "reason":
            return value in _REASONS or bool(_ABORT.fullmatch(value))
        if key == "category_key":
            return bool(_CATEGORY.fullmatch(value))
        if key == "address":
            return bool(_ADDRESS.fullmatch(value))
        return key in ("was", "now") and bool(_VALUE.fullmatch(value)) and self._is_described(event)

    def _is_described(self, event: Event) -> bool:
        """Whether the event is of an object that is known, and known to identify nobody."""
        node = self._slugs.get(str(event.details.get("device")))
        description = None if node is None else self._descriptions.get(node)
        if event.kind is not EventKind.WRITE or node is None or description is None:
            return False
        try:
            address = parse_address(str(event.details.get("address")))
        except UsageError:
            return False
        return address in description.entries and not self._hider.is_identity(*node, address)
