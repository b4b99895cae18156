"""``hubside twin fault``: faults and scenarios of twins that run.

What the commands need is loaded when one is run: ``hubside twin oat`` has this module too, and shall start soon.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from app.cli.output import Output
from app.errors import UsageError
from app.model.fault import CATALOGUE, FaultKind, FaultOrder, active_table, kind_table, order_from_words

if TYPE_CHECKING:
    from app.cli.control_client import ControlClient

Run = Callable[[argparse.Namespace, Output, "ControlClient"], Awaitable[None]]
TOKEN_VARIABLE: Final = "HUBSIDE_TWIN_TOKEN"
_ALL: Final = "all"


def add_parser(kinds: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the commands."""
    parser = kinds.add_parser("fault", help="faults and scenarios of twins that run")
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")

    def action(name: str, run: Run, text: str) -> argparse.ArgumentParser:
        one = actions.add_parser(name, help=text)
        one.add_argument("--control", required=True, metavar="HOST:PORT", help="as the twins told at their start")
        one.add_argument(
            "--token", default=os.environ.get(TOKEN_VARIABLE), help=f"their secret; default: {TOKEN_VARIABLE}"
        )
        one.set_defaults(run=lambda arguments, output: _run(arguments, output, run))
        return one

    kinds_of = actions.add_parser("kinds", help="all kinds of fault, with what can be said of them")
    kinds_of.set_defaults(run=_kinds)
    action("list", _list, "what acts now")
    put = action("set", _set, "put a fault in")
    put.add_argument("kind")
    put.add_argument("values", nargs="*", metavar="NAME=VALUE", help="blade, node, for_s, and values of the kind")
    clear = action("clear", _clear, "take a fault out")
    clear.add_argument("fault", metavar="ID", help=f"number of the fault, or '{_ALL}'")
    action("scenarios", _scenarios, "all scenarios that can be played by name")
    play = action("play", _play, "play a scenario")
    play.add_argument("scenario", metavar="NAME|FILE", help="its name, or a file (with a dot or a slash)")
    action("stop", _stop, "end the scenario that plays")


def _run(arguments: argparse.Namespace, output: Output, run: Run) -> int:
    import asyncio

    return asyncio.run(_with_twins(arguments, output, run))


async def _with_twins(arguments: argparse.Namespace, output: Output, run: Run) -> int:
    if not arguments.token:
        raise UsageError(reason=f"the twins' secret is missing: --token, or {TOKEN_VARIABLE}")
    from app.cli.control_client import ControlClient

    client = ControlClient(arguments.control, arguments.token)
    try:
        await run(arguments, output, client)
    finally:
        await client.close()
    return 0


def _kinds(_arguments: argparse.Namespace, output: Output) -> int:
    """What this version knows; no twins are asked."""
    if output.as_json:
        output.result([kind_table(kind) for kind in CATALOGUE.values()], "")
        return 0
    texts = output.texts
    head = [texts(f"cli.fault_head.{name}") for name in ("kind", "name", "place", "values")]
    output.table(
        head,
        [(kind.id, texts(f"fault.{kind.id}.name"), kind.target.value, _ranges(kind)) for kind in CATALOGUE.values()],
    )
    return 0


def _ranges(kind: FaultKind) -> str:
    return ", ".join(
        f"{one.name}={one.default:g} ({one.low:g}..{one.high:g}{' ' + one.unit if one.unit else ''})"
        for one in kind.parameters
    )


async def _list(_arguments: argparse.Namespace, output: Output, client: ControlClient) -> None:
    now = await client.situation()
    playing = now.playing
    if output.as_json:
        told: dict[str, Any] = {"now_ns": now.now_ns, "faults": [active_table(fault) for fault in now.faults]}
        if playing is not None:
            told["playing"] = {"scenario": playing.scenario, "title": playing.title, "elapsed_s": playing.elapsed_s}
        output.result(told, "")
        return
    if playing is not None:
        elapsed, duration = f"{playing.elapsed_s:.1f}", f"{playing.duration_s:.1f}"
        output.say("cli.scenario_plays", title=playing.title, elapsed=elapsed, duration=duration)
    if not now.faults:
        output.say("cli.fault_none")
        return
    head = [output.texts(f"cli.fault_head.{name}") for name in ("id", "name", "place", "since", "values")]
    rows = [
        (
            str(fault.id),
            output.texts(f"fault.{fault.order.kind}.name"),
            _place(output, fault.order),
            f"{(now.now_ns - fault.since_ns) / 1e9:.1f} s",
            _values(fault.order),
        )
        for fault in now.faults
    ]
    output.table(head, rows)


async def _set(arguments: argparse.Namespace, output: Output, client: ControlClient) -> None:
    fault = await client.inject(order_from_words(arguments.kind, arguments.values))
    name = output.texts(f"fault.{fault.order.kind}.name")
    place, values = _place(output, fault.order), _values(fault.order)
    text = output.texts("cli.fault_set", id=fault.id, name=name, place=place, values=values)
    output.result(active_table(fault), text)


async def _clear(arguments: argparse.Namespace, output: Output, client: ControlClient) -> None:
    if arguments.fault == _ALL:
        await client.clear_all()
    else:
        await client.clear(_number(arguments.fault))
    output.say("cli.fault_cleared", id=arguments.fault)


async def _scenarios(_arguments: argparse.Namespace, output: Output, client: ControlClient) -> None:
    found = await client.scenarios()
    if output.as_json:
        output.result(
            [{"name": one.name, "title": one.title, "duration_s": one.duration_s, "seed": one.seed} for one in found],
            "",
        )
        return
    head = [output.texts(f"cli.fault_head.{name}") for name in ("name", "duration", "title")]
    output.table(head, [(one.name, f"{one.duration_s:g} s", one.title) for one in found])


async def _play(arguments: argparse.Namespace, output: Output, client: ControlClient) -> None:
    name = arguments.scenario
    if "." in name or "/" in name or "\\" in name:
        await client.play_text(_read(Path(name)), name)
    else:
        await client.play(name)
    output.say("cli.scenario_begun", scenario=name)


async def _stop(_arguments: argparse.Namespace, output: Output, client: ControlClient) -> None:
    await client.stop()
    output.say("cli.scenario_stopped")


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise UsageError(reason=f"{path}: is no text") from error


def _number(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise UsageError(reason=f"'{text}' is neither the number of a fault nor '{_ALL}'") from None


def _place(output: Output, order: FaultOrder) -> str:
    if order.blade is not None:
        return output.texts("cli.fault_blade", blade=order.blade)
    return "" if order.node is None else output.texts("cli.fault_node", node=order.node)


def _values(order: FaultOrder) -> str:
    values = dict(order.values) if order.seconds is None else {**order.values, "for_s": order.seconds}
    return ", ".join(f"{name}={value:g}" for name, value in values.items())
