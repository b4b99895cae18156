"""One sign: a condition of a node that began or ended, or a moment that matters, typed and with a text key."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import Enum
from typing import Any, NamedTuple

from app.wire.events import Severity


class SignKind(Enum):
    """What it is. The values are the words of the search language, so they stay as they are."""

    # Moments
    EMCY = "emcy"
    EMCY_RESET = "emcy_reset"
    ERROR_CODE = "error_code"
    """603Fh names an error or a warning that no emergency message told."""
    BOOT_UP = "boot_up"
    NMT_COMMAND = "nmt_command"
    """A command that takes a node out of operation, or restarts it."""
    WRITE_ABORTED = "write_aborted"
    PARAMETER_WRITTEN = "parameter_written"
    GAP = "gap"
    # Conditions of an axis (statusword and controlword, CiA 402)
    AXIS_FAULT = "axis_fault"
    AXIS_WARNING = "axis_warning"
    AXIS_ENABLED = "axis_enabled"
    QUICK_STOP = "quick_stop"
    REMOTE_LOST = "remote_lost"
    INTERNAL_LIMIT = "internal_limit"
    FOLLOWING_ERROR = "following_error"
    EFC_COMMAND = "efc_command"
    # Conditions of inputs and contacts
    EFC_INPUT = "efc_input"
    ENABLE_INPUT = "enable_input"
    LIMIT_SWITCH = "limit_switch"
    FEATHER_SWITCH = "feather_switch"
    WATCHDOG_OPEN = "watchdog_open"
    CHAIN_OPEN = "chain_open"
    RELAY_OPEN = "relay_open"
    # Conditions of a power unit
    PMM_FAULT = "pmm_fault"
    PMM_WARNING = "pmm_warning"
    BATTERY_FAULT = "battery_fault"
    BATTERY_TEST = "battery_test"
    ON_BATTERY = "on_battery"
    MAINS_HIGH = "mains_high"
    MAINS_PHASE = "mains_phase"
    MAINS_LOW = "mains_low"
    BOOSTER = "booster"
    HOLD_UP_OVER = "hold_up_over"
    DEVICE_STATUS = "device_status"
    """A bit of a status object that stands for an error code."""
    # Conditions of any node
    LIMIT = "limit"
    """A value is beyond the limit that another object or the description names."""
    SILENT = "silent"
    NOT_OPERATIONAL = "not_operational"
    """The heartbeat of a node that was operational tells another state."""

    @property
    def text_key(self) -> str:
        """Text key of the sign."""
        return f"sign.{self.value}"

    @property
    def ended_key(self) -> str:
        """Text key of the end of the condition."""
        return f"sign_ended.{self.value}"


class Sign(NamedTuple):
    """One sign.

    ``details`` are JSON-able and fill the placeholders of the text; one named ``x_key`` is itself a text key, whose
    text fills ``x``. These have a meaning of their own:

    - ``subject``: which of several conditions of the same kind (an address, a bit);
    - ``ends``: true where the condition is over;
    - ``since_ns``: the last time at which it was seen not to be so, where that is long before ``t_ns``. A value that is
      read twice a second changed at any time in between, a node that fell silent did so after its last frame;
    - ``standing``: true where it was so when it was first seen, so that nobody knows since when;
    - ``count``: how often it came again while it chattered (only where more than once).
    """

    t_ns: int
    bus: str
    node: int
    kind: SignKind
    text_key: str
    details: Mapping[str, Any]
    severity: Severity

    @property
    def ends(self) -> bool:
        """The condition is over."""
        return bool(self.details.get("ends"))

    @property
    def standing(self) -> bool:
        """It was there before anybody looked."""
        return bool(self.details.get("standing"))

    @property
    def subject(self) -> str:
        """Which of several conditions of the kind."""
        return str(self.details.get("subject", ""))

    @property
    def times(self) -> int:
        """How often it came, chatter counted."""
        return int(self.details.get("count", 1))

    @property
    def since_ns(self) -> int:
        """The earliest time at which it may have begun."""
        return int(self.details.get("since_ns", self.t_ns))

    @property
    def key(self) -> tuple[str, int, SignKind, str]:
        """What is the same of a condition's begin and end."""
        return self.bus, self.node, self.kind, self.subject


def folded(signs: Iterable[Sign]) -> list[Sign]:
    """The signs by time, one for each begin of a condition: chatter becomes its ``count``.

    ``SignFinder`` tells a begin at once, and how often it came when the condition has ended: here the begin gets it.
    """
    found: list[Sign] = []
    begun: dict[tuple[str, int, SignKind, str], int] = {}
    for sign in sorted(signs, key=lambda one: one.t_ns):
        at = begun.get(sign.key)
        if not sign.ends and at is not None and found[at].t_ns == sign.t_ns and sign.subject:
            found[at] = sign  # told again with its count
            continue
        if sign.ends and at is not None and sign.times > 1:
            first = found[at]
            found[at] = first._replace(details={**first.details, "count": sign.times})
        if not sign.ends:
            begun[sign.key] = len(found)
        found.append(sign)
    return found
