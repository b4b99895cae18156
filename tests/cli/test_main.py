"""The parser of the command line loads what a command needs, and knows every command."""

from __future__ import annotations

import argparse
import subprocess
import sys

from app.cli.main import COMMANDS, build_parser


def commands(parser: argparse.ArgumentParser) -> list[str]:
    (found,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    return list(found.choices)


def test_each_module_adds_the_commands_that_are_said_of_it() -> None:
    for module, names in COMMANDS.items():
        assert commands(build_parser(names)) == list(names), module
    assert commands(build_parser()) == [name for names in COMMANDS.values() for name in names]


def test_a_folder_that_is_called_like_a_command_hides_none() -> None:
    parsed = build_parser(["--data", "twin", "od", "list"]).parse_args(["--data", "twin", "od", "list"])
    assert parsed.command == "od"


def test_the_demo_starts_its_twins_before_it_loads_heavy_libraries() -> None:
    code = (
        "import sys; from app.cli.main import build_parser; build_parser(['demo']);"
        "print(*sorted({'numpy', 'can', 'canopen', 'fastapi', 'viser', 'mcap', 'sqlalchemy'} & sys.modules.keys()))"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True, timeout=60)
    assert done.stdout.split() == []
