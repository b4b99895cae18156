"""The house rules that a machine can hold: imports run one way, and a bus library stays in its own room.

Read from the syntax tree, so that lazy and conditional imports count too.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
APP = ROOT / "app"

BELOW: dict[str, frozenset[str]] = {
    "errors": frozenset(),
    "settings": frozenset({"errors"}),
    "model": frozenset({"errors"}),
    "wire": frozenset({"model", "errors"}),
    "drivers": frozenset({"wire", "model", "errors"}),
    "recording": frozenset({"wire", "model", "errors"}),
    "store": frozenset({"wire", "model", "errors"}),
    "scene": frozenset({"wire", "model", "errors"}),
    "twins": frozenset({"wire", "model", "errors"}),
    "service": frozenset({"drivers", "recording", "store", "scene", "wire", "model", "errors", "settings"}),
    "web": frozenset({"service", "drivers", "recording", "store", "scene", "wire", "model", "errors", "settings"}),
    "cli": frozenset(
        {"service", "web", "twins", "drivers", "recording", "store", "scene", "wire", "model", "errors", "settings"}
    ),
}
"""What each room may import of the project, besides itself."""

ONLY_IN: dict[str, tuple[str, ...]] = {
    "can": ("drivers/", "twins/", "recording/"),
    "canopen": ("drivers/", "twins/"),
    "pymodbus": (),
    "pyModbusTCP": (),
    "pyprofibus": ("drivers/profibus.py",),
    "serial": ("drivers/",),
    "viser": ("scene/",),
    "mcap": ("recording/",),
    "numba": ("twins/",),
    "fastapi": ("web/",),
    "uvicorn": ("web/", "cli/", "cli.py"),
    "sqlalchemy": ("store/",),
    "cryptography": ("service/",),
    "typst": ("service/",),
}
"""Libraries that only the named rooms may import."""

FORBIDDEN = {
    "app.drivers": ("canopen.profiles", "canopen.profiles.p402"),
}
PURE = ("model", "wire", "twins")
CLOCKS = {"time", "monotonic", "monotonic_ns", "time_ns", "perf_counter", "perf_counter_ns", "sleep"}
EDGES = {"twins/paced_thread.py", "twins/line_thread.py", "twins/socketcand_server.py"}
"""Where twins meet real time: the pacing thread and the TCP server."""


def modules() -> list[Path]:
    return sorted(APP.rglob("*.py"))


def room(path: Path) -> str:
    return path.relative_to(APP).parts[0].removesuffix(".py")


def imports(path: Path) -> Iterator[tuple[int, str]]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            for name in node.names:
                yield node.lineno, name.name
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: a relative import hides its room"
            for name in node.names:
                yield node.lineno, f"{node.module}.{name.name}"


@pytest.mark.parametrize("path", modules(), ids=lambda path: str(path.relative_to(APP)))
def test_imports_run_one_way(path: Path) -> None:
    own = room(path)
    if own in ("__init__", "__main__"):
        return
    assert own in BELOW, f"{own} is no room of the house"
    for line, name in imports(path):
        parts = name.split(".")
        if parts[0] == "app" and len(parts) > 1 and parts[1] not in (own, "__version__"):
            assert parts[1] in BELOW[own], f"{path}:{line}: {own} must not import {name}"


@pytest.mark.parametrize("path", modules(), ids=lambda path: str(path.relative_to(APP)))
def test_libraries_stay_in_their_rooms(path: Path) -> None:
    place = path.relative_to(APP).as_posix()
    for line, name in imports(path):
        for library, rooms in ONLY_IN.items():
            if name.split(".")[0] == library:
                assert place.startswith(rooms), f"{path}:{line}: {library} may not be imported here"
        for banned in FORBIDDEN["app.drivers"]:
            assert not name.startswith(banned), f"{path}:{line}: {banned} hides failures"


@pytest.mark.parametrize("path", [p for p in modules() if room(p) in PURE], ids=lambda p: str(p.relative_to(APP)))
def test_no_clock_is_read_in_pure_rooms(path: Path) -> None:
    if path.relative_to(APP).as_posix() in EDGES:
        return
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "time":
            assert node.attr not in CLOCKS, f"{path}:{node.lineno}: a clock is passed in, never read, in {room(path)}"


def test_the_rule_would_notice() -> None:
    """The checker itself: a forbidden import in a made-up module is found."""
    tree = "import viser\nfrom app.twins import plant\n"
    found = [
        name.name if isinstance(node, ast.Import) else f"{node.module}.{name.name}"
        for node in ast.walk(ast.parse(tree))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for name in node.names
    ]
    assert found == ["viser", "app.twins.plant"]
    assert "twins" not in BELOW["service"]
