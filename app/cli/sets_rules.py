"""``hubside sets rules`` lists the rules, ``hubside sets check`` judges set files or connected devices by them."""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from app.cli.connecting import connected, run_command
from app.cli.output import Output
from app.cli.targets import add_connection, is_connected
from app.errors import RefusedError, SetFileError, UsageError
from app.model.description import Description
from app.model.description_file import BUILTIN, load_builtin
from app.model.rules.all_rules import ALL
from app.model.rules.listing import WRITERS, to_json
from app.model.rules.rule import Finding, Rule, Severity, Verdict
from app.model.set_head import Taking
from app.model.set_import import read_set_file
from app.model.sets import ParameterSet
from app.service.backup import read_devices, to_set
from app.service.rule_check import Judged, check_sets

BROKEN: Final = RefusedError.exit_code
"""Exit code where a rule of weight ``error`` is broken: a restore to such a station is refused before it sends."""
_MARKS: Final = {Severity.ERROR: "✕", Severity.WARNING: "!", Severity.NOTE: "·"}


def add_actions(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the actions."""
    listing = actions.add_parser("rules", help="list the rules that stations are judged by")
    listing.add_argument("--format", choices=("text", *WRITERS), default="text")
    listing.set_defaults(run=_list)
    check = actions.add_parser(
        "check",
        help="judge set files, or the devices of a connection",
        description="Files of one station are judged together. Exit code 3 where a rule of weight 'error' is broken.",
    )
    check.add_argument("files", nargs="*", type=Path, metavar="FILE", help="set files: JSON, DCF or CSV")
    add_connection(check, required=False)
    check.set_defaults(run=_check)


# -- the list ------------------------------------------------------------------------


def _list(arguments: argparse.Namespace, output: Output) -> int:
    texts = output.texts
    if output.as_json or arguments.format == "json":
        output.raw(to_json(ALL, texts))
    elif arguments.format in WRITERS:
        output.raw(WRITERS[arguments.format](ALL, texts))
    else:
        head = ("ID", "WEIGHT", "STEPWISE", "MANUAL", "TITLE")
        output.table(head, [_rule_row(rule, output) for rule in ALL])
    return 0


def _rule_row(rule: Rule, output: Output) -> tuple[str, ...]:
    stepwise = output.texts("cli.stepwise") if rule.stepwise else ""
    weight = output.texts(f"rule.severity.{rule.severity.value}")
    return (rule.id, weight, stepwise, rule.section, output.texts(f"rule.{rule.id}.title"))


# -- the check -----------------------------------------------------------------------


def _check(arguments: argparse.Namespace, output: Output) -> int:
    live = is_connected(arguments)
    if live == bool(arguments.files):
        raise UsageError(reason="name set files to check, or a connection (--site, --can, --modbus or --profibus)")
    if live:
        return run_command(_check_connected(arguments, output))
    return _tell(check_sets([_read(path) for path in arguments.files]), output)


async def _check_connected(arguments: argparse.Namespace, output: Output) -> int:
    """Reads every device completely, as a backup does."""
    async with connected(arguments, output) as connection:
        pairs = [(connection.driver(target), target) for target in connection.targets]
        reports = await read_devices(
            pairs, lambda one, done, total: output.progress("cli.reading", device=one.slug, done=done, total=total)
        )
        turbine, person = connection.turbine.slug, arguments.settings.person
    for report in reports:
        if report.lost is not None:
            raise report.lost
    made = ((to_set(one, turbine, person, "", time.time_ns()), one.target.description) for one in reports)
    return _tell(check_sets(made), output)


def _read(path: Path) -> tuple[ParameterSet, Description]:
    known = {name: load_builtin(name) for name in BUILTIN}
    parameters = read_set_file(path.read_bytes(), path.name, Taking(known)).parameters
    description = known.get(parameters.description_id)
    if description is None:
        raise SetFileError(file=path.name, line=1, reason=f"no description {parameters.description_id} is known")
    return parameters, description


def _tell(stations: list[Judged], output: Output) -> int:
    if output.as_json:
        output.result([_judged_json(one, output) for one in stations], "")
    else:
        for one in stations:
            for line in _lines(one, output):
                output.line(line)
    return BROKEN if any(one.broken(Severity.ERROR) for one in stations) else 0


def _lines(judged: Judged, output: Output) -> Iterator[str]:
    counts = {severity.value: judged.broken(severity) for severity in Severity}
    summary = output.texts("cli.rules_summary", **counts, unchecked=judged.unchecked)
    yield f"{judged.station or ', '.join(judged.devices)}: {summary}"
    for one in judged.findings:
        unchecked = one.verdict is Verdict.NOT_CHECKED
        mark = "?" if unchecked else _MARKS[one.severity]
        yield f"  {mark} {output.texts(f'rule.{one.rule_id}.title')}: {_said(one, output)}  [{one.rule_id}]"
        if not unchecked:
            yield f"      {', '.join(f'{place.slug} {place.address.short}' for place in one.places)}"


def _said(one: Finding, output: Output) -> str:
    if one.verdict is Verdict.NOT_CHECKED:
        return output.texts("rule.not_checked", **one.details)
    said = output.texts(f"rule.{one.rule_id}.broken", **one.details)
    if "at_default" in one.details:
        said += f" ({output.texts('rule.at_default', **one.details)})"
    return said


def _judged_json(judged: Judged, output: Output) -> dict[str, Any]:
    return {
        "station": judged.station,
        "devices": list(judged.devices),
        "findings": [
            {
                "rule": one.rule_id,
                "severity": one.severity.value,
                "verdict": one.verdict.value,
                "text": _said(one, output),
                "places": [{"device": place.slug, "address": str(place.address)} for place in one.places],
                "details": dict(one.details),
            }
            for one in judged.findings
        ],
    }
