"""Monitoring that is switched off, errors that are masked, and modes for the bench that were left on (manual 5)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from app.model.rules.look import Found, Judge, Look, Object, device_name, make_rule, pmc, pmm
from app.model.rules.rule import Rule, Severity

WINDOW: Final = pmc("6065")
BLADE_WINDOW: Final = pmc("6865")
BLADE_TIME: Final = pmc("6866")
POSITION_WINDOW_TIME: Final = pmc("6068")
ERROR_MASK: Final = pmc("6510:07")
FLAGS: Final = pmc("60FB:03")
CONNECTION_LOSS: Final = pmc("6007")
FAULT_REACTION: Final = pmc("605E")
HEARTBEATS: Final = (pmm("1017"), pmc("1017"))
WINDOW_OFF: Final = 0xFFFFFFFF
MASKABLE: Final = {
    3: 0x3220,
    4: 0x7305,
    5: 0x4210,
    6: 0x6320,
    8: 0x4310,
    9: 0x6380,
    10: 0x8400,
    11: 0x7320,
    13: 0x7321,
    14: 0x8611,
}
"""Errors of priority B by their bit (table 38); those of priority A cannot be switched off."""
UNUSED_FLAGS: Final = 0x3CFE
"""Bits 1 to 7 and 10 to 13 of the control flags (table 42; bit 14 came later)."""
GOES_ON: Final = (0, 1)
MESSAGE_ONLY: Final = -1


def _window_off(look: Look) -> Iterator[Found]:
    (window,) = look(WINDOW)
    if window == WINDOW_OFF:
        yield Found((WINDOW,))


def _difference_off(look: Look) -> Iterator[Found]:
    """OPEN whether 0 switches it off or trips at any difference; neither is wanted."""
    window, time_ms = look(BLADE_WINDOW, BLADE_TIME)
    if window == 0 or time_ms == 0:
        yield Found((BLADE_WINDOW, BLADE_TIME), {"window": window, "time_ms": time_ms})


def _masked(look: Look) -> Iterator[Found]:
    (mask,) = look(ERROR_MASK)
    codes = [f"{code:04X}h" for bit, code in MASKABLE.items() if not mask >> bit & 1]
    if codes:
        yield Found((ERROR_MASK,), {"codes": ", ".join(codes)})


def _flag(bit: int) -> Judge:
    def judge(look: Look) -> Iterator[Found]:
        (flags,) = look(FLAGS)
        if flags >> bit & 1:
            yield Found((FLAGS,), {"flags": f"{flags & 0xFFFF:04X}h"})

    return judge


def _unused_flags(look: Look) -> Iterator[Found]:
    (flags,) = look(FLAGS)
    if flags & UNUSED_FLAGS:
        yield Found((FLAGS,), {"bits": ", ".join(str(bit) for bit in range(16) if flags & UNUSED_FLAGS & 1 << bit)})


def _one_of(one: Object, values: tuple[int, ...]) -> Judge:
    def judge(look: Look) -> Iterator[Found]:
        (raw,) = look(one)
        if raw in values:
            yield Found((one,), {"raw": raw})

    return judge


def _heartbeats(look: Look) -> Iterator[Found]:
    for one in HEARTBEATS:
        if look.maybe(one) == 0:
            yield Found((one,), {"device": device_name(one)})


RULES: Final[tuple[Rule, ...]] = (
    make_rule("oat.following_error_off", "5.4.1.2", Severity.WARNING, (WINDOW,), _window_off),
    make_rule("oat.difference_off", "5.6.1.9", Severity.WARNING, (BLADE_WINDOW, BLADE_TIME), _difference_off),
    make_rule(
        "oat.target_on_overshoot",
        "5.4.1.5",
        Severity.NOTE,
        (POSITION_WINDOW_TIME,),
        _one_of(POSITION_WINDOW_TIME, (0,)),
    ),
    make_rule("oat.masked_errors", "5.1.1.1", Severity.WARNING, (ERROR_MASK,), _masked),
    make_rule("oat.simulation_mode", "5.4.1.8", Severity.ERROR, (FLAGS,), _flag(15)),
    make_rule("oat.limit_switches_crossable", "5.4.1.8", Severity.WARNING, (FLAGS,), _flag(14)),
    make_rule("oat.unused_flags", "5.4.1.8", Severity.NOTE, (FLAGS,), _unused_flags),
    make_rule(
        "oat.connection_loss", "5.7.1.1", Severity.WARNING, (CONNECTION_LOSS,), _one_of(CONNECTION_LOSS, GOES_ON)
    ),
    make_rule(
        "oat.fault_reaction", "5.7.1.2", Severity.WARNING, (FAULT_REACTION,), _one_of(FAULT_REACTION, (MESSAGE_ONLY,))
    ),
    make_rule("oat.heartbeat_off", "CiA 301 7.5.2.14", Severity.WARNING, HEARTBEATS, _heartbeats),
)
