"""Write one parameter: checked before anything is sent, written, read back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.drivers.contract import Driver, Written
from app.errors import (
    ConflictError,
    DeviceError,
    HubsideError,
    LimitError,
    NoAnswerError,
    PreconditionError,
    UnverifiedError,
    because,
)
from app.model.address import Address
from app.model.checks import Allow, check_write
from app.model.datatypes import Raw, encode_raw
from app.model.description import Entry, Verify
from app.model.sets import IDENTITY
from app.model.values import depends_on, parse, show
from app.service.address_change import require_confirmed
from app.service.devices import Target, decode
from app.service.journal import Journal, Kind

_VARIANT: Final = (IDENTITY["device_name"], IDENTITY["product_code"])


@dataclass(frozen=True, slots=True)
class WriteResult:
    """What happened to one object.

    ``read`` is what was read back; None where the description proves a write by other means. ``verified`` is False
    where only an effect would prove it, which is not looked for here.
    """

    address: Address
    was: Raw | None
    sent: Raw
    read: Raw | None
    verified: bool
    how: Written


async def write_text(
    driver: Driver,
    target: Target,
    address: Address,
    text: str,
    journal: Journal,
    *,
    allow: Allow = Allow.NOTHING,
) -> WriteResult:
    """As ``write_raw``, for what a person typed (see ``app.model.values.parse``)."""
    entry = target.entry(address)
    await know_what_it_rests_on(driver, target, entry)
    raw = parse(target.description, entry, text, target.lookup)
    return await write_raw(driver, target, address, raw, journal, allow=allow)


async def write_raw(
    driver: Driver,
    target: Target,
    address: Address,
    raw: Raw,
    journal: Journal,
    *,
    allow: Allow = Allow.NOTHING,
    expected: Raw | None = None,
    known: int | None = None,
) -> WriteResult:
    """Check, write once, read back.

    ``expected`` is what the change was made from; where RAM holds another value, nothing is written (ConflictError).
    ``known``: urgent commands to the object when the write was decided on (``Driver.commanded``), by default those
    there are now; where another one comes before it leaves, nothing is written (OvertakenError).
    Raises RefusedError (nothing was sent; AddressChangeError: it needs a confirmation), DeviceError (the device
    refused), NoAnswerError, or UnverifiedError (sent, but another value was read back, or none).
    """
    known = driver.commanded(target.node, address) if known is None else known
    entry = target.entry(address)
    require_confirmed(target, entry, allow)
    await target.pass_gate(driver, address)
    await know_what_it_rests_on(driver, target, entry)
    data = await _checked(driver, target, entry, raw, allow)
    was = decode(entry, await driver.read(target.node, address, entry.timeout_s)) if entry.access.readable else None
    if expected is not None and was is not None and was != expected:
        raise ConflictError(
            address=address.short,
            name=entry.title,
            expected=_shown(target, entry, expected),
            found=_shown(target, entry, was),
        )
    shown = {"address": address.short, "name": entry.title, "was": _shown(target, entry, was)}
    await target.pass_gate(driver, address)  # once more: what was read meanwhile took its time
    try:
        how = await driver.write(target.node, address, data, entry.timeout_s, entry.verify, known=known)
        read = await _read_back(driver, target, entry, data)
    except HubsideError as error:
        journal.note(Kind.WRITE_FAILED, target.slug, **shown, reason=error.code, now=_shown(target, entry, raw))
        raise
    note_written(journal, target, entry, was, raw)
    return WriteResult(address, was, raw, read, read is not None or entry.verify is Verify.ACK, how)


def note_written(journal: Journal, target: Target, entry: Entry, was: Raw | None, raw: Raw) -> None:
    """For the journal: ``raw`` stands in the object now; ``was`` before it, None where that is not known."""
    journal.note(
        Kind.WRITTEN,
        target.slug,
        address=entry.address.short,
        name=entry.title,
        was=_shown(target, entry, was),
        now=_shown(target, entry, raw),
        data=encode_raw(entry.type, raw).hex(),
    )


async def _checked(driver: Driver, target: Target, entry: Entry, raw: Raw, allow: Allow) -> bytes:
    """The bytes to send. Nothing is refused for what was seen last, but for what the device says when asked again.

    What was seen may be older than an answer that a caller already has: frames reach the live state a little later.
    """
    try:
        return check_write(target.description, entry, raw, target.lookup, allow=allow, variant=target.variant)
    except (LimitError, PreconditionError):
        rests_on = [address for address in depends_on(entry) if address in target.description.entries]
        if not rests_on:
            raise
        answers = await driver.read_many(target.node, rests_on)
        asked = {a: decode(target.entry(a), answer) for a, answer in answers.items() if isinstance(answer, bytes)}
        return check_write(
            target.description,
            entry,
            raw,
            lambda address: asked.get(address, target.lookup(address)),
            allow=allow,
            variant=target.variant,
        )


async def know_what_it_rests_on(driver: Driver, target: Target, entry: Entry) -> None:
    """Read the objects that unit, limits and preconditions rest on and that nobody has seen yet.

    Where limits are those of a variant, what tells the variant is among them.
    """
    rests_on = (*depends_on(entry), *(_VARIANT if entry.limited_by_variant else ()))
    unknown = [a for a in rests_on if a in target.description.entries and target.lookup(a) is None]
    if unknown:
        await driver.read_many(target.node, unknown)


async def _read_back(driver: Driver, target: Target, entry: Entry, sent: bytes) -> Raw | None:
    if entry.verify is not Verify.EQUAL or not entry.access.readable:
        return None
    details = {"address": entry.address.short, "name": entry.title, "sent": sent.hex(" ")}
    try:
        found = await driver.read(target.node, entry.address, entry.timeout_s)
    except (NoAnswerError, DeviceError) as error:
        raise UnverifiedError(**(because(error) | details), found="–") from error
    if found != sent:
        raise UnverifiedError(**details, found=found.hex(" "), reason_key="unverified.other_value")
    return decode(entry, found)


def _shown(target: Target, entry: Entry, raw: Raw | None) -> str:
    return "–" if raw is None else show(entry, raw, target.lookup)
