"""Which bits of which status objects are signs, by the bit tables of the device descriptions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Final, NamedTuple

from app.model.address import Address
from app.model.description import Access, Description, Entry
from app.wire.events import Severity
from app.wire.signs.sign import SignKind


class Test(NamedTuple):
    """A condition of a raw value: ``holds`` tells it; ``bit`` is the one that its words are about."""

    kind: SignKind
    severity: Severity
    holds: Callable[[int], bool]
    bit: int | None = None


def _high(bit: int) -> Callable[[int], bool]:
    mask = 1 << bit
    return lambda raw: raw & mask != 0


def _low(bit: int) -> Callable[[int], bool]:
    mask = 1 << bit
    return lambda raw: raw & mask == 0


def _any_low(*bits: int) -> Callable[[int], bool]:
    mask = sum(1 << bit for bit in bits)
    return lambda raw: raw & mask != mask


_ERROR, _WARNING, _INFO = Severity.ERROR, Severity.WARNING, Severity.INFO

_CIA402: Final = (
    Test(SignKind.AXIS_FAULT, _ERROR, lambda raw: raw & 0x4F in (0x08, 0x0F)),
    Test(SignKind.QUICK_STOP, _WARNING, lambda raw: raw & 0x6F == 0x07),
    Test(SignKind.AXIS_ENABLED, _INFO, lambda raw: raw & 0x6F == 0x27),
    Test(SignKind.AXIS_WARNING, _WARNING, _high(7)),
    Test(SignKind.REMOTE_LOST, _WARNING, _low(9)),
    Test(SignKind.INTERNAL_LIMIT, _INFO, _high(11)),
)
TABLES: Final[dict[str, tuple[Test, ...]]] = {
    # Statusword, masks of CiA 402 (manual, table 49)
    "statusword": (*_CIA402, Test(SignKind.FOLLOWING_ERROR, _WARNING, _high(13))),
    # States of DSP-408 in bits 0 to 3; ready (bit 3) is withdrawn in those of faults (ED2 manual, 4.8.3 and 5.7)
    "ed2_statusword": (
        Test(SignKind.AXIS_FAULT, _ERROR, lambda raw: raw & 0x0F in (0x1, 0x3, 0x7)),
        Test(SignKind.AXIS_ENABLED, _INFO, lambda raw: raw & 0x0F == 0x0F),
        Test(SignKind.AXIS_WARNING, _WARNING, _high(5)),
    ),
    "pd4e_statusword": _CIA402,  # bit 13 is a following error in some modes only, and no other bit tells which
    "controlword": (Test(SignKind.EFC_COMMAND, _WARNING, _high(11)),),
    # Inputs of the axis; those of safety are at 24 V when all is well (manual, tables 71 and 72)
    "pmc_digital_inputs": (
        Test(SignKind.EFC_INPUT, _ERROR, _low(18), 18),
        Test(SignKind.ENABLE_INPUT, _WARNING, _low(3), 3),
        Test(SignKind.LIMIT_SWITCH, _WARNING, _low(0), 0),
        Test(SignKind.LIMIT_SWITCH, _WARNING, _low(1), 1),
        Test(SignKind.FEATHER_SWITCH, _INFO, _high(16), 16),
    ),
    "pmc_digital_outputs": (Test(SignKind.WATCHDOG_OPEN, _ERROR, _low(16), 16),),
    # X13.10, X13.8 and X13.7 of the power unit see the end of the safety chain (manual, 4.7.1.3)
    "pmm_digital_inputs": (Test(SignKind.CHAIN_OPEN, _ERROR, _any_low(0, 2, 3), 0),),
    "pmm_digital_outputs": (Test(SignKind.RELAY_OPEN, _ERROR, _low(16), 16),),
    "pmm_status": (
        Test(SignKind.PMM_WARNING, _WARNING, _high(1), 1),
        Test(SignKind.PMM_FAULT, _ERROR, _high(2), 2),
        Test(SignKind.BATTERY_FAULT, _ERROR, _high(3), 3),
        Test(SignKind.ON_BATTERY, _WARNING, _high(5), 5),
        Test(SignKind.MAINS_HIGH, _WARNING, _high(6), 6),
        Test(SignKind.MAINS_PHASE, _WARNING, _high(7), 7),
    ),
    "booster_status": (Test(SignKind.BOOSTER, _INFO, _high(1), 1),),
    "test_status": (Test(SignKind.BATTERY_TEST, _WARNING, _high(4), 4),),
}
"""Tests by the id of the bit table. Bits that stand for an error code are added from the description."""

_READ_BACK: Final = {"pmc_digital_outputs", "pmm_digital_outputs"}
"""Tables that outputs and their masks share: only what is read back tells what is."""
HOLD_UP_OVER: Final = Test(SignKind.HOLD_UP_OVER, _WARNING, lambda raw: raw == 0)
HOLD_UP_LEFT: Final = {"oat-pmm": Address(0x30B2)}
"""The time that is left of a mains failure before the unit opens the safety chain (manual, 4.2.1.2)."""


class WatchedBit(NamedTuple):
    """A test of an object, with the subject and the details of its signs."""

    address: Address
    test: Test
    subject: str
    details: dict[str, Any]


def watched_bits(description: Description) -> Iterator[WatchedBit]:
    """All tests that the objects of a device ask for."""
    for entry in description:
        read_only = entry.access is Access.RO
        if entry.bits is None or (entry.bits in _READ_BACK and not read_only):
            continue
        for test in TABLES.get(entry.bits, ()):
            yield _watched(description, entry, test)
        for bit in _error_bits(description, entry) if read_only else ():
            yield _watched(description, entry, Test(SignKind.DEVICE_STATUS, _WARNING, _high(bit), bit))
    left = HOLD_UP_LEFT.get(description.id)
    if left is not None and left in description.entries:
        yield WatchedBit(left, HOLD_UP_OVER, left.short, {"address": left.short})


def _watched(description: Description, entry: Entry, test: Test) -> WatchedBit:
    details: dict[str, Any] = {"address": entry.address.short}
    if test.bit is None:
        return WatchedBit(entry.address, test, entry.address.short, details)
    assert entry.bits is not None  # only objects with a bit table come here
    named = next((one for one in description.bit_tables[entry.bits].bits if one.bit == test.bit), None)
    if named is not None:
        details |= {"bit_number": test.bit, "bit_key": named.text_key, "clamp": named.clamp}
        if named.error_code is not None:
            details |= {"code": named.error_code, "code_hex": f"{named.error_code:04X}h"}
    return WatchedBit(entry.address, test, f"{entry.address.short}.{test.bit}", details)


def _error_bits(description: Description, entry: Entry) -> Iterator[int]:
    """Bits with an error code that no test of the table is about."""
    assert entry.bits is not None
    told = {test.bit for test in TABLES.get(entry.bits, ())}
    for bit in description.bit_tables[entry.bits].bits:
        if bit.error_code is not None and bit.bit not in told:
            yield bit.bit
