"""What must hold before the first write. Each reason against a restore is named; none is repaired here."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from decimal import Decimal
from typing import Final

from app.errors import DeviceError, NoAnswerError
from app.model.address import Address
from app.model.axis_machine import StateMachine
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.restore.plan import Plan, StepKind, Treatment
from app.model.sets import Identity, ParameterSet
from app.model.station import Place
from app.model.values import quantity_of, to_scaled
from app.model.variant import variant_of
from app.recording.writer import RecorderState
from app.service.backup import read_device
from app.service.connection import Connection
from app.service.devices import Target
from app.service.gate import BARE_TURBINE
from app.service.restore.order import Given, Objection, Order, Refusal
from app.service.restore.survey import VELOCITY, Survey, is_driven, read_integer, stage_on
from app.service.stop import machine_of

MASTER_QUIET_NS: Final = 10_000_000_000
"""A master that was seen within so long is at work."""
STANDSTILL_DPS: Final = Decimal("0.1")
"""Up to this speed, in degrees a second, an axis stands."""
FEATHER_DEG: Final = Decimal(15)
"""So far before its feather position (567Ah) a blade counts as in feather: it makes no driving moment there."""
POSITION: Final = Address(0x6064)
FEATHER: Final = Address(0x567A)
_SCALING: Final = (Address(0x6092, 1), Address(0x6092, 2))
PMM_STATUS: Final = Address(0x3000)
SUPPLY_STATUS: Final = Address(0x3004)
_BATTERY: Final = 1 << 3
_MAINS: Final = 1 << 4 | 1 << 5 | 1 << 6 | 1 << 7
_24_VOLT: Final = 1 << 5 | 1 << 6
"""Bits of 3000h (manual table 11: battery fault; switch-off counter, under and over voltage, phase) and of 3004h."""


def objections_to_plan(plan: Plan) -> Iterator[Refusal]:
    """What speaks against the plan itself."""
    for finding in plan.blockers:
        device = finding.places[0].slug if finding.places else ""
        yield Refusal(
            Objection.RULES, device, {"rule": finding.rule_id, "rule_title_key": f"rule.{finding.rule_id}.title"}
        )
    if plan.unordered:
        places = ", ".join(f"{place.slug.rpartition('/')[2]} {place.address.short}" for place in plan.unordered)
        yield Refusal(Objection.NO_ORDER, "", {"addresses": places})
    if any(step.kind is StepKind.RESTART for step in plan.steps):
        for slug in dict.fromkeys(place.slug for place in plan.new_address):
            yield Refusal(Objection.NEW_ADDRESS, slug)
    if not any(step.kind is StepKind.WRITE for step in plan.steps) and not plan.unordered:
        yield Refusal(Objection.NOTHING_TO_DO)


def objections_to_saving(plan: Plan, found: Survey) -> Iterator[Refusal]:
    """Devices that would take no save at the end, such as one that is operated locally."""
    wanted = {row.place: row.wanted for row in plan.rows if row.treatment is Treatment.WRITE}
    for slug in dict.fromkeys(step.device for step in plan.steps if step.kind is StepKind.SAVE):
        device = found.station.device(slug)
        if device is None:
            continue
        saves = (device.description.entry(command.address) for command in device.description.save)
        for condition in (one for entry in saves for one in entry.requires):
            place = Place(slug, condition.address)
            raw = wanted.get(place, found.station.raw(place))
            if raw is not None and raw not in condition.values:
                needs = f"{condition.address.short} = {' / '.join(map(str, condition.values))}"
                yield Refusal(Objection.CANNOT_SAVE, slug, {"needs": needs, "found": str(raw)})


def objections_to_sets(order: Order, found: Survey, nameplates: Mapping[str, str | None]) -> Iterator[Refusal]:
    """What speaks against giving these sets to these devices."""
    for given in order.homeless:
        old = given.parameters
        yield Refusal(Objection.NO_DEVICE, "", {"from": old.origin.device, "set": old.description_id})
    if not order.given and not order.homeless:
        yield Refusal(Objection.NOTHING_GIVEN)
    for slug, given in order.given.items():
        now = found.sets.get(slug)
        if now is not None:
            yield from _objections_to_set(slug, given, now, nameplates.get(slug))
            description = next(one.target.description for one in found.reports if one.target.slug == slug)
            was, here = _variant(description, given.parameters), _variant(description, now)
            if not order.expert and _differ(was, here):
                yield Refusal(Objection.OTHER_VARIANT, slug, {"set": str(was), "device": str(here)})


def _objections_to_set(slug: str, given: Given, now: ParameterSet, nameplate: str | None) -> Iterator[Refusal]:
    old, new = given.parameters, now
    if old.description_id != new.description_id or _differ(old.identity.device_type, new.identity.device_type):
        yield Refusal(
            Objection.OTHER_DEVICE_TYPE,
            slug,
            {"set": _kind_of(old), "device": _kind_of(new)},
        )
    elif _major(old.description_version) != _major(new.description_version):
        yield Refusal(Objection.DESCRIPTION, slug, {"set": old.description_version, "device": new.description_version})
    was, software = old.identity.software, new.identity.software
    if was is not None and software is not None and _major(was) != _major(software):
        yield Refusal(Objection.FIRMWARE, slug, {"set": was, "device": software})
    if is_contradictory(old.identity, new.identity, nameplate):
        yield Refusal(Objection.IDENTITY, slug, {"set": _who(old.identity), "device": _who(new.identity, nameplate)})


def objections_to_going_on(connection: Connection, found: Survey) -> Iterator[Refusal]:
    """What speaks against going on to the new values after an interruption, other blades apart.

    An interruption may have opened the safety chain. The axis stands in feather then, and its stage stays on: that it
    is not driven is enough (``Hands.quiet``).
    """
    yield from (one for one in objections_to_state(found) if one.objection is not Objection.DRIVE_ENABLED)
    yield from objections_to_surroundings(connection, connection.stamper())


def objections_to_going_back(connection: Connection, found: Survey) -> Iterator[Refusal]:
    """What speaks against putting the old values back: what moves, and who else writes.

    Not the supply and the battery: what they show may come from the new values, and the way out must not need them.
    """
    unfit = (Objection.SUPPLY, Objection.BATTERY, Objection.NOT_RECORDING)
    yield from (one for one in objections_to_going_on(connection, found) if one.objection not in unfit)


def is_other_device(then: Identity, now: Identity, nameplate: str | None) -> bool:
    """True where another device answers than that of a restore. ``nameplate``: as it is known now."""
    kinds = ((getattr(then, name), getattr(now, name)) for name in ("device_type", "vendor_id", "product_code"))
    if any(_differ(one, other) for one, other in kinds) or then.mark != now.mark:
        return True
    return then.mark is None and then.nameplate is not None and then.nameplate != nameplate


def is_other_firmware(then: Identity, now: Identity) -> bool:
    """True where the device got a firmware meanwhile that its old description need not go with."""
    return then.software is not None and now.software is not None and _major(then.software) != _major(now.software)


def is_same_unit(of_set: Identity, device: Identity, nameplate: str | None) -> bool:
    """True where it is proven that a set comes from this very device.

    By the serial number that the device tells; where it tells none, by the nameplate that a person typed and confirmed.
    A serial number of 0 is none (CiA 301, 7.5.2.19), and one number is given again by another maker and product.
    """
    if is_contradictory(of_set, device, nameplate):
        return False
    if of_set.mark is not None and device.mark is not None:
        return of_set.has_serial_of(device)
    return nameplate is not None and of_set.nameplate == nameplate


def is_contradictory(of_set: Identity, device: Identity, nameplate: str | None) -> bool:
    """True where serial number and nameplate say different things: one was exchanged since, or mistyped."""
    if of_set.nameplate is None or nameplate is None or of_set.mark is None or device.mark is None:
        return False
    return (of_set.nameplate == nameplate) != (of_set.mark == device.mark)


def objections_to_state(found: Survey) -> Iterator[Refusal]:
    """What speaks against writing these devices now."""
    for report in found.reports:
        slug, values = report.target.slug, report.values
        machine = report.target.description.machine
        if machine is not None:
            yield from _objections_to_drive(report.target, machine, values)
        main, supply = values.get(PMM_STATUS), values.get(SUPPLY_STATUS)
        entries = report.target.description.entries
        unknown = [a for a in (PMM_STATUS, SUPPLY_STATUS) if a in entries and not isinstance(values.get(a), int)]
        if isinstance(main, int) and main & _BATTERY:
            yield Refusal(Objection.BATTERY, slug, {"status": f"{main:04X}h"})
        if unknown or (isinstance(main, int) and main & _MAINS) or (isinstance(supply, int) and supply & _24_VOLT):
            yield Refusal(Objection.SUPPLY, slug, {"status": f"{main:04X}h" if isinstance(main, int) else "–"})


def _objections_to_drive(target: Target, machine: StateMachine, values: Mapping[Address, Raw]) -> Iterator[Refusal]:
    status = values.get(machine.statusword)
    if not isinstance(status, int):
        yield Refusal(Objection.DRIVE_UNKNOWN, target.slug)
    elif stage_on(machine, status):
        yield Refusal(Objection.DRIVE_ENABLED, target.slug, {"status": f"{status:04X}h"})
    speed = _scaled(target, VELOCITY, values)
    if speed is None and VELOCITY in target.description.entries and isinstance(status, int):
        yield Refusal(Objection.DRIVE_UNKNOWN, target.slug)
    if speed is not None and abs(speed) > STANDSTILL_DPS:
        entry = target.description.entry(VELOCITY)
        unit = quantity_of(entry, values.get).unit
        yield Refusal(Objection.DRIVE_MOVING, target.slug, {"speed": f"{speed:.2f}", "unit": unit})


def objections_to_surroundings(connection: Connection, now_ns: int) -> Iterator[Refusal]:
    """What speaks against it on the bus and in the tool."""
    for link in connection.buses.values():
        seen = [one for one in link.status.masters if now_ns - one.t_ns < MASTER_QUIET_NS]
        if seen:
            yield Refusal(Objection.OTHER_MASTER, "", {"bus": link.status.bus, "seen": seen[0].sign.value})
    recording = connection.recording
    if recording is None or recording.status().state is not RecorderState.RECORDING:
        yield Refusal(Objection.NOT_RECORDING)


async def objections_to_other_blades(connection: Connection, station: str) -> list[Refusal]:
    """Blades that do not stand in feather, or whose position nobody can tell. Raises BusLostError."""
    found = []
    for target in _other_axes(connection, station):
        position = await _degrees_before_feather(connection, target)
        if position is None or position > FEATHER_DEG:
            shown = "–" if position is None else f"{position:.2f}"
            found.append(Refusal(Objection.OTHER_BLADES, target.slug, {"missing": shown}))
    return found


async def objections_to_nameless_axes(connection: Connection, targets: Iterable[Target]) -> list[Refusal]:
    """On a bus without names, axes that are driven: each of them may belong to the devices of the restore."""
    if connection.turbine.slug != BARE_TURBINE:
        return []
    known, found = {target.slug for target in targets}, []
    for axis in connection.axes():
        machine = machine_of(axis.target)
        if axis.target.slug in known:
            continue
        try:
            status = await read_integer(connection, axis.target, machine.statusword)
        except NoAnswerError:
            found.append(Refusal(Objection.DRIVE_UNKNOWN, axis.target.slug))
        else:
            if status is not None and is_driven(machine, status):
                found.append(Refusal(Objection.DRIVE_ENABLED, axis.target.slug, {"status": f"{status:04X}h"}))
    return found


def _other_axes(connection: Connection, station: str) -> Iterable[Target]:
    blades = {one.slug for one in connection.turbine.stations if one.blade is not None and one.slug != station}
    if connection.turbine.slug == BARE_TURBINE:
        blades = set()  # nobody can tell which of the nodes belong to which blade
    return (
        target
        for target in connection.targets
        if target.slug.rpartition("/")[0] in blades and target.description.machine is not None
    )


async def _degrees_before_feather(connection: Connection, target: Target) -> Decimal | None:
    try:
        report = await read_device(connection.driver(target), target, (POSITION, FEATHER, *_SCALING))
    except (NoAnswerError, DeviceError):
        return None
    position, feather = _scaled(target, POSITION, report.values), _scaled(target, FEATHER, report.values)
    return None if position is None or feather is None else feather - position


def _scaled(target: Target, address: Address, values: Mapping[Address, Raw]) -> Decimal | None:
    entry, raw = target.description.entries.get(address), values.get(address)
    if entry is None or raw is None:
        return None
    scaled = to_scaled(entry, raw, values.get)
    return None if scaled is None else scaled.number


def _major(version: str) -> str:
    return version.strip().partition(".")[0]


def _differ(one: object, other: object) -> bool:
    """True where both are known and differ."""
    return one is not None and other is not None and one != other


def _variant(description: Description, parameters: ParameterSet) -> str | None:
    """Name of the variant that the set was taken from; None where that is not known, or there are none."""
    identity = parameters.identity
    variant = variant_of(description, identity.device_name, identity.product_code)
    return None if variant is None else description.variant_details[variant].name


def _kind_of(parameters: ParameterSet) -> str:
    kind = parameters.identity.device_type
    return parameters.description_id if kind is None else f"{parameters.description_id} ({kind:08X}h)"


def _who(identity: Identity, nameplate: str | None = None) -> str:
    plate = nameplate if nameplate is not None else identity.nameplate
    number = identity.serial if identity.mark is None else identity.mark
    return " / ".join(str(one) for one in (number, plate) if one is not None) or "–"
