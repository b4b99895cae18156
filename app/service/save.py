"""Make RAM values non-volatile (1010h), whole or by category, and restart a device to prove it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

from app.drivers.contract import Driver
from app.errors import DeviceError, HubsideError, PreconditionError
from app.model.address import Address
from app.model.description import SaveCommand
from app.model.saving import Category, has_categories, text_key
from app.service.devices import Target
from app.service.journal import Journal, Kind
from app.wire.memory import StoredState

STAMP: Final = (Address(0x1020, 1), Address(0x1020, 2))
"""Date and time of the configuration: a device that has them keeps them with each save (CiA 301, 7.5.2.22)."""


RESTART_S: Final = 15.0
BY_HAND_S: Final = 120.0
"""Time to go to a cabinet and back."""


@dataclass(frozen=True, slots=True)
class Took:
    """An action that the device acknowledged, and how long it took in seconds.

    ``proven``, after a restart: whether what was saved last before it is in force, by its date and time (1020h); None
    where the device keeps none, or no save of it was seen.
    """

    t_ns: int
    took_s: float
    proven: bool | None = None


def save_command(target: Target, category: Category = None) -> SaveCommand:
    """The device's command that saves ``category``, or all. Raises PreconditionError where it has none."""
    for command in target.description.save:
        if command.category == category:
            return command
    known = ", ".join(command.category or "all" for command in target.description.save) or "none"
    raise PreconditionError(address="1010", name="save", needs=f"a category of: {known}", found=category or "all")


async def save(
    driver: Driver, target: Target, journal: Journal, now_ns: Callable[[], int], category: Category = None
) -> Took:
    """Save ``category``, or all, and wait for the end: these values of RAM stand in non-volatile memory then.

    Not proven before a restart. Raises PreconditionError (the device stands not still, or has no such category: nothing
    was saved), SdoAbortError, NoAnswerError or UnverifiedError; then nothing is known of the non-volatile memory.
    """
    await target.pass_gate(driver, save_command(target, category).address)
    started_ns = now_ns()
    try:
        await driver.save(target.node, category)
    except DeviceError as error:
        if has_categories(target.description):
            journal.note(Kind.SAVE_REFUSED, target.slug, category_key=text_key(category), reason=_why(error))
        raise
    took = Took(now_ns(), (now_ns() - started_ns) / 1e9)
    if has_categories(target.description):
        journal.note(Kind.SAVED_PART, target.slug, category_key=text_key(category), took_s=f"{took.took_s:.2f}")
    else:
        journal.note(Kind.SAVED, target.slug, took_s=f"{took.took_s:.2f}")
    return took


async def save_each(
    driver: Driver, target: Target, journal: Journal, now_ns: Callable[[], int], categories: Iterable[Category]
) -> Took:
    """One save after the other. What ``save`` raises ends it: those before it have been saved."""
    took_s = 0.0
    for category in categories:
        took_s += (await save(driver, target, journal, now_ns, category)).took_s
    return Took(now_ns(), took_s)


async def restart(
    driver: Driver,
    target: Target,
    journal: Journal,
    now_ns: Callable[[], int],
    timeout_s: float | None = None,
    sure: Callable[[], None] | None = None,
) -> Took:
    """Restart the device, or wait until somebody has switched it off and on, until it is back. Raises NoAnswerError.

    ``timeout_s``: by default 15 s, and ``BY_HAND_S`` for a person.

    ``sure`` raises what speaks against it at the last moment: nothing else comes between it and the command.
    """
    await target.pass_gate(driver)
    stamp = _saved_stamp(target)
    if sure is not None:
        sure()
    started_ns = now_ns()
    journal.note(Kind.RESTART, target.slug)
    default_s = BY_HAND_S if driver.restarts_by_hand else RESTART_S
    await driver.restart(target.node, default_s if timeout_s is None else timeout_s)
    back_ns = now_ns()
    proven = None if stamp is None else await _bears(driver, target, stamp)
    if proven is not None:
        journal.note(Kind.SAVE_PROVEN if proven else Kind.SAVE_NOT_PROVEN, target.slug)
    return Took(back_ns, (back_ns - started_ns) / 1e9, proven)


def _saved_stamp(target: Target) -> tuple[int, int] | None:
    """The date and time that were saved last, as the wire has shown; None where they are not known."""
    found = []
    for address in STAMP:
        view = target.live.value(target.device.bus, target.node, address)
        if address not in target.description.entries or view is None or view.stored is None:
            return None
        if view.stored.state is not StoredState.SAVED:
            return None
        found.append(int.from_bytes(view.stored.data, "little"))
    return found[0], found[1]


async def _bears(driver: Driver, target: Target, stamp: tuple[int, int]) -> bool | None:
    """None where the device does not say it: it has restarted all the same."""
    try:
        return await driver.bears(target.node, stamp)
    except HubsideError:
        return None


def _why(error: DeviceError) -> str:
    code = error.details.get("abort_code")
    return f"{code:08X}h" if isinstance(code, int) else error.code
