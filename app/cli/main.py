"""``hubside``: reads the command line, runs one use case, turns errors into exit codes.

Exit codes: 0 done, 2 usage, 3 refused before sending, 4 refused by the device, 5 no answer, 6 sent but not verified;
1 where `sets diff` or `sets parity` found a difference.
"""

from __future__ import annotations

import argparse
import importlib
import logging
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from app import __version__
from app.cli.output import Output
from app.cli.runtime import calm_collector
from app.errors import HubsideError, UsageError
from app.model.texts import load_texts
from app.settings import settings_from

COMMANDS: Final = {
    "od": ("od",),
    "twin": ("twin",),
    "bus": ("scan", "read", "write", "save", "restart", "record"),
    "pdo": ("pdo",),
    "backup": ("backup",),
    "restore": ("restore",),
    "recordings": ("export", "recover"),
    "exchange": ("import", "cut", "merge", "anonymise"),
    "index": ("index",),
    "analysis": ("trips", "search"),
    "sets": ("sets",),
    "serve": ("serve",),
    "replay": ("replay",),
    "demo": ("demo",),
    "users": ("users",),
    "audit": ("audit",),
    "store": ("store",),
    "incidents": ("incident",),
    "motors": ("motors",),
    "verify": ("verify",),
}
"""Modules of this package, each with ``add_parser``, and the commands that it adds."""


def build_parser(arguments: Sequence[str] = ()) -> argparse.ArgumentParser:
    """The parser of all commands, or of those that ``arguments`` name.

    A command's module brings its libraries along: what was not asked for is not waited for.
    """
    parser = argparse.ArgumentParser(prog="hubside", description="The service bench for turbine pitch drives.")
    parser.add_argument("--version", action="version", version=f"hubside {__version__}")
    parser.set_defaults(json=False, data=None, verbose=False)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    named = [module for module, names in COMMANDS.items() if set(names) & set(arguments)]
    for name in named or COMMANDS:
        importlib.import_module(f"app.cli.{name}").add_parser(commands)
    _add_common(parser)
    return parser


def _add_common(parser: argparse.ArgumentParser) -> None:
    """The options of all commands, so that they may stand before the command or behind it."""
    unless_given = argparse.SUPPRESS
    parser.add_argument("--json", action="store_true", default=unless_given, help="results for machines")
    parser.add_argument(
        "--data", type=Path, default=unless_given, metavar="DIR", help="where sets and recordings are kept"
    )
    parser.add_argument("--verbose", action="store_true", default=unless_given, help="log what happens on stderr")
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for child in dict.fromkeys(action.choices.values()):
                _add_common(child)


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; gives the exit code."""
    try:
        return _main(arguments)
    except KeyboardInterrupt:
        return 130


def _main(arguments: Sequence[str] | None) -> int:
    calm_collector()
    given = sys.argv[1:] if arguments is None else arguments
    parsed = build_parser(given).parse_args(given)
    logging.basicConfig(
        level=logging.DEBUG if parsed.verbose else logging.WARNING,
        format="%(asctime)s %(levelname)s %(name)s: %(message)s",
        stream=sys.stderr,
    )
    parsed.settings = settings_from(os.environ, parsed.data)
    output = Output(load_texts(parsed.settings.language), parsed.json)
    try:
        code: int = parsed.run(parsed, output)
    except HubsideError as error:
        output.error(error)
        return error.exit_code
    except BrokenPipeError:  # the reader of our output went away, as `| head` does
        sys.stdout = None
        return 0
    except OSError as error:  # a file or folder that the command named
        place = f"{error.filename}: " if error.filename else ""
        wrong = UsageError(reason=f"{place}{error.strerror or error}")
        output.error(wrong)
        return wrong.exit_code
    return code
