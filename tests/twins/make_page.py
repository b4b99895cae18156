"""``python -m tests.twins.make_page FILE`` writes docs/twins.md: what twins do, where, by which tests, what was open.

Made from docs/twins_rules.toml (the rules in our words), from the code (places, choices marked OPEN, constants) and
from the marks of the tests, so that document and code cannot differ. The same tree gives the same bytes.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

ROOT: Final = Path(__file__).resolve().parents[2]
TWINS: Final = ROOT / "app" / "twins"
RULES: Final = ROOT / "docs" / "twins_rules.toml"
PAGE: Final = ROOT / "docs" / "twins.md"
CHAPTERS: Final = {
    "A": "Object dictionary", "B": "Errors and warnings", "C": "Commands of the PMM", "D": "Mains, timers, DC link",
    "E": "24 V supply", "F": "Battery and charger", "G": "Booster and chopper", "H": "Temperatures of the PMM",
    "I": "Inputs, outputs, alarms, position range", "J": "State machine, controlword, statusword", "K": "Modes",
    "L": "EFC, the drive to feather", "M": "Monitors of the PMC", "N": "Scaling", "O": "PDOs",
}  # fmt: skip
PLANT: Final = ("plant*.py", "axis_tuning.py", "wind.py", "rotor.py", "pitch_law.py", "turbine.py")
"""Modules whose constants are the plant's."""
INTRO: Final = """\
# The twins of the OAT drives

This page is generated (`make generate`) from the code, its comments and its tests: what it says is what runs.

## What a twin is

A twin is a program that behaves on the CAN bus as one blade of an OAT pitch system does. Two nodes answer for each
blade: the PMM (supply, battery, temperatures) and the PMC (axis). Behind them runs a model of what they move and
measure: blade, gear, motor, brake, switches, encoders, three-phase mains, DC link, booster, chopper, charger, six
battery blocs, 24 V, heaters and fans. The controllers of an axis run every millisecond, as the drive's own do, with
the drive's own parameters: what is written to 60FBh/1 or 6065h changes what is seen.

## How far to trust it

- **Behaviour** follows the manual of 27.05.2009, issue 1.09, rule by rule; each rule below names the tests that fail
  where it is broken. Firmware of another issue may differ.
- **Where the manual is silent or contradicts itself**, a choice was made. It stands beside the rule as *Open*, with
  its reason, or in the table of readings. Do not conclude from a twin what a real drive does at such a point: try it
  there.
- **Figures of the plant** are as good as their source, which the table of constants names. What is marked as an
  estimate has the right order of magnitude, no more: times, currents and temperatures of your turbine will differ by
  tens of percent.
- **Fit for**: learning the drive, its states and its parameters; rehearsing a service visit; judging whether a change
  of a parameter helps or harms, and why. **Not fit for**: proof of a limit, a load or a safety function.

## A mains failure, and the time to feather

![Mains failure: blade angles, DC link, battery, timers](img/twin-mains-failure.svg)

All three blades at work when the mains fails: the booster takes over when the DC link has fallen, the hold-up timer
runs out, the safety chain opens, and the blades drive to feather on their batteries until their 90 degree switches
end it. Later the shut-down timer switches the units off.

![Time to feather over wind and moment, by the state of the battery](img/twin-time-to-feather.svg)

The way from 0 degrees to the 90 degree switch by an EFC on battery, for batteries of several states. As long as the
battery can give the power, the ramp of 5681h (8 degrees a second) alone says how long it takes. Wind turns the blade
towards feather in this model, so it costs nothing; a moment against the way shows what a weak battery costs. Where a
curve ends, the blade does not arrive within 40 s. Both pictures are drawn by `make plots` from the twins themselves.
"""


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule of the registry. ``lives`` and ``open``: module.Symbol under app/twins, or a path of the tree."""

    id: str
    section: str
    words: str
    lives: tuple[str, ...]
    open: tuple[str, ...] = ()
    readings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class OpenPoint:
    """A choice that code explains; ``place`` is module.Symbol, or the module alone."""

    place: str
    text: str


@dataclass(frozen=True, slots=True)
class Test:
    """A test function that bears the mark of a rule."""

    file: str
    name: str


@dataclass(frozen=True, slots=True)
class Constant:
    """A figure of the plant, or several that share their explanation."""

    module: str
    name: str
    figure: str
    source: str


# -- registry ---------------------------------------------------------------------------


@cache
def registry() -> dict[str, Any]:
    return tomllib.loads(RULES.read_text(encoding="utf-8"))


def rules() -> dict[str, Rule]:
    """By id, in the order of the file."""
    return {
        name: Rule(
            name, fields["section"], fields["words"], tuple(fields["lives"]), tuple(fields.get("open", ())),
            tuple(fields.get("readings", ())),
        )
        for name, fields in registry().items()
        if name != "reading"
    }  # fmt: skip


def readings() -> dict[str, str]:
    return {reading["id"]: reading["words"] for reading in registry()["reading"]}


# -- code -------------------------------------------------------------------------------


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def definitions(body: Sequence[ast.stmt], prefix: str) -> Iterator[tuple[str, ast.stmt]]:
    """Qualified names of classes, functions and assigned names, with their nodes."""
    for node in body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield f"{prefix}.{node.name}", node
            if isinstance(node, ast.ClassDef):
                yield from definitions(node.body, f"{prefix}.{node.name}")
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            yield f"{prefix}.{node.target.id}", node
        elif isinstance(node, ast.Assign):
            for target in node.targets:
                names = target.elts if isinstance(target, ast.Tuple) else [target]
                yield from ((f"{prefix}.{name.id}", node) for name in names if isinstance(name, ast.Name))


def symbols() -> set[str]:
    """All that app/twins defines, as module.Symbol; modules too."""
    found = set()
    for path in TWINS.glob("*.py"):
        found.add(path.stem)
        found.update(name for name, _node in definitions(tree(path).body, path.stem))
    return found


def exists(place: str) -> bool:
    """Whether a place of the registry is there."""
    return (ROOT / place).is_file() if "/" in place else place in symbols()


def open_points() -> list[OpenPoint]:
    """All choices that docstrings and comments of the twins explain."""
    return [point for path in sorted(TWINS.glob("*.py")) for point in _points_of(path)]


def _points_of(path: Path) -> Iterator[OpenPoint]:
    for line, text in sorted([*_docstrings(path), *_comments(path)]):
        for choice in choices(text):
            yield OpenPoint(_place_of(path, line), choice)


def choices(text: str) -> Iterator[str]:
    """What follows each OPEN, up to the next one or the end of the paragraph; with what precedes "OPEN;"."""
    for paragraph in re.split(r"\n\s*\n", text):
        line = " ".join(paragraph.split())
        before, *after = re.split(r"\bOPEN\b(?!\.)", line)
        for piece in after:
            if piece.startswith(";"):
                piece = before.rstrip(". ").rsplit(". ", 1)[-1] + piece
            before = piece
            if said := piece.strip(" :,"):
                yield said


def _docstrings(path: Path) -> Iterator[tuple[int, str]]:
    """Texts that explain a definition or a name, with the line in which they begin."""
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield node.lineno, node.value.value


def _comments(path: Path) -> Iterator[tuple[int, str]]:
    """Comments, those of consecutive lines joined."""
    block: list[str] = []
    first = last = 0
    source = io.StringIO(path.read_text(encoding="utf-8"))
    for token in tokenize.generate_tokens(source.readline):
        if token.type != tokenize.COMMENT:
            continue
        line = token.start[0]
        if block and line != last + 1:
            yield first, " ".join(block)
            block = []
        first = line if not block else first
        last = line
        block.append(token.string.lstrip("# "))
    if block:
        yield first, " ".join(block)


def _place_of(path: Path, line: int) -> str:
    """The innermost definition around a line, or the name that ends just above it; else the module."""
    best, size = path.stem, 1 << 30
    for name, node in definitions(tree(path).body, path.stem):
        end = node.end_lineno or node.lineno
        named = isinstance(node, ast.Assign | ast.AnnAssign) and line == end + 1
        inside = node.lineno <= line <= end
        length = 0 if named else end - node.lineno
        if (named or inside) and length < size:
            best, size = name, length
    return best


# -- tests ------------------------------------------------------------------------------


@cache
def marks() -> dict[str, tuple[Test, ...]]:
    """Tests by the rule whose mark they bear."""
    found: dict[str, list[Test]] = {}
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                test = Test(path.relative_to(ROOT).as_posix(), node.name)
                for rule in _rules_of(node):
                    found.setdefault(rule, []).append(test)
    return {rule: tuple(tests) for rule, tests in found.items()}


def _rules_of(node: ast.FunctionDef | ast.AsyncFunctionDef) -> Iterator[str]:
    for mark in node.decorator_list:
        if isinstance(mark, ast.Call) and ast.unparse(mark.func) == "pytest.mark.rule":
            (argument,) = mark.args
            assert isinstance(argument, ast.Constant) and isinstance(argument.value, str)
            yield argument.value


# -- constants --------------------------------------------------------------------------


def constants() -> Iterator[Constant]:
    """Figures of the plant that are explained where they stand."""
    for path in sorted({path for pattern in PLANT for path in TWINS.glob(pattern)}):
        yield from _constants_in(tree(path).body, path.stem)
        for node in tree(path).body:
            if isinstance(node, ast.ClassDef) and node.name.endswith("Constants"):
                yield from _constants_in(node.body, path.stem)


def _constants_in(body: Sequence[ast.stmt], module: str) -> Iterator[Constant]:
    waiting: list[tuple[str, str]] = []
    for node in body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and _is_figure(node.value):
            assert node.value is not None
            waiting.append((node.target.id.lstrip("_"), ast.unparse(node.value)))
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and waiting:
            source = " ".join(str(node.value.value).split())
            for name, figure in waiting:
                yield Constant(module, name, figure, source)
            waiting = []
        else:
            waiting = []


def _is_figure(node: ast.expr | None) -> bool:
    """A number, or several, perhaps computed from others; no text and no call."""
    if node is None:
        return False
    parts = list(ast.walk(node))
    texts = any(isinstance(part, ast.Constant) and not isinstance(part.value, int | float) for part in parts)
    numbers = any(isinstance(part, ast.Constant) for part in parts)
    return numbers and not texts and not any(isinstance(part, ast.Call | ast.Attribute) for part in parts)


# -- page -------------------------------------------------------------------------------


def text() -> str:
    """The page."""
    quoted = open_points()
    parts = [INTRO, *_rule_parts(quoted), *_other_points(quoted), *_reading_parts(), *_constant_parts()]
    return "\n".join(parts)


def _rule_parts(quoted: Sequence[OpenPoint]) -> Iterator[str]:
    yield f"## The rules\n\n{len(rules())} rules of the manual. Sections are the manual's.\n"
    chapter = ""
    for rule in rules().values():
        if rule.id[0] != chapter:
            chapter = rule.id[0]
            yield f"### {chapter}. {CHAPTERS[chapter]}\n"
        yield _rule_part(rule, quoted)


def _rule_part(rule: Rule, quoted: Sequence[OpenPoint]) -> str:
    lines = [f"**{rule.id}** ({rule.section}). {rule.words}\n"]
    lines += [f"- *Open:* {point.text}" for place in rule.open for point in quoted if point.place == place]
    lines += [f"- *Reading:* {', '.join(rule.readings)}"] if rule.readings else []
    lines += [f"- Lives in {', '.join(f'`{place}`' for place in rule.lives)}"]
    files: dict[str, list[str]] = {}
    for test in marks().get(rule.id, ()):
        files.setdefault(test.file, []).append(f"`{test.name}`")
    lines += [f"- Tests in `{file}`: {', '.join(names)}" for file, names in files.items()]
    return "\n".join(lines) + "\n"


def _other_points(quoted: Sequence[OpenPoint]) -> Iterator[str]:
    taken = {place for rule in rules().values() for place in rule.open}
    yield "## Other open points\n\nWhat the manual leaves open beside these rules, and what the twin does.\n"
    yield "\n".join(f"- `{point.place}`: {point.text}" for point in quoted if point.place not in taken) + "\n"


def _reading_parts() -> Iterator[str]:
    yield "## Readings of contradictions\n\nWhere the manual says two things, the twin follows one.\n"
    users = {name: [rule.id for rule in rules().values() if name in rule.readings] for name in readings()}
    rows = [f"| {name} | {words} | {', '.join(users[name])} |" for name, words in readings().items()]
    yield "\n".join(["| | reading | rules |", "|---|---|---|", *rows]) + "\n"


def _constant_parts() -> Iterator[str]:
    yield "## Constants of the plant\n\nSI units, unless a name says otherwise.\n"
    rows = [f"| `{c.module}` | `{c.name}` | {c.figure} | {c.source.replace('|', '/')} |" for c in constants()]
    yield "\n".join(["| module | name | value | meaning and source |", "|---|---|---|---|", *rows]) + "\n"


def main(arguments: Sequence[str]) -> int:
    """Write the file that is named. Gives the exit code."""
    if len(arguments) != 1:
        print("usage: python -m tests.twins.make_page FILE", file=sys.stderr)
        return 2
    Path(arguments[0]).write_text(text(), encoding="utf-8", newline="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
