"""Commands on a bus: scan, read, write, save, restart, record."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import signal
import time
from collections.abc import Callable, Coroutine, Mapping
from typing import Any

from app.cli.arguments import seconds
from app.cli.audited import audited
from app.cli.connecting import ask_peers, connected, find_nodes, make_connection, named_turbine, run_command, sheets_of
from app.cli.output import Output
from app.cli.targets import add_connection, description_id, find_device
from app.drivers.contract import FoundNode
from app.drivers.modbus_config import parse_modbus
from app.errors import HubsideError, NoAnswerError, RecordingError, UnverifiedError
from app.model.address import Address, parse_address
from app.model.checks import Allow, check_read
from app.model.datatypes import Raw
from app.model.description import Entry
from app.model.saving import Category, has_categories, saves_for, text_key
from app.model.texts import error_text
from app.model.values import show, to_scaled
from app.service.backup import ReadReport, read_device, readable
from app.service.connection import Connection
from app.service.devices import Target
from app.service.identify import Asked
from app.service.save import BY_HAND_S, restart, save
from app.service.write import WriteResult, write_text


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the commands."""

    def command(name: str, run: Callable[..., Coroutine[Any, Any, int]], text: str) -> argparse.ArgumentParser:
        parser = commands.add_parser(name, help=text)
        add_connection(parser)
        parser.set_defaults(run=lambda arguments, output: run_command(run(arguments, output)))
        return parser

    command("scan", _scan, "find and identify the devices of a bus")
    read = command("read", _read, "read objects of a device, or all of it")
    read.add_argument("target", help="TURBINE/STATION/DEVICE or a node number")
    read.add_argument("address", nargs="*", help="6065, 3110:01; all objects where none is named")
    write = command("write", _write, "write one parameter: checked, written, read back")
    write.add_argument("target", help="TURBINE/STATION/DEVICE or a node number")
    write.add_argument("address")
    write.add_argument("value", help="49.5, '49,5 °C', 0x1F, raw:495 or the name of an enumeration")
    write.add_argument("--factory", action="store_true", help="allow r(w) objects")
    write.add_argument("--motion", action="store_true", help="allow objects that can set an axis in motion (6040h)")
    write.add_argument("--address-change", action="store_true", help="allow objects that decide the network address")
    write.add_argument("--communication", action="store_true", help="allow PDO parameters, save and load commands")
    write.add_argument("--save", action="store_true", help="then save to non-volatile memory")
    saving = command("save", _save, "save the parameters of a device to its non-volatile memory")
    saving.add_argument("target", help="TURBINE/STATION/DEVICE or a node number")
    saving.add_argument("--category", help="save only this category, where the device has some; all else")
    restarting = command("restart", _restart, "restart a device, and prove what it has saved where it tells that")
    restarting.add_argument("target", help="TURBINE/STATION/DEVICE or a node number")
    record = command("record", _record, "record all frames to MCAP until interrupted")
    record.add_argument("--seconds", type=seconds, help="end by itself after so long")


async def _scan(arguments: argparse.Namespace, output: Output) -> int:
    if arguments.modbus is not None:
        return await _ask_addresses(arguments, output)
    started = time.monotonic()
    sheets = sheets_of(arguments, output)
    found = await find_nodes(arguments, output, sheets, await named_turbine(arguments, output))
    if output.as_json:
        output.result([_found_dict(node, description_id(sheets, node)) for node in found], "")
    elif found:
        head = ("NODE", "TYPE", "NAME", "HARDWARE", "SOFTWARE", "SERIAL", "DESCRIPTION")
        output.table(head, [_found_row(node, _serial(node), description_id(sheets, node)) for node in found])
    output.say("cli.found", count=len(found), took_s=f"{time.monotonic() - started:.1f}")
    return 0 if found else NoAnswerError.exit_code


async def _ask_addresses(arguments: argparse.Namespace, output: Output) -> int:
    """Who is at each given address of Modbus TCP; of the others it is told why nobody is known to be there."""
    started = time.monotonic()
    asked = await ask_peers(parse_modbus(arguments.modbus), output)
    for one in asked:
        if one.error is not None:
            output.error(one.error)
    found = [(one, one.found) for one in asked if one.found is not None]
    if output.as_json:
        output.result([_asked_dict(one, node) for one, node in found], "")
    elif found:
        head = ("ADDRESS", "NODE", "TYPE", "NAME", "HARDWARE", "SOFTWARE", "SERIAL", "DESCRIPTION")
        rows = [(one.peer.server, *_found_row(node, one.serial, node.description_id)) for one, node in found]
        output.table(head, rows)
    output.say("cli.found", count=len(found), took_s=f"{time.monotonic() - started:.1f}")
    return 0 if found else NoAnswerError.exit_code


def _asked_dict(one: Asked, node: FoundNode) -> dict[str, Any]:
    known = {"address": one.peer.server, "variant": one.variant, "drive_serial": one.serial}
    return {**_found_dict(node, node.description_id), **known}


def _serial(node: FoundNode) -> str | None:
    return None if node.identity.serial is None else str(node.identity.serial)


def _found_row(node: FoundNode, serial: str | None, description: str | None) -> tuple[str, ...]:
    kind = "–" if node.device_type is None else f"{node.device_type:08X}h"
    told = (node.device_name, node.hardware, node.software, serial, description)
    return (str(node.node), kind, *(text or "–" for text in told))


def _found_dict(node: FoundNode, description: str | None) -> dict[str, Any]:
    return {
        "node": node.node,
        "device_type": node.device_type,
        "device_name": node.device_name,
        "hardware": node.hardware,
        "software": node.software,
        "vendor": node.identity.vendor,
        "product": node.identity.product,
        "revision": node.identity.revision,
        "serial": node.identity.serial,
        "description": description,
        "twin": node.is_twin,
    }


async def _read(arguments: argparse.Namespace, output: Output) -> int:
    addresses = [parse_address(text) for text in arguments.address]
    async with connected(arguments, output) as connection:
        target = target_of(connection, arguments.target)
        for address in addresses:
            check_read(target.entry(address))
        started = time.monotonic()
        report = await read_device(
            connection.driver(target),
            target,
            addresses or readable(target.description),
            lambda one, done, total: output.progress("cli.reading", device=one.slug, done=done, total=total),
        )
    if output.as_json:
        values = {str(address): _json_value(target, address, raw) for address, raw in report.values.items()}
        failed = {str(address): error.code for address, error in report.failed.items()}
        output.result({"device": target.slug, "values": values, "failed": failed}, "")
    else:
        rows = [_value_row(target, target.entry(address), raw, output) for address, raw in report.values.items()]
        output.table(("ADDRESS", "NAME", "VALUE", "UNIT", "RAW"), rows)
    say_unread(report, output)
    took = f"{time.monotonic() - started:.2f}"
    output.say("cli.read_done", device=target.slug, count=len(report.values), took_s=took)
    return exit_code(report.failed if addresses else report.errors)


def exit_code(failed: Mapping[Address, HubsideError]) -> int:
    """0 where nothing failed, else that of the worst: no answer before a refusal."""
    return max((error.exit_code for error in failed.values()), default=0)


def say_unread(report: ReadReport, output: Output) -> None:
    """Name every object that was not read; those that hold nothing yet (an empty error history) in one line."""
    if report.lost is not None:
        output.error(report.lost)
        return
    empty = [address for address in report.failed if address not in report.errors]
    if empty:
        output.say("cli.empty", device=report.target.slug, addresses=", ".join(address.short for address in empty))
    for address, error in report.errors.items():
        name = f"{report.target.slug} {address.short}"
        title = report.target.entry(address).title
        output.say("cli.unread", address=name, name=title, reason=error_text(output.texts, error))


def _value_row(target: Target, entry: Entry, raw: Raw, output: Output) -> tuple[str, ...]:
    scaled = to_scaled(entry, raw, target.lookup)
    text = show(entry, raw, target.lookup)
    if entry.enumeration is not None and isinstance(raw, int):
        named = target.description.enumerations[entry.enumeration].by_value(raw)
        text = f"{text} {output.texts(named.text_key)}" if named else text
    unit = scaled.unit if scaled is not None else ""
    return (
        str(entry.address),
        output.texts.name(entry.title),
        text,
        unit,
        raw.hex() if isinstance(raw, bytes) else str(raw),
    )


def _json_value(target: Target, address: Any, raw: Raw) -> dict[str, Any]:
    entry = target.entry(address)
    scaled = to_scaled(entry, raw, target.lookup)
    return {
        "name": entry.title,
        "raw": {"hex": raw.hex()} if isinstance(raw, bytes) else raw,
        "scaled": None if scaled is None else float(scaled.number),
        "unit": None if scaled is None else scaled.unit,
    }


async def _write(arguments: argparse.Namespace, output: Output) -> int:
    address = parse_address(arguments.address)
    async with connected(arguments, output) as connection:
        target = target_of(connection, arguments.target)
        entry = target.entry(address)
        async with audited(arguments, output, connection):
            try:
                result = await write_text(
                    connection.driver(target),
                    target,
                    address,
                    arguments.value,
                    connection.journal,
                    allow=_allowed(arguments),
                )
            except asyncio.CancelledError:
                output.say("cli.write_interrupted", device=target.slug, address=address.short, name=entry.title)
                raise
            _tell_written(target, entry, result, output)
            if arguments.save and result.verified:
                for category in saves_for(target.description, (address,)) or (None,):
                    await _save_one(connection, target, output, category)
    return 0 if result.verified else UnverifiedError.exit_code


def _allowed(arguments: argparse.Namespace) -> Allow:
    allow = Allow.FACTORY if arguments.factory else Allow.NOTHING
    allow |= Allow.MOTION if arguments.motion else Allow.NOTHING
    allow |= Allow.ADDRESS if arguments.address_change else Allow.NOTHING
    return allow | (Allow.COMMUNICATION if arguments.communication else Allow.NOTHING)


def _tell_written(target: Target, entry: Entry, result: WriteResult, output: Output) -> None:
    """What is known of the write: read back equal, acknowledged where that is the rule, or sent and unproven."""
    key = "written" if result.read is not None else "acknowledged" if result.verified else "unproven"
    was = "–" if result.was is None else show(entry, result.was, target.lookup)
    now = show(entry, result.sent if result.read is None else result.read, target.lookup)
    place = {"device": target.slug, "address": str(result.address)}
    output.result(
        {**place, "was": result.was, "sent": result.sent, "now": result.read, "verified": result.verified},
        output.texts(f"cli.{key}", device=target.slug, address=entry.address.short, name=entry.title, was=was, now=now),
    )


async def _save(arguments: argparse.Namespace, output: Output) -> int:
    async with connected(arguments, output) as connection:
        target = target_of(connection, arguments.target)
        async with audited(arguments, output, connection):
            await _save_one(connection, target, output, arguments.category)
    return 0


async def _save_one(connection: Connection, target: Target, output: Output, category: Category) -> None:
    took = await save(connection.driver(target), target, connection.journal, connection.stamper, category)
    known = {"device": target.slug, "saved": True, "took_s": took.took_s}
    shown = {"device": target.slug, "took_s": f"{took.took_s:.2f}"}
    if has_categories(target.description):
        text = output.texts("cli.save_part_done", category=output.texts(text_key(category)), **shown)
        output.result({**known, "category": category, "proven": False}, text)
    else:
        output.result(known, output.texts("cli.save_done", **shown))


async def _restart(arguments: argparse.Namespace, output: Output) -> int:
    async with connected(arguments, output) as connection:
        target = target_of(connection, arguments.target)
        if connection.driver(target).restarts_by_hand:
            output.say("cli.restart_by_hand", device=target.slug, within_s=f"{BY_HAND_S:.0f}")
        async with audited(arguments, output, connection):
            took = await restart(connection.driver(target), target, connection.journal, connection.stamper)
        text = output.texts("cli.restart_done", device=target.slug, took_s=f"{took.took_s:.2f}")
        known: dict[str, Any] = {"device": target.slug, "took_s": took.took_s}
        if took.proven is not None:
            known["proven"] = took.proven
            text = f"{text}\n{output.texts('cli.save_proven' if took.proven else 'cli.save_not_proven')}"
        output.result(known, text)
    return 0


async def _record(arguments: argparse.Namespace, output: Output) -> int:
    sheets = sheets_of(arguments, output)
    turbine = await named_turbine(arguments, output)
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(NotImplementedError):  # Windows: Ctrl-C comes as KeyboardInterrupt
            loop.add_signal_handler(number, stop.set)
    connection = make_connection(arguments, turbine, sheets, True)
    async with connection:
        output.say("cli.stop_hint")
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(_show_recording(connection, output, stop), arguments.seconds)
    status = connection.recorded
    size = f"{status.size_bytes / 1e6:.2f} MB"
    details = {"file": str(status.file), "frames": status.frames, "size": size, "lost": status.lost}
    output.result(details, output.texts("cli.recording", **details))
    if status.file is None or status.reason is not None:
        reason = status.detail or (status.reason.value if status.reason else "no file")
        raise RecordingError(file=str(arguments.settings.recordings), offset=0, reason=reason)
    return 0


async def _show_recording(connection: Connection, output: Output, stop: asyncio.Event) -> None:
    while not stop.is_set():
        if connection.recording is not None:
            status = connection.recording.status()
            size = f"{status.size_bytes / 1e6:.2f} MB"
            output.progress("cli.recording", file=status.file, frames=status.frames, size=size, lost=status.lost)
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(stop.wait(), 0.5)


def target_of(connection: Connection, name: str) -> Target:
    """The device that is meant. Raises UsageError."""
    return connection.target(find_device(connection.turbine, name).slug)
