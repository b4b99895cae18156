"""Control of running twins over TCP: who is let in, what is answered, and that nothing that comes in stops the line."""

from __future__ import annotations

import contextlib
import json
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.model.fault import CATALOGUE, kind_from_table
from app.twins.control_server import ControlServer
from app.twins.line_thread import LineThread
from tests.twins.turbine_rig import TurbineRig

TOKEN = "s3cret"
SCENARIO = 'title = "Short"\nduration_s = 600\nseed = 4\nnote = "Look."\n'
EVENT = '[[event]]\nat_s = 0\nfault = "node_gone"\nnode = 2\n'


class Control:
    """A client that sends lines and reads lines."""

    def __init__(self, port: int) -> None:
        self.sock = socket.create_connection(("127.0.0.1", port), timeout=10)
        self.file = self.sock.makefile("rwb")

    def raw(self, line: bytes) -> bytes:
        self.file.write(line + b"\n")
        self.file.flush()
        return self.file.readline()

    def ask(self, do: str, token: str = TOKEN, **needs: Any) -> dict[str, Any]:
        answer: dict[str, Any] = json.loads(self.raw(json.dumps({"id": 1, "token": token, "do": do, **needs}).encode()))
        assert answer["id"] == 1
        return answer

    def result(self, do: str, **needs: Any) -> Any:
        answer = self.ask(do, **needs)
        assert answer["ok"], answer
        return answer["result"]

    def refused(self, do: str, **needs: Any) -> dict[str, str]:
        answer = self.ask(do, **needs)
        assert not answer["ok"]
        error: dict[str, str] = answer["error"]
        return error

    def close(self) -> None:
        self.file.close()
        self.sock.close()


@pytest.fixture
def server(tmp_path: Path) -> Iterator[ControlServer]:
    """A turbine that runs in real time, with two scenarios, one of them bad."""
    (tmp_path / "short.toml").write_text(SCENARIO + EVENT, encoding="utf-8")
    (tmp_path / "wrong.toml").write_text("title = 3\n", encoding="utf-8")
    rig = TurbineRig()
    with LineThread(rig.line) as thread:
        made = ControlServer(thread, rig.instructor, TOKEN, tmp_path)
        with made:
            yield made
        assert thread.handler_errors == 0


@pytest.fixture
def control(server: ControlServer) -> Iterator[Control]:
    made = Control(server.port)
    yield made
    made.close()


def test_it_listens_on_the_loopback_only(server: ControlServer) -> None:
    assert server.address == f"127.0.0.1:{server.port}"


def test_a_fault_from_the_catalogue_to_its_end(control: Control) -> None:
    kinds = [kind_from_table(table) for table in control.result("catalogue")]
    assert kinds == list(CATALOGUE.values())
    first = control.result("inject", order={"fault": "node_gone", "node": 2})
    second = control.result("inject", order={"fault": "bloc_weak", "blade": 1, "bloc": 3, "for_s": 600})
    now = control.result("active")
    assert now["faults"] == [first, second]
    assert now["playing"] is None
    assert now["now_ns"] >= second["since_ns"] >= first["since_ns"] > 0
    assert second["order"]["ohm_factor"] == 5.0, "defaults are told"
    assert control.result("clear", fault=first["id"]) is None
    assert control.result("active")["faults"] == [second]
    control.result("clear_all")
    assert control.result("active")["faults"] == []


def test_a_scenario_by_name(control: Control, server: ControlServer) -> None:
    assert len(server.problems) == 1
    assert "wrong.toml" in server.problems[0]
    told = {"name": "short", "title": "Short", "duration_s": 600.0, "seed": 4, "note": "Look."}
    assert control.result("scenarios") == [told]
    control.result("play", scenario="short")
    while not (now := control.result("active"))["faults"]:
        pass  # its first event comes with the next step of the line
    playing = now["playing"]
    assert (playing["scenario"], playing["title"], playing["duration_s"]) == ("short", "Short", 600.0)
    assert 0 <= playing["elapsed_s"] < 60
    control.result("stop")
    now = control.result("active")
    assert (now["playing"], now["faults"]) == (None, [])


def test_a_scenario_as_text(control: Control) -> None:
    control.result("play", text=SCENARIO, file="dir/mine.toml")
    assert control.result("active")["playing"]["scenario"] == "mine"
    error = control.refused("play", text="title = 3", file="dir/mine.toml")
    assert "dir/mine.toml" in error["text"]
    assert control.result("active")["playing"]["scenario"] == "mine", "the one that plays is left alone"


@pytest.mark.parametrize(
    ("do", "needs", "field"),
    [
        ("dance", {}, "do"),
        ("active", {"order": {}}, "order"),
        ("inject", {}, "order"),
        ("inject", {"order": []}, "order"),
        ("inject", {"order": {"fault": "flood"}}, "kind"),
        ("inject", {"order": {"fault": "node_gone"}}, "node"),
        ("inject", {"order": {"fault": "node_gone", "node": 77}}, "node"),
        ("inject", {"order": {"fault": "gust", "rise_mps": "strong"}}, "rise_mps"),
        ("inject", {"order": {"fault": "gust", "rise_mps": None}}, "rise_mps"),
        ("clear", {}, "fault"),
        ("clear", {"fault": "1"}, "fault"),
        ("clear", {"fault": 999}, "fault"),
        ("play", {}, "scenario"),
        ("play", {"scenario": "../short"}, "scenario"),
        ("play", {"scenario": ["short"]}, "scenario"),
    ],
)
def test_what_makes_no_sense_is_refused_and_the_field_named(
    control: Control, do: str, needs: dict[str, Any], field: str
) -> None:
    error = control.refused(do, **needs)
    assert (error["code"], error["field"]) == ("usage", field)
    assert error["text"]
    assert control.result("active")["faults"] == []


def gone(control: Control, line: bytes) -> bool:
    try:
        return control.raw(line) == b""
    except ConnectionError:
        return True


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"hello",
        b"[]",
        b"3",
        b"GET / HTTP/1.1",
        b'{"id": 1, "do": "active"}',
        b'{"id": 1, "token": "s3cret"}',
        b'{"token": "s3cret", "do": "active"}',
        b'{"id": [1], "token": "s3cret", "do": "active"}',
        b'{"id": 1, "token": "s3cret", "do": 3}',
        b'{"id": 1, "token": "", "do": "active"}',
        b'{"id": 1, "token": "s3cre", "do": "active"}',
        b'{"id": 1, "token": null, "do": "active"}',
        b'{"id": 1, "token": "\xc3\xa9", "do": "active"}',
        b"[" * 100_000,
        b"\xff\xfe",
        b'{"id": "' + b"x" * 65 + b'", "token": "s3cret", "do": "active"}',
    ],
)
def test_whoever_sends_no_request_or_does_not_know_the_secret_is_dropped(server: ControlServer, line: bytes) -> None:
    stranger = Control(server.port)
    assert gone(stranger, line)
    stranger.close()
    friend = Control(server.port)
    assert friend.result("active")["faults"] == []
    friend.close()


def test_a_line_without_end_is_dropped(server: ControlServer) -> None:
    stranger = Control(server.port)
    with contextlib.suppress(ConnectionError):  # it is gone before all is sent
        stranger.sock.sendall(b"x" * (1 << 20))
        assert stranger.sock.recv(1) == b""
    stranger.sock.close()


def test_requests_in_one_piece_and_in_many(control: Control) -> None:
    one = json.dumps({"id": "a", "token": TOKEN, "do": "active"}).encode() + b"\n"
    control.sock.sendall(one * 3)
    assert [json.loads(control.file.readline())["id"] for _ in range(3)] == ["a"] * 3
    for byte in one:
        control.sock.sendall(bytes((byte,)))
    assert json.loads(control.file.readline())["ok"]


def test_seventeen_are_too_many(server: ControlServer) -> None:
    friends = [Control(server.port) for _ in range(16)]
    for friend in friends:
        friend.result("active")
    one_more = Control(server.port)
    assert gone(one_more, b"{}")
    for friend in (one_more, *friends):
        friend.close()


tables = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=6,
)
KEYS = ("order", "fault", "scenario", "text", "file", "blade", "node", "for_s", "percent")


@given(
    do=st.sampled_from(["inject", "clear", "play", "active", "stop"]),
    needs=st.dictionaries(st.sampled_from(KEYS), tables, max_size=3),
    order=st.dictionaries(st.sampled_from(KEYS), tables, max_size=4),
    kind=st.sampled_from(sorted(CATALOGUE)),
)
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_request_is_answered(
    control: Control, do: str, needs: dict[str, Any], order: dict[str, Any], kind: str
) -> None:
    answer = control.ask(do, **{**needs, **({"order": {**order, "fault": kind}} if do == "inject" else {})})
    assert answer["ok"] or answer["error"]["code"] == "usage", answer
    control.result("clear_all")
