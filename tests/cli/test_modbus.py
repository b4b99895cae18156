"""``--modbus``: commands on given addresses of Modbus TCP, against twins in real time, with the exit codes of CAN."""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest

from app.cli.main import main
from app.drivers.modbus_config import ModbusPeer
from app.model.address import Address
from app.model.sets import load_set
from app.recording.reader import open_recording
from tests.drivers.modbus_rig import Bad, twin
from tests.drivers.modbus_server import Dictionary, serving
from tests.e2e.processes import hubside, running

WINDOW = "6065"
NOBODY = "127.0.0.1:9"
_WITH_ACTIONS = ("sets", "motors", "pdo")


@dataclass
class Bench:
    """``hubside`` on a data folder of its own, and a drive."""

    peer: ModbusPeer
    data: Path
    capsys: pytest.CaptureFixture[str]

    def __call__(self, command: str, *words: object, at: str | None = None) -> tuple[int, Any, str]:
        """Exit code, the last result, and what was said."""
        where = ("--modbus", at or self.peer.server, "--listen-s", "0.1")
        action = [str(words[0])] if command in _WITH_ACTIONS else []
        rest = map(str, words[len(action) :])
        code = main(["--data", str(self.data), command, *action, *where, *rest, "--json"])
        told = self.capsys.readouterr()
        lines = told.out.strip().splitlines()
        return code, json.loads(lines[-1]) if lines else None, told.err


@pytest.fixture
def bench(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    monkeypatch.setenv("HUBSIDE_LANGUAGE", "en")
    with twin() as peer:
        yield Bench(peer, tmp_path / "data", capsys)


@pytest.fixture
def mute() -> Iterator[str]:
    """The address of something that takes connections and never answers."""
    with closing(socket.create_server(("127.0.0.1", 0))) as listening:
        yield f"127.0.0.1:{listening.getsockname()[1]}"


def test_a_scan_tells_who_is_at_each_address(bench: Bench) -> None:
    code, found, said = bench("scan", at=f"{bench.peer.server}=200,{NOBODY}")
    assert code == 0
    (node,) = found
    assert (node["node"], node["address"], node["description"]) == (200, bench.peer.server, "nanotec-pd4e")
    assert (node["variant"], node["drive_serial"], node["twin"]) == ("Nanotec PD4-E591L42-E-65-4", "TWIN-0001", True)
    assert NOBODY in said, "who does not answer is told"


def test_where_nobody_answers_the_code_is_5_and_the_address_is_named(bench: Bench, mute: str) -> None:
    for where in (NOBODY, mute):
        for command, words in (("scan", ()), ("read", (1, WINDOW)), ("backup", ()), ("save", (1,))):
            code, _, said = bench(command, *words, at=where)
            assert code == 5, command
            assert where in said, command


def test_wrong_addresses_and_nodes_are_usage_errors(bench: Bench) -> None:
    server = bench.peer.server
    for where in ("127.0.0.1:99999", f"{server}=248", f"{server}=0", f"{server},{server}", f"{server}/256", "a b"):
        assert bench("scan", at=where)[0] == 2, where
    code, _, said = bench("read", 7, WINDOW, at=f"{server}=247")
    assert code == 2 and f"247 ({server})" in said
    assert bench("read", 247, WINDOW, at=f"{server}=247")[0] == 0, "Modbus numbers devices up to 247"


def test_only_the_device_that_is_named_is_asked(bench: Bench) -> None:
    """Of two addresses one is dead: a command on the other one works, one on all of them does not."""
    both = f"{bench.peer.server},{NOBODY}"
    assert bench("read", 1, WINDOW, at=both)[0] == 0
    code, _, said = bench("backup", at=both)
    assert code == 5 and NOBODY in said


async def test_what_is_not_recognised_is_told(tmp_path: Path) -> None:
    """Another maker's device: known to be there, and not taken for what it is not."""
    values = {Address(0x1000): 0x00040192, Address(0x1018, 1): 0x0000026D}
    async with serving(Bad(Dictionary(values=values))) as server:
        where = ("--modbus", server.peer.server, "--json")
        scanned = await asyncio.to_thread(hubside, "scan", *where, data=tmp_path)
        assert scanned.code == 0
        assert [one["description"] for one in scanned.json] == [None]
        read = await asyncio.to_thread(hubside, "read", *where, "1", WINDOW, data=tmp_path)
        assert read.code == 2 and server.peer.server in read.error["text"]


def test_read_write_backup_and_recording(bench: Bench) -> None:
    code, told, _ = bench("write", 1, WINDOW, "51.2", "--record")
    assert (code, told["verified"]) == (0, True)
    assert bench("read", 1, WINDOW)[1]["values"][f"{WINDOW}:00"]["raw"] == told["now"]
    code, _, said = bench("write", 1, "6041", "1")
    assert code == 3, said
    code, told, _ = bench("backup")
    assert code == 0
    kept = load_set(Path(told["file"]).read_text(encoding="utf-8"), "set")
    assert kept.origin.device == "bus/nodes/1" and len(kept.values) > 800
    (file,) = (bench.data / "recordings").glob("*.mcap")
    with open_recording(file, strict=True) as recording:
        assert len(list(recording.frames())) > 4


def test_a_set_goes_out_and_comes_back_and_a_data_sheet_of_can_is_refused(bench: Bench) -> None:
    code, told, _ = bench("backup")
    kept = load_set(Path(told["file"]).read_text(encoding="utf-8"), "set")

    def sets(*words: object) -> tuple[int, str]:
        code = main(["--data", str(bench.data), "sets", *map(str, words), "--json"])
        return code, bench.capsys.readouterr().err

    for form in ("json", "csv"):
        file = bench.data / f"servo.{form}"
        assert sets("export", kept.hash[:12], "--format", form, "--output", file)[0] == 0
        assert sets("import", file)[0] == 0
    code, said = sets("export", kept.hash[:12], "--format", "dcf", "--output", bench.data / "servo.dcf")
    assert code == 2 and "take JSON or CSV" in said
    assert not (bench.data / "servo.dcf").exists()
    assert main(["--data", str(bench.data), "sets", "list", "--json"]) == 0
    listed = json.loads(bench.capsys.readouterr().out)
    assert [one["hash"] for one in listed] == [kept.hash], "what came back is the same set"


def test_a_set_is_checked_compared_and_restored(bench: Bench) -> None:
    code, told, _ = bench("backup")
    file = told["file"]
    assert bench("sets", "check")[0] == 0
    assert bench("sets", "diff", file, "live:1")[0] == 0
    assert bench("write", 1, WINDOW, "raw:300")[0] == 0
    code, told, _ = bench("sets", "diff", file, "live:1")
    assert (code, [row["address"] for row in told["rows"]]) == (1, [WINDOW])
    code, told, _ = bench("restore", file, "--plan")
    assert code == 0 and told["result"] is None
    assert [step["kind"] for step in told["plan"]["steps"]] == ["write", "confirm", "save", "prove"]
    assert bench("sets", "diff", file, "live:1")[0] == 1, "a plan writes nothing"
    code, told, _ = bench("restore", file, "--yes", "--restart")
    assert (code, told["result"]["end"], told["result"]["proven"]) == (0, "new", True)
    assert bench("sets", "diff", file, "live:1")[0] == 0


def test_what_the_drive_has_not_is_refused_with_the_reason(bench: Bench) -> None:
    example = "0197a000-0000-7000-8000-00000000e003"
    for words, why in (
        (("motors", "apply", example, "--device", 1, "--plan"), "no motor"),
        (("motors", "compare", example, "--device", 1), "no motor"),
        (("pdo", "show", 1), "no PDOs"),
    ):
        code, _, said = bench(words[0], *words[1:])
        assert (code, why in said) == (2, True), said


def test_record_alone_would_hold_nothing_and_is_refused(bench: Bench) -> None:
    assert bench("record", "--seconds", 1)[0] == 2


def test_an_axis_is_not_set_moving_by_a_careless_write(bench: Bench) -> None:
    assert bench("write", 1, "6040", "15")[0] == 3


def test_the_page_is_served_on_given_addresses(bench: Bench, tmp_path: Path) -> None:
    """One of them is dead: that is told, and the page works on the other one."""
    both = f"{bench.peer.server},{NOBODY}"
    arguments = ("serve", "--modbus", both, "--port", "0", "--data", str(tmp_path / "served"), "--json")
    with running(*arguments) as process:
        url = json.loads(process.wait_for('"url"'))["url"]
        assert process.wait_for(NOBODY)
        with httpx.Client(base_url=url.partition("?")[0], follow_redirects=True, timeout=30) as page:
            assert page.get(f"?{url.partition('?')[2]}").status_code == 200
            turbine = page.get("api/live/turbine").json()
            (device,) = turbine["stations"][0]["devices"]
            assert (turbine["slug"], device["slug"], device["description_id"]) == ("bus", "bus/nodes/1", "nanotec-pd4e")
            for path in ("api/settings/adapters", "api/settings/site", "api/settings/polling"):
                assert page.get(path).status_code == 200, path


def test_nothing_to_serve_is_no_answer(tmp_path: Path) -> None:
    done = hubside("serve", "--modbus", NOBODY, "--port", "0", "--json", data=tmp_path)
    assert done.code == 5 and NOBODY in done.error["text"]
