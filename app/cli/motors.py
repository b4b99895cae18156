"""``hubside motors``: the motor database. Works on the data folder while no server does."""

from __future__ import annotations

import argparse
import asyncio
import time
from collections.abc import Callable, Coroutine, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any, Final

from app.cli.connecting import connected, run_command
from app.cli.output import Output
from app.cli.restore import BARE_STATION, add_terms, restore
from app.cli.targets import add_connection, find_device, site_turbine
from app.cli.users import opened
from app.errors import MotorUnknownError, UsageError
from app.model.address import Address, is_decimal, parse_address
from app.model.description import Entry
from app.model.motor import (
    PLATE_FIELDS,
    Draft,
    Motor,
    Plate,
    PlateField,
    disagreements,
    entries_of,
    flaw,
    is_of_the_machine,
    parse_value,
)
from app.model.motor_diff import PlateRow, RowState, ValueRow, compare_plates, compare_values
from app.model.values import show, to_scaled
from app.service.connection import Connection
from app.service.devices import Target
from app.service.motors import Motors, description, read_motor

Run = Callable[[argparse.Namespace, Output, Motors], Coroutine[Any, Any, int]]
_FIELDS: Final = {one.name: one for one in PLATE_FIELDS}
MOTOR_HELP: Final = "its id or the beginning of it, its type, or maker and type; with @VERSION an earlier one"


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the commands."""
    parser = commands.add_parser("motors", help="motors with plate data and parameters: list, change, compare")
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")

    def action(name: str, run: Run, text: str, *named: str) -> argparse.ArgumentParser:
        one = actions.add_parser(name, help=text)
        for argument in named:
            one.add_argument(argument, help=MOTOR_HELP if argument == "motor" else None)
        one.set_defaults(run=lambda arguments, output: run_command(_with_motors(arguments, output, run)))
        return one

    listing = action("list", _list, "all motors, the invented examples last")
    listing.add_argument("--search", default="", metavar="WORDS", help="only those in which all words are found")
    shown = action("show", _show, "one motor with its parameters", "motor")
    shown.add_argument("--versions", action="store_true", help="its versions instead")
    adding = action("add", _add, "add a motor, typed or read from a device", "maker", "type")
    adding.add_argument("--device", metavar="TARGET", help="read the parameters from this device")
    add_connection(adding, required=False)
    editing = action("edit", _edit, "make another version of a motor", "motor")
    editing.add_argument("--maker")
    editing.add_argument("--type")
    for one in (adding, editing):
        _add_changes(one)
    comparing = action("compare", _compare, "two motors, or a motor and a device")
    comparing.add_argument("motor", nargs="*", help=f"two motors, or one and --device; {MOTOR_HELP}")
    comparing.add_argument("--device", metavar="TARGET", help="against this device, read now")
    add_connection(comparing, required=False)
    importing = action("import", _import, "take the motors of a CSV file: all or none")
    importing.add_argument("file", type=Path)
    exporting = action("export", _export, "write motors as CSV")
    exporting.add_argument("motor", nargs="*", help=f"all but the examples where none is named; {MOTOR_HELP}")
    exporting.add_argument("--file", type=Path, help="write to a file instead of stdout")
    applying = actions.add_parser("apply", help="put a motor into a drive: a restore, planned, confirmed, proven")
    applying.add_argument("motor", help=MOTOR_HELP)
    applying.add_argument("--device", metavar="TARGET", required=True, help="the drive")
    add_connection(applying)
    add_terms(applying)
    applying.set_defaults(run=_apply)
    assigning = action("assign", _assign, "note which motor a device drives", "motor")
    assigning.add_argument("device", help="TURBINE/STATION/DEVICE")
    action("delete", _delete, "list a motor no more; its versions stay readable", "motor")


def _add_changes(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--plate",
        action="append",
        default=[],
        metavar="FIELD=VALUE",
        help=f"plate data: {', '.join(f'{one.name} [{one.unit}]' if one.unit else one.name for one in PLATE_FIELDS)}",
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="ADDRESS=VALUE", help="6410:03=400, 6402=asynchronous, 6076="
    )
    parser.add_argument("--remarks")


async def _with_motors(arguments: argparse.Namespace, output: Output, run: Run) -> int:
    async with opened(arguments) as (store, audit):
        return await run(arguments, output, Motors(store, audit, time.time_ns))


# -- reading -----------------------------------------------------------------------


async def _list(arguments: argparse.Namespace, output: Output, motors: Motors) -> int:
    words = arguments.search.casefold().split()
    found = [motor for motor in await motors.all() if all(word in _haystack(motor) for word in words)]
    if output.as_json:
        output.result([_as_dict(motor) for motor in found], "")
        return 0
    head = tuple(
        output.texts(f"cli.motor_head.{name}") for name in ("id", "motor", "power", "speed", "version", "from")
    )
    output.table(head, [_line(motor, output) for motor in found])
    return 0


def _haystack(motor: Motor) -> str:
    draft = motor.draft
    plate = " ".join(str(getattr(draft.plate, one.name) or "") for one in PLATE_FIELDS)
    return f"{motor.id} {motor.title} {draft.remarks} {motor.origin} {plate}".casefold()


def _line(motor: Motor, output: Output) -> tuple[str, ...]:
    plate = motor.draft.plate
    numbers = (_with_unit(_FIELDS[name], getattr(plate, name)) for name in ("power_kw", "speed_rpm"))
    return motor.id, motor.title, *numbers, str(motor.version), _origin(motor, output)


def _origin(motor: Motor, output: Output) -> str:
    source = output.texts(f"motor.source.{motor.source.value}")
    return source if motor.invented or not motor.origin else f"{source}: {motor.origin}"


async def _show(arguments: argparse.Namespace, output: Output, motors: Motors) -> int:
    motor = await motors.find(arguments.motor)
    if arguments.versions:
        versions = await motors.versions(motor.id)
        _tell(output, versions, [f"{one.version}  {_origin(one, output)}  {one.person}" for one in versions])
        return 0
    if output.as_json:
        output.result(_as_dict(motor), "")
        return 0
    draft = motor.draft
    output.line(f"{motor.title}  ·  {motor.id}@{motor.version}  ·  {_origin(motor, output)}")
    known = [(one, getattr(draft.plate, one.name)) for one in PLATE_FIELDS]
    output.table(("", ""), [(_plate_name(one, output), _with_unit(one, found)) for one, found in known if found])
    rows = [_value_line(entry, draft.values, output) for entry in entries_of(description())]
    output.table(tuple(output.texts(f"cli.motor_head.{name}") for name in ("address", "name", "value")), rows)
    for field, address in disagreements(description(), draft):
        output.say("cli.motor_disagrees", field=_plate_name(field, output), address=address.short)
    if draft.remarks:
        output.line(draft.remarks)
    return 0


def _value_line(entry: Entry, values: Mapping[Address, int], output: Output) -> tuple[str, str, str]:
    text = _shown(entry, values.get(entry.address), output)
    mark = f"  ({output.texts('cli.motor_of_the_machine')})" if is_of_the_machine(entry) else ""
    return entry.address.short, output.texts.name(entry.title), text + mark


async def _compare(arguments: argparse.Namespace, output: Output, motors: Motors) -> int:
    sides: list[tuple[str, Mapping[Address, int], Plate | None]] = []
    names = list(arguments.motor)
    if arguments.device is not None:
        slug, held = await _read(arguments, output)
        sides.append((slug, held, None))
        names = names or [await _motor_of(motors, slug)]
    for name in names:
        motor = await motors.find(name)
        sides.insert(len(sides) - (arguments.device is not None), (motor.title, motor.draft.values, motor.draft.plate))
    if len(sides) != 2:
        raise UsageError(reason="name two motors, or a motor and --device")
    (left, values, plate), (right, others, other_plate) = sides
    plates = [] if plate is None or other_plate is None else compare_plates(plate, other_plate)
    _tell_compared(output, left, right, plates, compare_values(description(), values, others))
    return 0


async def _motor_of(motors: Motors, slug: str) -> str:
    """What names the motor that a device drives. Raises MotorUnknownError."""
    assigned = (await motors.assigned()).get(slug)
    if assigned is None:
        raise MotorUnknownError(motor=f"of {slug}")
    return f"{assigned.motor_id}@{assigned.version}"


def _tell_compared(
    output: Output, left: str, right: str, plates: Sequence[PlateRow], values: Sequence[ValueRow]
) -> None:
    states = [row.state for row in plates] + [row.state for row in values]
    counts = {state.value: states.count(state) for state in RowState}
    if output.as_json:
        rows = [(row.address.short, row) for row in values]
        cells = {name: {"state": row.state.value, "left": row.left, "right": row.right} for name, row in rows}
        of_plate = {row.field.name: [_plain(row.left), _plain(row.right)] for row in plates}
        output.result({"left": left, "right": right, **counts, "values": cells, "plate": of_plate}, "")
        return
    lines = [
        (_plate_name(row.field, output), _with_unit(row.field, row.left), _with_unit(row.field, row.right), row.state)
        for row in plates
    ]
    for row in values:
        entry = description().entry(row.address)
        name = f"{entry.address.short} {output.texts.name(entry.title)}"
        lines.append((name, _shown(entry, row.left, output), _shown(entry, row.right, output), row.state))
    shown = [
        (*cells, output.texts(f"motor.state.{state.value}")) for *cells, state in lines if state is not RowState.SAME
    ]
    output.table(("", left, right, ""), shown)
    output.line(output.texts("motor.compared", **counts))


# -- changing ----------------------------------------------------------------------


async def _add(arguments: argparse.Namespace, output: Output, motors: Motors) -> int:
    draft = _changed(Draft(arguments.maker, arguments.type), arguments)
    if arguments.device is None:
        motor = await motors.add(draft, arguments.settings.person)
    else:
        if draft.values:
            raise UsageError(reason="--set is for typed motors; those of a device are read from it")
        async with connected(arguments, output) as connection:
            target = _target(connection, arguments.device)
            person = arguments.settings.person
            motor = await motors.add_from_device(connection.driver(target), target, draft, person)
    _tell_kept(output, motor)
    return 0


async def _edit(arguments: argparse.Namespace, output: Output, motors: Motors) -> int:
    motor = await motors.find(arguments.motor)
    draft = replace(motor.draft, maker=arguments.maker or motor.draft.maker, type=arguments.type or motor.draft.type)
    newest = (await motors.versions(motor.id))[0]
    _tell_kept(
        output, await motors.edit(motor.id, newest.version, _changed(draft, arguments), arguments.settings.person)
    )
    return 0


def _changed(draft: Draft, arguments: argparse.Namespace) -> Draft:
    """The draft with what ``--plate``, ``--set`` and ``--remarks`` say. Raises UsageError, MotorFieldError."""
    plate, values = draft.plate, dict(draft.values)
    for text in arguments.plate:
        name, found = _pair(text)
        plate = replace(plate, **_plate_value(name, found))
    for text in arguments.set:
        name, found = _pair(text)
        entry = description().entry(parse_address(name))
        if found:
            values[entry.address] = parse_value(description(), entry, found)
        else:
            values.pop(entry.address, None)
    remarks = draft.remarks if arguments.remarks is None else arguments.remarks
    return replace(draft, plate=plate, values=values, remarks=remarks)


def _pair(text: str) -> tuple[str, str]:
    name, equals, found = text.partition("=")
    if not equals:
        raise UsageError(reason=f"'{text}' has no =")
    return name.strip(), found.strip()


def _plate_value(name: str, text: str) -> dict[str, Any]:
    if name not in _FIELDS:
        raise UsageError(reason=f"no plate field '{name}'; there are: {', '.join(_FIELDS)}")
    if _FIELDS[name].is_text:
        return {name: text}
    try:
        return {name: Decimal(text.replace(",", ".")) if text else None}
    except InvalidOperation as error:
        raise flaw(name, "no_number") from error


async def _import(arguments: argparse.Namespace, output: Output, motors: Motors) -> int:
    data = await asyncio.to_thread(arguments.file.read_bytes)
    taken = await motors.take_file(data, arguments.file.name, arguments.settings.person)
    counts = {"added": len(taken.added), "changed": len(taken.changed), "unchanged": len(taken.unchanged)}
    output.result(counts, output.texts("cli.motors_taken", **counts))
    return 0


async def _export(arguments: argparse.Namespace, output: Output, motors: Motors) -> int:
    ids = [(await motors.find(name)).id for name in arguments.motor] or None
    text = await motors.export(ids)
    if arguments.file is None:
        output.raw(text)
    else:
        await asyncio.to_thread(arguments.file.write_bytes, text.encode())
    return 0


async def _assign(arguments: argparse.Namespace, output: Output, motors: Motors) -> int:
    motor = await motors.find(arguments.motor)
    await motors.assign(arguments.device, motor, arguments.settings.person)
    output.result({"device": arguments.device, "motor": motor.id}, f"{arguments.device}: {motor.title}")
    return 0


async def _delete(arguments: argparse.Namespace, output: Output, motors: Motors) -> int:
    motor = await motors.find(arguments.motor)
    await motors.delete(motor.id, arguments.settings.person)
    output.result({"id": motor.id, "deleted": True}, output.texts("cli.motor_deleted", motor=motor.title))
    return 0


# -- devices, and how things are shown ---------------------------------------------


def _apply(arguments: argparse.Namespace, output: Output) -> int:
    motor = asyncio.run(_spec(arguments))
    ways = dict.fromkeys(("resume", "roll_back", "give_up", "record_of"))
    nothing = {"station": None, "select": None, "list": False, **ways}
    return restore(argparse.Namespace(**vars(arguments) | nothing | {"set": [motor]}), output)


async def _spec(arguments: argparse.Namespace) -> str:
    """How a restore names the motor and its drive. Raises MotorUnknownError, UsageError, StoreError."""
    turbine = site_turbine(arguments)
    if turbine is None and not is_decimal(arguments.device):
        raise UsageError(reason="--device is a node number where no site file is named")
    slug = f"{BARE_STATION}/{arguments.device}" if turbine is None else find_device(turbine, arguments.device).slug
    async with opened(arguments) as (store, audit):
        motor = await Motors(store, audit, time.time_ns).find(arguments.motor)
    return f"motor:{motor.id}@{motor.version}:{slug}"


async def _read(arguments: argparse.Namespace, output: Output) -> tuple[str, dict[Address, int]]:
    async with connected(arguments, output) as connection:
        target = _target(connection, arguments.device)
        return target.slug, await read_motor(connection.driver(target), target)


def _target(connection: Connection, name: str) -> Target:
    return connection.target(find_device(connection.turbine, name).slug)


def _tell_kept(output: Output, motor: Motor) -> None:
    details = {"motor": motor.title, "version": motor.version, "id": motor.id}
    output.result(_as_dict(motor), output.texts("cli.motor_kept", **details))


def _tell(output: Output, motors: Sequence[Motor], lines: Sequence[str]) -> None:
    if output.as_json:
        output.result([_as_dict(motor) for motor in motors], "")
    else:
        for line in lines:
            output.line(line)


def _plate_name(field: PlateField, output: Output) -> str:
    return output.texts(f"motor.field.{field.name}")


def _with_unit(field: PlateField, found: Decimal | str | None) -> str:
    return "–" if found is None else f"{found} {field.unit}".strip()


def _shown(entry: Entry, raw: int | None, output: Output) -> str:
    if raw is None:
        return "–"
    named = None if entry.enumeration is None else description().enumerations[entry.enumeration].by_value(raw)
    if named is not None:
        return output.texts(named.text_key)
    scaled = to_scaled(entry, raw, lambda _address: None)
    return f"{show(entry, raw, lambda _address: None)} {scaled.unit if scaled else ''}".strip()


def _as_dict(motor: Motor) -> dict[str, Any]:
    draft = motor.draft
    return {
        "id": motor.id,
        "version": motor.version,
        "maker": draft.maker,
        "type": draft.type,
        "plate": {one.name: _plain(getattr(draft.plate, one.name)) for one in PLATE_FIELDS},
        "values": {address.short: raw for address, raw in draft.values.items()},
        "remarks": draft.remarks,
        "source": motor.source.value,
        "origin": motor.origin,
        "t_ns": motor.t_ns,
        "person": motor.person,
        "invented": motor.invented,
        "deleted": motor.deleted,
    }


def _plain(found: Decimal | str | None) -> float | str | None:
    return float(found) if isinstance(found, Decimal) else found
