"""``python -m bench NAME``: run one benchmark, or all of them.

The last line of each is ``BENCH NAME ratio=R target=T ok|short``; the exit code is 1 where one fell short.
"""

from __future__ import annotations

import argparse
import platform
import sys
from importlib import import_module
from pathlib import Path

from bench._result import Result

NAMES = sorted(path.stem for path in Path(__file__).parent.glob("[a-z]*.py"))


def run_one(name: str, full: bool) -> bool:
    """Run the benchmark and print its figures; True where it reached its target."""
    result: Result = import_module(f"bench.{name}").run(full)
    for line in result.lines:
        print(f"  {line}")
    for shortfall in result.shortfalls:
        print(f"  short: {shortfall}")
    verdict = "ok" if result.ok else "short"
    print(f"BENCH {name} ratio={result.ratio:.2f} target={result.target:g} {verdict}", flush=True)
    return result.ok


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m bench", description="measure Hubside beside its peers")
    parser.add_argument("name", choices=[*NAMES, "all"])
    parser.add_argument("--full", action="store_true", help="the long form")
    arguments = parser.parse_args()
    print(f"Python {platform.python_version()}, {platform.system()} {platform.machine()}", flush=True)
    names = NAMES if arguments.name == "all" else [arguments.name]
    reached = [run_one(name, arguments.full) for name in names]
    return 0 if all(reached) else 1


if __name__ == "__main__":
    sys.exit(main())
