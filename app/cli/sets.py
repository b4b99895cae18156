"""``hubside sets``: parameter sets. Each module of ``PARTS`` adds its own actions by ``add_actions``."""

from __future__ import annotations

import argparse
import importlib
from typing import Final

PARTS: Final = ("sets_library", "sets_recover", "sets_diff", "sets_fleet", "sets_rules")
"""Modules of this package, in the order of the help."""


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the commands."""
    parser = commands.add_parser("sets", help="parameter sets: compare, check, recover")
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    for part in PARTS:
        importlib.import_module(f"app.cli.{part}").add_actions(actions)
