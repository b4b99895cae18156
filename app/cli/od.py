"""``hubside od``: look at, check and export the device descriptions."""

from __future__ import annotations

import argparse
from pathlib import Path

from app.cli.output import Output, tell_warning
from app.cli.targets import SHEET_SUFFIXES
from app.errors import UsageError
from app.model.address import Addressing, parse_address
from app.model.checks import limits_of
from app.model.description import Description, Entry
from app.model.description_file import BUILTIN, builtin_folder, load, load_builtin, problems
from app.model.eds import load_eds
from app.model.eds_write import to_eds, write_all
from app.model.od_export import to_csv, to_json
from app.model.values import show


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the command."""
    parser = commands.add_parser("od", help="device descriptions: list, show, check, export")
    actions = parser.add_subparsers(dest="action", required=True)
    actions.add_parser("list", help="all descriptions")
    one = actions.add_parser("show", help="one device, or one object of it")
    one.add_argument("device", help="id of a description, or a file")
    one.add_argument("address", nargs="?", help="6065, 3110:01 (hexadecimal) or 12/221 (IND/PNU)")
    check = actions.add_parser("check", help="check one description file, or all")
    check.add_argument("file", nargs="?", type=Path)
    export = actions.add_parser("export", help="write a description as CSV, EDS or JSON")
    export.add_argument("device", nargs="?", help="id of a description, or a file")
    export.add_argument("--format", choices=("csv", "eds", "json"), default="csv")
    export.add_argument("--output", type=Path, help="file instead of standard output")
    export.add_argument("--all-eds", type=Path, metavar="FOLDER", help="write every EDS into this folder")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace, output: Output) -> int:
    """Run one action; gives the exit code."""
    match arguments.action:
        case "list":
            return _list(output)
        case "show":
            return _show(find(arguments.device, output), arguments.address, output)
        case "check":
            return _check(arguments.file, output)
        case _:
            return _export(arguments, output)


def find(device: str, output: Output) -> Description:
    """A description by its id, or from a file (ours, EDS or DCF). Raises UsageError or DescriptionError."""
    path = Path(device)
    if device not in BUILTIN and path.suffix == ".toml":
        return load(path)
    if path.suffix.lower() in SHEET_SUFFIXES:
        return _sheet(path, output)
    return load_builtin(device)


def _sheet(path: Path, output: Output) -> Description:
    loaded = load_eds(path)
    for warning in loaded.warnings:
        tell_warning(output, path, warning)
    return loaded.description


def _list(output: Output) -> int:
    rows = []
    for name in BUILTIN:
        one = load_builtin(name)
        is_od = one.addressing is Addressing.OD
        objects = len({entry.address.major for entry in one}) if is_od else len(one.entries)
        rows.append((one.id, one.version, one.bus.value, str(objects), str(len(one.entries)), one.manual))
    if output.as_json:
        keys = ("id", "version", "bus", "objects", "rows", "manual")
        output.result([dict(zip(keys, row, strict=True)) for row in rows], "")
    else:
        output.table(("ID", "VERSION", "BUS", "OBJECTS", "ROWS", "MANUAL"), rows)
    return 0


def _show(description: Description, address: str | None, output: Output) -> int:
    if output.as_json and address is None:
        output.line(to_json(description))
        return 0
    if address is None:
        rows = [_row(description, entry, output) for entry in description]
        output.table(("ADDRESS", "NAME", "TYPE", "ACCESS", "PDO", "DEFAULT", "UNIT", "SAVED", "CLASS"), rows)
        return 0
    wanted = parse_address(address)
    entries = [
        e for e in description if e.address == wanted or (e.address.major == wanted.major and ":" not in address)
    ]
    for entry in entries or [description.entry(wanted)]:
        _detail(description, entry, output)
    return 0


def _row(description: Description, entry: Entry, output: Output) -> tuple[str, ...]:
    return (
        str(entry.address),
        output.texts.name(entry.title),
        entry.type.name,
        entry.access.value,
        "yes" if entry.pdo else "no",
        _default(description, entry),
        entry.quantity.unit,
        "yes" if entry.saved else "no",
        entry.restore.value,
    )


def _default(description: Description, entry: Entry) -> str:
    if entry.default is None:
        return ""
    if entry.enumeration is not None and isinstance(entry.default, int):
        named = description.enumerations[entry.enumeration].by_value(entry.default)
        if named is not None:
            return f"{entry.default} {named.name}"
    return show(entry, entry.default, lambda _address: None)


def _detail(description: Description, entry: Entry, output: Output) -> None:
    texts = output.texts
    low, high = limits_of(entry, lambda _address: None)
    lines = {
        "address": str(entry.address),
        "name": texts.name(entry.title),
        "type": entry.type.name,
        "access": entry.access.value,
        "PDO mapping": "yes" if entry.pdo else "no",
        "default": f"{_default(description, entry)} {entry.quantity.unit}".strip() if entry.default is not None else "",
        "raw default": "" if entry.default is None else str(entry.default),
        "scale": f"{entry.quantity.scale} {entry.quantity.unit}".strip(),
        "limits (raw)": f"{low} … {high}" if low is not None or high is not None else "",
        "saved": "yes" if entry.saved else "no",
        "restore class": entry.restore.value,
        "verified by": entry.verify.value,
        "group": texts(f"group.{entry.group}"),
        "manual": entry.section,
        "note": texts(entry.note) if entry.note else "",
    }
    if entry.bits is not None:
        for bit in description.bit_tables[entry.bits].bits:
            span = f"{bit.bit}" if bit.last is None else f"{bit.bit}..{bit.last}"
            error = f" → {bit.error_code:04X}h" if bit.error_code is not None else ""
            lines[f"bit {span}"] = f"{texts(bit.text_key)} {bit.clamp}".rstrip() + error
    if entry.enumeration is not None:
        for value in description.enumerations[entry.enumeration].values:
            lines[f"value {value.value}"] = texts(value.text_key)
    if output.as_json:
        output.result(lines, "")
        return
    for key, text in lines.items():
        if text:
            output.line(f"{key:14} {text}")
    output.line("")


def _check(file: Path | None, output: Output) -> int:
    if file is not None and file.suffix.lower() in SHEET_SUFFIXES:
        output.say("cli.check_read", file=file, count=len(_sheet(file, output).entries))
        return 0
    files = [file] if file is not None else [builtin_folder() / name for name in BUILTIN.values()]
    found = [problem for path in files for problem in problems(path)]
    for problem in found:
        output.line(str(problem))
    if not found:
        for path in files:
            output.say("cli.check_good", file=path, count=len(load(path).entries))
    return 2 if found else 0


def _export(arguments: argparse.Namespace, output: Output) -> int:
    if arguments.all_eds is not None:
        write_all(arguments.all_eds)
        return 0
    if arguments.device is None:
        raise UsageError(reason="name a device, or --all-eds FOLDER")
    writers = {"csv": to_csv, "eds": to_eds, "json": to_json}
    text = writers[arguments.format](find(arguments.device, output))
    if arguments.output is None:
        output.raw(text)
    else:
        arguments.output.write_bytes(text.encode("utf-8"))
    return 0
