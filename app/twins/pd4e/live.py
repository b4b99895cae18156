"""What the dictionary shows of the running device: process values, errors, the addresses in force."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Final

from app.model.datatypes import Raw
from app.twins.object_store import RefusedAccessError
from app.twins.pd4e.digital import raw_inputs
from app.twins.pd4e.error_stack import DEPTH
from app.twins.pd4e.more_modes import rated_ma
from app.wire.sdo import Abort

if TYPE_CHECKING:
    from app.twins.pd4e.device import Pd4e

_STATIC: Final = 0x1
"""Bit of 2010h: the static address is used."""
_LOOPBACK: Final = 0x7F000001
_LOOPBACK_MASK: Final = 0xFF000000
MAC: Final = "02-48-55-42-53-01"
"""Locally administered: no maker owns it."""
_PER_MILLE: Final = 1000
_MS: Final = 1_000_000


def connect(device: Pd4e) -> None:
    """Give every live object of the dictionary its source; objects that the description does not have are left out."""
    _identity(device)
    _errors(device)
    _motion(device)
    _currents(device)
    _surroundings(device)
    _analogue(device)
    _ethernet(device)


def _show(device: Pd4e, index: int, sub: int, source: Callable[[], Raw]) -> None:
    cell = device.store.find(index, sub)
    if cell is not None:
        cell.source = source


def _identity(device: Pd4e) -> None:
    name = device.store.find(0x1008)
    told = name.entry.default if name is not None else None
    plain = told if isinstance(told, str) and told else device.settings.variant.upper()
    _show(device, 0x1008, 0, lambda: f"HUBSIDE TWIN {plain}")
    _show(device, 0x4040, 0, lambda: device.settings.serial)


def _errors(device: Pd4e) -> None:
    _show(device, 0x1001, 0, lambda: device.drive.errors.register)
    _show(device, 0x603F, 0, lambda: device.drive.errors.code)
    _show(device, 0x1003, 0, lambda: len(device.drive.errors))
    for place in range(1, DEPTH + 1):
        _show(device, 0x1003, place, _entry(device, place))
    _show(device, 0x2301, 0, lambda: device.nanoj.status)
    _show(device, 0x2302, 0, lambda: int(device.nanoj.error))


def _entry(device: Pd4e, place: int) -> Callable[[], Raw]:
    """A place of 1003h; an empty one cannot be read (by sibling drives)."""

    def read() -> Raw:
        entry = device.drive.errors.entry(place)
        if entry is None:
            raise RefusedAccessError(Abort.NO_DATA)
        return entry

    return read


def _motion(device: Pd4e) -> None:
    drive, axis, servo = device.drive, device.drive.axis, device.servo
    _show(device, 0x6041, 0, lambda: drive.statusword)
    _show(device, 0x6061, 0, lambda: int(drive.mode_code))
    _show(device, 0x6062, 0, lambda: axis.user_position(axis.reference.position))
    _show(device, 0x6063, 0, lambda: axis.increments)
    _show(device, 0x6064, 0, lambda: axis.user_position(axis.measured))
    _show(device, 0x606B, 0, lambda: axis.user_velocity(axis.reference.velocity))
    _show(device, 0x606C, 0, lambda: axis.user_velocity(servo.velocity))
    _show(device, 0x60F4, 0, lambda: axis.following_error)
    _show(device, 0x60FC, 0, lambda: round((axis.reference.position - axis.encoder_start) * axis.units.increments))
    factor = drive.velocity_factor
    _show(device, 0x6043, 0, lambda: round(axis.user_velocity(axis.reference.velocity) / factor()))
    _show(device, 0x6044, 0, lambda: round(axis.user_velocity(servo.velocity) / factor()))
    for sub in (1, 2):
        _show(device, 0x60E4, sub, lambda: axis.user_position(axis.measured))
        _show(device, 0x60E5, sub, lambda: axis.user_velocity(servo.velocity))
    _show(device, 0x60FD, 0, lambda: drive.inputs)
    _show(device, 0x3240, 5, lambda: raw_inputs(drive.levels))
    _show(device, 0x3250, 5, lambda: drive.outputs)


def _currents(device: Pd4e) -> None:
    drive, axis, servo = device.drive, device.drive.axis, device.servo
    _show(device, 0x6074, 0, lambda: drive.torque_demand)
    _show(device, 0x6077, 0, lambda: round(servo.current_ma * _PER_MILLE / max(rated_ma(axis), 1)))
    _show(device, 0x203B, 3, lambda: round(drive.current_limits.threshold))
    _show(device, 0x203B, 4, lambda: round(drive.overload.spent))
    _show(device, 0x203B, 5, lambda: drive.overload.allowed_ma(drive.current_limits))
    _show(device, 0x203B, 6, lambda: int(drive.overload.limiting))
    # The torque-producing current stands for the whole; the field-producing one and the phases stay 0.
    _show(device, 0x2039, 2, lambda: round(servo.current_ma))


def _surroundings(device: Pd4e) -> None:
    drive = device.drive
    _show(device, 0x230F, 0, lambda: (device.now_ns - device.started_ns) // (1000 * _MS))
    _show(device, 0x4014, 1, lambda: drive.conditions.supply_mv)
    _show(device, 0x4014, 2, lambda: drive.conditions.logic_mv)
    _show(device, 0x4014, 3, lambda: round(drive.temperature_c * 10))
    _show(device, 0x4014, 4, lambda: round(drive.temperature_c * 10))


def _analogue(device: Pd4e) -> None:
    """Digits as they come (3220h), and (digits + 3321h) / 3322h in 3320h (manual, 3321h and 3322h)."""
    for place in (0, 1):
        _show(device, 0x3220, place + 1, partial(_digits, device, place))
        _show(device, 0x3320, place + 1, partial(_scaled, device, place))


def _digits(device: Pd4e, place: int) -> int:
    return device.drive.conditions.analogue[place]


def _scaled(device: Pd4e, place: int) -> int:
    """OPEN how a quotient is rounded and what a divisor of 0 does: towards 0, and as 1."""
    store = device.store
    offset, divisor = store.number(0x3321, place + 1), store.number(0x3322, place + 1) or 1
    number = _digits(device, place) + offset
    quotient = abs(number) // abs(divisor)
    return quotient if (number < 0) == (divisor < 0) else -quotient


def _ethernet(device: Pd4e) -> None:
    """Addresses come into force with a restart; the twin itself stays where it is served."""
    _show(device, 0x200F, 0, lambda: MAC)
    device.at_restart.append(lambda: _take_address(device))


def _take_address(device: Pd4e) -> None:
    store = device.store
    control, static = store.find(0x2010), store.find(0x2011)
    if control is None or static is None:
        return
    fixed = bool(control.number & _STATIC) and static.number != 0
    address = static.number if fixed else _LOOPBACK
    mask = store.number(0x2012) if fixed else _LOOPBACK_MASK
    gateway = store.number(0x2013) if fixed else 0
    for index, number in ((0x2014, address), (0x2015, mask), (0x2016, gateway)):
        cell = store.find(index)
        if cell is not None:
            cell.raw = number
