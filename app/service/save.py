"""Make RAM values non-volatile (1010h), and restart a device to prove it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from app.drivers.contract import Driver
from app.errors import PreconditionError
from app.model.datatypes import DataType, encode_raw
from app.model.description import SaveCommand, Verify
from app.service.devices import Target
from app.service.journal import Journal, Kind


@dataclass(frozen=True, slots=True)
class Took:
    """An action that the device acknowledged, and how long it took in seconds."""

    t_ns: int
    took_s: float


def save_command(target: Target, category: str | None = None) -> SaveCommand:
    """The device's command that saves ``category``, or all. Raises PreconditionError where it has none."""
    for command in target.description.save:
        if command.category == category:
            return command
    known = ", ".join(command.category or "all" for command in target.description.save) or "none"
    raise PreconditionError(address="1010", name="save", needs=f"a category of: {known}", found=category or "all")


async def save(
    driver: Driver, target: Target, journal: Journal, now_ns: Callable[[], int], category: str | None = None
) -> Took:
    """Write 'save' and wait for the acknowledge: all values of RAM stand in non-volatile memory then.

    Raises SdoAbortError, NoAnswerError or UnverifiedError; then nothing is known of the non-volatile memory.
    """
    await target.pass_gate(driver)
    command = save_command(target, category)
    data = encode_raw(DataType.UNSIGNED32, command.signature)
    started_ns = now_ns()
    await driver.write(target.node, command.address, data, command.timeout_s, Verify.ACK)
    took = Took(now_ns(), (now_ns() - started_ns) / 1e9)
    journal.note(Kind.SAVED, target.slug, took_s=f"{took.took_s:.2f}")
    return took


async def restart(
    driver: Driver,
    target: Target,
    journal: Journal,
    now_ns: Callable[[], int],
    timeout_s: float = 15.0,
    sure: Callable[[], None] | None = None,
) -> Took:
    """Restart the device (NMT reset node) and wait for its boot-up message. Raises NoAnswerError.

    ``sure`` raises what speaks against it at the last moment: nothing else comes between it and the command.
    """
    await target.pass_gate(driver)
    if sure is not None:
        sure()
    started_ns = now_ns()
    journal.note(Kind.RESTART, target.slug)
    await driver.restart(target.node, timeout_s)
    return Took(now_ns(), (now_ns() - started_ns) / 1e9)
