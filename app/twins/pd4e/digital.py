"""Digital inputs and outputs with their special functions and routing (manual, 7.1; 3240h, 3242h, 3250h, 3252h).

An object of inputs or outputs has special functions in its lower 16 bits and plain pins from bit 16 on. Which bit is
which, the numbers of the sources and the sub-indices are those of sibling drives; the order of the entries agrees.
"""

from __future__ import annotations

from typing import Final

from app.twins.object_store import ObjectStore

_FIRST_PIN: Final = 16
_SPECIAL: Final = 0xFFFF
_INVERTED: Final = 0x80
_PINS: Final = 16
_LIMITS: Final = 0x3
_SIGNAL_BRAKE: Final = 0x10
_SIGNAL_HIGH: Final = 0x00
_FROM_OUTPUTS: Final = 0x80


class Input:
    """Sub-indices of 3240h."""

    SPECIAL = 1
    INVERTED = 2
    FORCED = 3
    FORCE_VALUE = 4
    RAW = 5
    ROUTING = 8


class Output:
    """Sub-indices of 3250h."""

    INVERTED = 2
    FORCED = 3
    FORCE_VALUE = 4
    RAW = 5
    ROUTING = 8


def raw_inputs(levels: int) -> int:
    """3240h:05: levels of the pins, seen both as special functions (the first three) and as plain inputs."""
    return (levels & 0x7) | (levels & 0xFFFF) << _FIRST_PIN


def inputs(store: ObjectStore, levels: int) -> int:
    """60FDh for the levels of the pins, bit 0 for input 1."""
    if store.number(0x3240, Input.ROUTING):
        return _routed_inputs(store, levels)
    value = raw_inputs(levels) ^ store.number(0x3240, Input.INVERTED)
    forced = store.number(0x3240, Input.FORCED)
    value = (value & ~forced) | (store.number(0x3240, Input.FORCE_VALUE) & forced)
    return value & ~(_SPECIAL & ~store.number(0x3240, Input.SPECIAL)) & 0xFFFFFFFF


def route_as_before(store: ObjectStore) -> None:
    """Routing was switched on: let 3242h begin with what the inputs did until now (manual, 7.1.2)."""
    special, inverted = store.number(0x3240, Input.SPECIAL), store.number(0x3240, Input.INVERTED)
    for bit in range(32):
        cell = store.find(0x3242, bit + 1)
        if cell is None:
            continue
        pin = bit - _FIRST_PIN + 1 if bit >= _FIRST_PIN else bit + 1
        used = bit >= _FIRST_PIN or (bit < 3 and special >> bit & 1)
        cell.raw = (pin | (_INVERTED if inverted >> bit & 1 else 0)) if used else 0


def _routed_inputs(store: ObjectStore, levels: int) -> int:
    value = 0
    for bit in range(32):
        cell = store.find(0x3242, bit + 1)
        if cell is not None and _source(cell.number, levels):
            value |= 1 << bit
    return value


def _source(number: int, levels: int) -> int:
    """Level of a source: 0 is low, 1 to 16 are the pins, with bit 7 inverted. Encoder and Hall signals stay low."""
    pin = number & ~_INVERTED
    level = levels >> pin - 1 & 1 if 1 <= pin <= _PINS else 0
    return level ^ (1 if number & _INVERTED else 0)


def outputs(store: ObjectStore, brake_open: bool) -> int:
    """3250h:05, the levels of the output pins from bit 16 on, and of the brake in bit 0."""
    wanted = store.number(0x60FE, 1)
    if store.number(0x3202) & 0x4:
        wanted = (wanted & ~1) | int(brake_open)
    if store.number(0x3250, Output.ROUTING):
        return _routed_outputs(store, wanted)
    value = wanted ^ store.number(0x3250, Output.INVERTED)
    forced = store.number(0x3250, Output.FORCED)
    return ((value & ~forced) | (store.number(0x3250, Output.FORCE_VALUE) & forced)) & 0xFFFFFFFF


def _routed_outputs(store: ObjectStore, wanted: int) -> int:
    """Each pin by 3252h: a signal in the high byte, switched by the bit of 60FEh that the low byte names.

    OPEN what else the low byte can say; without its bit 7 no bit of 60FEh switches. Divided encoder signals stay low.
    """
    value = 0
    for number in range(1, 6):
        cell = store.find(0x3252, number)
        if cell is None:
            continue
        signal, control = cell.number >> 8, cell.number & 0xFF
        level = signal == _SIGNAL_HIGH or (signal == _SIGNAL_BRAKE and bool(wanted & 1))
        if control & _FROM_OUTPUTS and not wanted >> (control & 0x1F) & 1:
            level = False
        if level:
            value |= 1 if number == 1 else 1 << _FIRST_PIN + number - 2
    return value
