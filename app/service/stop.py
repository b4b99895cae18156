"""STOP and FEATHER: to every axis of the live connection, on the shortest path there is.

An axis is stopped by the word that its state machine names: quick stop of CiA 402, or one that takes the power away.
Where the node is operational and an event-driven RPDO carries the controlword alone, one frame does it; an RPDO that
waits for a SYNC or has an inhibit time is none for this, nor is one of which that is not known. Otherwise our running
transfer to that node is aborted and 6040h is written by SDO, ahead of everything that waits. A write of 6040h that was
asked for before and has not left yet does not leave any more; after one that has left the command goes by SDO too, for
a device works these in their order; and so it does where the axis does not obey a frame within 30 ms. No lock, lease,
consent or error of another axis holds them back. This is not a safety function.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Final

from app.drivers.contract import Driver
from app.errors import BusLostError, HubsideError, OvertakenError, UsageError
from app.model.address import Address
from app.model.axis_machine import CIA_402, StateMachine
from app.model.description import Verify
from app.service.devices import Target, decode
from app.service.journal import Journal, Kind

CONTROLWORD: Final = Address(0x6040)
EFC_TARGET: Final = Address(0x567A)
STATUSWORD: Final = Address(0x6041)
_OBEY_S: Final = 0.03


class Command(Enum):
    """What is sent; the value is the controlword of CiA 402 (quick stop; EFC is bit 11 of the maker).

    An axis with another state machine has a word of its own for STOP, and none for FEATHER: ``word_for``.
    """

    STOP = 0x010B
    FEATHER = 0x080F


class Path(Enum):
    """Which way the controlword went."""

    RPDO = "rpdo"
    SDO = "sdo"
    REPLACED = "replaced"
    """Not sent: a newer command came first."""
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class AxisOutcome:
    """What became of the command at one axis. ``confirmed`` once its statusword says that it obeys."""

    device: str
    how: Path
    sent_t_ns: int
    confirmed_t_ns: int | None
    error: HubsideError | None = None


@dataclass(frozen=True, slots=True)
class Axis:
    """An axis and how it is reached. ``by_rpdo`` sends the controlword as a PDO; False: it has to be written too."""

    driver: Driver
    target: Target
    by_rpdo: Callable[[bytes], bool]


async def command_all(
    axes: Iterable[Axis], command: Command, journal: Journal, now_ns: Callable[[], int]
) -> list[AxisOutcome]:
    """Send ``command`` to all axes at once. Never raises for one axis' sake.

    FEATHER goes to those that have it: bit 11 of a drive without an EFC says nothing, and the rest would enable it.
    """
    outcomes = await asyncio.gather(
        *(_command(axis, command, now_ns) for axis in axes if command is Command.STOP or has_feather(axis.target))
    )
    kind = Kind.STOP_SENT if command is Command.STOP else Kind.FEATHER_SENT
    sent = [outcome for outcome in outcomes if outcome.how is not Path.FAILED]
    journal.note(kind, None, count=len(sent), failed=len(outcomes) - len(sent))
    return list(outcomes)


def is_axis(target: Target) -> bool:
    """True for a device that is commanded by a controlword: its description tells its state machine."""
    return target.description.machine is not None


def machine_of(target: Target) -> StateMachine:
    """The state machine of an axis. Raises UsageError."""
    machine = target.description.machine
    if machine is None:
        raise UsageError(reason=f"{target.slug} is no axis")
    return machine


def is_cia402(target: Target) -> bool:
    """True for an axis of the profile CiA 402."""
    return target.description.machine is CIA_402


def word_for(target: Target, command: Command) -> bytes:
    """The controlword by which an axis obeys ``command``."""
    word = machine_of(target).stop_word if command is Command.STOP else command.value
    return word.to_bytes(2, "little")


def has_feather(target: Target) -> bool:
    """True for an axis with an EFC of its own (bit 11 of the controlword)."""
    return EFC_TARGET in target.description.entries


async def _command(axis: Axis, command: Command, now_ns: Callable[[], int]) -> AxisOutcome:
    driver, target = axis.driver, axis.target
    data, controlword = word_for(target, command), machine_of(target).controlword
    sent_t_ns = now_ns()
    try:
        if _by_rpdo(axis, data):
            how = Path.RPDO
            mark = driver.commanded(target.node, controlword)
        else:
            await driver.write(target.node, controlword, data, verify=Verify.ACK, urgent=True)
            how = Path.SDO
        confirmed = await _confirmed(driver, target, command)
        if how is Path.RPDO and not confirmed:
            confirmed = await _by_sdo_too(driver, target, command, data, mark)
    except OvertakenError:
        return AxisOutcome(target.slug, Path.REPLACED, sent_t_ns, None)
    except HubsideError as error:
        return AxisOutcome(target.slug, Path.FAILED, sent_t_ns, None, error)
    return AxisOutcome(target.slug, how, sent_t_ns, now_ns() if confirmed else None)


async def _by_sdo_too(driver: Driver, target: Target, command: Command, data: bytes, mark: int) -> bool:
    """The axis does not obey, or not yet: somebody else may have switched the PDO off, or its frame was lost.

    Raises OvertakenError where a newer command came meanwhile: this one must not come after it.
    """
    await asyncio.sleep(_OBEY_S)
    confirmed = await _confirmed(driver, target, command)
    if driver.commanded(target.node, CONTROLWORD) != mark:
        raise OvertakenError(address=CONTROLWORD.short, node=target.node)
    if confirmed:
        return True
    await driver.write(target.node, CONTROLWORD, data, verify=Verify.ACK, urgent=True)
    return await _confirmed(driver, target, command)


def _by_rpdo(axis: Axis, data: bytes) -> bool:
    """Whether a PDO took it; where the adapter did not take the frame, the SDO channel is tried as well."""
    try:
        return axis.by_rpdo(data)
    except BusLostError:
        return False


async def _confirmed(driver: Driver, target: Target, command: Command) -> bool:
    """The statusword says that the axis obeys: it follows nothing any more (STOP), or drives there (FEATHER)."""
    machine = machine_of(target)
    raw = decode(target.entry(machine.statusword), await driver.read(target.node, machine.statusword, urgent=True))
    if not isinstance(raw, int):
        return False
    if command is Command.FEATHER:
        return machine.runs(raw)
    return not machine.runs(raw) if machine is CIA_402 else machine.rests(raw)
