"""What becomes of each object of a set: written, equal already, or not restored and why."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from app.errors import RefusedError
from app.model.address import Address
from app.model.checks import Allow, check_write
from app.model.datatypes import Raw
from app.model.description import Access, Description, Entry, RestoreClass
from app.model.restore.plan import PlanRow, Treatment, Why
from app.model.restore.wanted import PlanOptions, Values
from app.model.station import DeviceValues, Place


def is_parameter(entry: Entry) -> bool:
    """True for what a set is kept for: saved by the device, and settable, be it by the maker only."""
    return entry.saved and (entry.access.writable or entry.access is Access.FACTORY)


def rows_of(device: DeviceValues, wanted: Values, options: PlanOptions) -> Iterator[PlanRow]:
    """One row for every object of the set and every parameter of the device, in the order of their addresses."""
    parameters = {entry.address for entry in device.description if is_parameter(entry)}
    for address in sorted(parameters | set(wanted.values), key=lambda one: (one.major, one.minor)):
        yield _row(device, address, wanted, options)


def allowed(entry: Entry, options: PlanOptions) -> Allow:
    """What the write of a row may do beyond ordinary parameters.

    A row that changes the network address is in a batch only, never in a restore; whether it may is not asked here.
    """
    if entry.restore is RestoreClass.NETWORK:
        return Allow.ADDRESS
    return Allow.FACTORY if entry.restore is RestoreClass.FACTORY and options.expert else Allow.NOTHING


def _row(device: DeviceValues, address: Address, wanted: Values, options: PlanOptions) -> PlanRow:
    place = Place(device.slug, address)
    now, target = device.values.get(address), wanted.values.get(address)
    entry = device.description.entries.get(address)
    if entry is None:
        return PlanRow(place, Treatment.SKIP, now, target, Why.NOT_ON_DEVICE)
    if not entry.access.writable and entry.access is not Access.FACTORY:
        return PlanRow(place, Treatment.SKIP, now, target, Why.READ_ONLY)
    if target is None:
        reason = wanted.unread.get(address)
        return PlanRow(place, Treatment.SKIP, now, None, Why.NOT_IN_SET, {"unread": reason} if reason else {})
    if entry.restore is RestoreClass.NEVER:
        return PlanRow(place, Treatment.SKIP, now, target, Why.NEVER)
    if entry.counts:
        return PlanRow(place, Treatment.SKIP, now, target, Why.COUNTS)
    if now == target:
        return PlanRow(place, Treatment.EQUAL, now, target)
    why, details = _refusal(device, entry, target, options)
    return PlanRow(place, Treatment.WRITE if why is None else Treatment.SKIP, now, target, why, details)


def _refusal(
    device: DeviceValues, entry: Entry, target: Raw, options: PlanOptions
) -> tuple[Why | None, Mapping[str, str]]:
    """Why a value that differs is not written, None where it is. What the person chose comes last."""
    if entry.restore is RestoreClass.UNIT and not options.same_unit.get(device.slug, False):
        return Why.OTHER_UNIT, {}
    if entry.restore is RestoreClass.NETWORK and not options.network:
        return Why.NETWORK, {}
    if entry.restore is RestoreClass.FACTORY and not options.expert:
        return Why.NEEDS_EXPERT, {}
    if entry.address not in device.values:
        return Why.UNREADABLE, {}
    unmet = _unmet(device, entry, target)
    if unmet is not None:
        return Why.CONDITION, unmet
    if not options.returning and breaks_saving(device.description, entry.address, target):
        return Why.NOT_SAVABLE, {}
    if not options.returning and _irrevocable(device, entry, options):
        return Why.IRREVOCABLE, {}
    misfit = _misfit(device.description, entry, target, options)
    if misfit is not None:
        return Why.MISFIT, {"error_key": misfit.text_key} | {key: str(value) for key, value in misfit.details.items()}
    if options.selected is not None and Place(device.slug, entry.address) not in options.selected:
        source = entry.overwritten_by
        if source is not None and device.values[entry.address] == device.values.get(source):
            return Why.LEFT_BY_FEATHER, {"source": source.short}
        return Why.NOT_SELECTED, {}
    return None, {}


def breaks_saving(description: Description, address: Address, raw: Raw) -> bool:
    """True where the device takes no command to save while the object holds ``raw``."""
    commands = (description.entry(command.address) for command in description.save)
    conditions = (condition for entry in commands for condition in entry.requires)
    return any(condition.address == address and raw not in condition.values for condition in conditions)


def _unmet(device: DeviceValues, entry: Entry, target: Raw) -> Mapping[str, str] | None:
    """The precondition that nothing can fulfil: of a value that is kept and that only the device's making decides."""
    for condition in entry.requires:
        named = device.description.entries.get(condition.address)
        found = device.values.get(condition.address)
        fixed = named is not None and named.saved and not named.access.writable
        if fixed and condition.concerns(target) and found is not None and found not in condition.values:
            allowed_values = " / ".join(map(str, condition.values))
            return {"needs": f"{condition.address.short} = {allowed_values}", "found": str(found)}
    return None


def _irrevocable(device: DeviceValues, entry: Entry, options: PlanOptions) -> bool:
    """True where the present value would be refused if it were to be written again."""
    conditions = {condition.address for condition in entry.requires}

    def lookup(address: Address) -> Raw | None:
        return None if address in conditions else device.values.get(address)

    try:
        check_write(device.description, entry, device.values[entry.address], lookup, allow=allowed(entry, options))
    except RefusedError:
        return True
    return False


def _misfit(description: Description, entry: Entry, raw: Raw, options: PlanOptions) -> RefusedError | None:
    """What no order of writes could mend: the type, a fixed limit, the enumeration, an object that moves an axis."""
    try:
        check_write(description, entry, raw, lambda _address: None, allow=allowed(entry, options))
    except RefusedError as error:
        return error
    return None
