"""``hubside twin fault`` on twins that run, and what ``hubside twin oat`` makes of scenarios and faults."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from app.cli.main import build_parser
from app.cli.output import Output
from app.errors import HubsideError, TwinsGoneError, UsageError
from app.model.bundled import bundled_folder
from app.model.fault import CATALOGUE
from app.model.texts import load_texts
from app.twins.control_server import ControlServer
from app.twins.line_thread import LineThread
from tests.twins.turbine_rig import TurbineRig

TOKEN = "c0ffee"
SCENARIO = 'title = "Short"\nduration_s = 600\n[[event]]\nat_s = 0\nfault = "node_gone"\nnode = 2\n'


class Told:
    """What a command printed."""

    def __init__(self, out: str, err: str) -> None:
        self.out = out
        self.err = err

    @property
    def json(self) -> Any:
        return json.loads(self.out)


Command = Callable[..., Told]


def hubside(*arguments: str, language: str = "en") -> Told:
    """Run a command in this process; errors are raised."""
    parsed = build_parser(arguments).parse_args(arguments)
    out, err = io.StringIO(), io.StringIO()
    assert parsed.run(parsed, Output(load_texts(language), parsed.json, out, err)) == 0
    return Told(out.getvalue(), err.getvalue())


@pytest.fixture
def fault(tmp_path: Path) -> Iterator[Command]:
    """``hubside twin fault ...`` on a turbine that runs in real time."""
    (tmp_path / "short.toml").write_text(SCENARIO, encoding="utf-8")
    rig = TurbineRig()
    with LineThread(rig.line) as thread, ControlServer(thread, rig.instructor, TOKEN, tmp_path) as server:

        def run(action: str, *more: str, token: str = TOKEN, **how: str) -> Told:
            return hubside("twin", "fault", action, *more, "--control", server.address, "--token", token, **how)

        yield run


def test_a_fault_from_the_command_line_to_its_end(fault: Command) -> None:
    assert fault("list").err == "No fault acts\n"
    told = fault("set", "bloc_weak", "blade=2", "bloc=3", "for_s=600")
    assert told.out.startswith("Fault 1: Weak battery bloc blade 2 bloc=3, capacity_percent=40")
    assert fault("set", "second_master", "node=11", "index=0x6066", "--json").json["order"]["index"] == 0x6066
    rows = fault("list").out.splitlines()
    assert len(rows) == 3
    assert "blade 2" in rows[1]
    assert "node 11" in rows[2]
    assert [one["id"] for one in fault("list", "--json").json["faults"]] == [1, 2]
    fault("clear", "1")
    assert [one["id"] for one in fault("list", "--json").json["faults"]] == [2]
    assert fault("clear", "all").err == "Taken out: all\n"
    assert fault("list", "--json").json["faults"] == []


def test_it_speaks_german(fault: Command) -> None:
    assert fault("set", "node_gone", "node=2", language="de").out == "Fehler 1: Knoten weg Knoten 2 \n"
    assert fault("list", language="de").out.startswith("NR  NAME")


def test_all_kinds_are_shown_without_twins() -> None:
    rows = hubside("twin", "fault", "kinds").out.splitlines()
    assert len(rows) == 1 + len(CATALOGUE)
    assert "delay_ms=2000 (1..60000 ms)" in next(row for row in rows if row.startswith("late_sdo_ack"))
    assert [one["id"] for one in hubside("twin", "fault", "kinds", "--json").json] == list(CATALOGUE)


def test_scenarios_by_name_and_by_file(fault: Command, tmp_path: Path) -> None:
    assert "Short" in fault("scenarios").out
    assert [one["name"] for one in fault("scenarios", "--json").json] == ["short"]
    fault("play", "short")
    assert fault("list", "--json").json["playing"]["scenario"] == "short"
    assert fault("list").err.startswith("Scenario: Short")
    other = tmp_path / "mine.toml"
    other.write_text(SCENARIO, encoding="utf-8")
    fault("play", str(other))
    assert fault("list", "--json").json["playing"]["scenario"] == "mine"
    fault("stop")
    assert "playing" not in fault("list", "--json").json


@pytest.mark.parametrize(
    "arguments",
    [
        ("set", "flood"),
        ("set", "node_gone"),
        ("set", "node_gone", "node"),
        ("set", "node_gone", "node=two"),
        ("set", "node_gone", "node=77"),
        ("clear", "first"),
        ("clear", "77"),
        ("play", "unknown"),
    ],
)
def test_what_makes_no_sense_is_a_usage_error(fault: Command, arguments: tuple[str, ...]) -> None:
    with pytest.raises(UsageError) as caught:
        fault(*arguments)
    assert caught.value.exit_code == 2
    assert caught.value.details["reason"]


def test_a_bad_file_is_a_usage_error(fault: Command, tmp_path: Path) -> None:
    bad = tmp_path / "bad.toml"
    bad.write_text("title = 3", encoding="utf-8")
    with pytest.raises(UsageError) as caught:
        fault("play", str(bad))
    assert "bad.toml" in caught.value.details["reason"]
    bad.write_bytes(b"\xff")
    with pytest.raises(UsageError):
        fault("play", str(bad))


def test_a_wrong_secret_is_no_answer(fault: Command) -> None:
    with pytest.raises(TwinsGoneError) as caught:
        fault("list", token="wrong")
    assert caught.value.exit_code == 5


@pytest.mark.parametrize(
    ("control", "token", "error"),
    [("127.0.0.1:1", "x", TwinsGoneError), ("nowhere", "x", UsageError), ("127.0.0.1:1", "", UsageError)],
)
def test_twins_that_cannot_be_asked(control: str, token: str, error: type[HubsideError]) -> None:
    with pytest.raises(error):
        hubside("twin", "fault", "list", "--control", control, "--token", token)


def twins(*arguments: str) -> subprocess.CompletedProcess[str]:
    """``hubside twin oat`` in a process of its own."""
    command = [sys.executable, "-m", "app.cli", "--json", "twin", "oat", "--can", "socketcand:127.0.0.1:0", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def test_twins_play_a_scenario_and_end_with_it(tmp_path: Path) -> None:
    path = tmp_path / "one.toml"
    path.write_text('title = "One"\nduration_s = 1\n[start]\nangle_deg = 30\nwind_mps = 9\n', encoding="utf-8")
    ended = twins("--scenario", str(path), "--end", "--fault", "node_gone@0.5s,node=2", "--seed", "4", "--wind", "9")
    assert ended.returncode == 0, ended.stderr
    told = json.loads(ended.stdout)
    assert told["devices"] == 6
    assert told["control"]["address"].startswith("127.0.0.1:")
    assert len(told["control"]["token"]) == 32


@pytest.mark.parametrize(
    "arguments",
    [
        ("--scenario", "missing.toml"),
        ("--end",),
        ("--fault", "flood"),
        ("--fault", "node_gone@1s,node=99"),
        ("--wind", "-3"),
        ("--seed", "x"),
    ],
)
def test_twins_that_cannot_be_started_so_say_why(arguments: tuple[str, ...]) -> None:
    ended = twins(*arguments)
    assert ended.returncode == 2, ended.stderr
    assert ended.stderr


def test_all_scenarios_that_come_with_it_can_be_played_by_name() -> None:
    rig = TurbineRig()
    with LineThread(rig.line) as thread:
        folder = bundled_folder("recordings/scenarios", "recordings/scenarios")
        with ControlServer(thread, rig.instructor, TOKEN, folder) as server:
            assert server.problems == []
            reach = ("--control", server.address, "--token", TOKEN)
            found = hubside("twin", "fault", "scenarios", *reach, "--json").json
            assert len(found) >= 8
            for scenario in found:
                hubside("twin", "fault", "play", scenario["name"], *reach)
                assert hubside("twin", "fault", "list", *reach, "--json").json["playing"]["title"] == scenario["title"]
