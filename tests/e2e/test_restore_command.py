"""``hubside restore`` as a process: confirmed by typing, interrupted, killed, and what other commands may do then."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.e2e.conftest import Twins
from tests.e2e.processes import HUBSIDE, ROOT, START_S, USUAL, Process, hubside, running

PMM = "wtg-07/blade-1/pmm"
LIMIT = "3110:01"
ASKED = "Type 'confirm'"


@contextmanager
def asked(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    """A restore that has written everything and waits for the person."""
    popen = subprocess.Popen(
        [*HUBSIDE, "restore", *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        cwd=ROOT,
        env={**os.environ, **USUAL},
    )
    assert popen.stdout is not None
    try:
        for line in popen.stdout:
            if ASKED in line:
                break
        else:
            raise AssertionError("it never asked")
        yield popen
    finally:
        if popen.poll() is None:
            popen.kill()
        popen.communicate(timeout=START_S)


def at(twins: Twins) -> tuple[str, ...]:
    return "--site", str(twins.site), "--listen-s", "0.1"


def limit(twins: Twins) -> Any:
    return hubside("read", *at(twins), PMM, LIMIT, "--json").json["values"][LIMIT]["raw"]


def other_set(twins: Twins, data: Path) -> str:
    """The set of a PMM whose limit is 49.0 °C, taken over the wire; the device has 50.0 °C again."""
    site = at(twins)
    assert hubside("write", *site, PMM, LIMIT, "49", data=data).code == 0
    backup = hubside("backup", *site, PMM, "--json", data=data)
    assert hubside("write", *site, PMM, LIMIT, "50", data=data).code == 0
    file: str = json.loads(backup.out.splitlines()[0])["file"]
    return file


def test_the_person_decides_and_a_killed_tool_leaves_the_way_back(twins: Twins, tmp_path: Path) -> None:
    data = tmp_path / "data"
    site = (*at(twins), "--data", str(data))
    file = other_set(twins, data)

    planned = hubside("restore", file, *site, "--plan", "--json")
    assert planned.code == 0, planned.err
    assert [(row["address"], row["wanted"]) for row in planned.json["plan"]["rows"] if row["why"] is None] == [
        (LIMIT, 490)
    ]

    with asked(file, *site) as popen:
        popen.send_signal(signal.SIGINT)
        out, _ = popen.communicate(timeout=START_S)
    assert popen.returncode == 3, out
    assert ": old." in out and limit(twins) == 500

    with asked(file, *site) as popen:
        popen.kill()
    assert limit(twins) == 490, "written, and nothing saved"
    listed = hubside("restore", "--list", "--data", str(data), "--json").json
    assert [one["state"] for one in listed] == ["incomplete", "rolled-back"]
    for command in (
        ("write", PMM, LIMIT, "48"),
        ("write", PMM, LIMIT, "48", "--motion"),
        ("save", PMM),
        ("restart", PMM),
    ):
        refused = hubside(command[0], *site, *command[1:], "--json")
        assert (refused.code, refused.error["error"]) == (3, "restore_open"), command
    bare = hubside("save", "--can", twins.address, "1", "--data", str(data), "--listen-s", "0.1", "--json")
    assert (bare.code, bare.error["error"]) == (3, "restore_open"), "the same device on a bus without names"

    back = hubside("restore", "--roll-back", *site, "--json")
    assert back.code == 0, back.err
    assert (back.json["result"]["end"], limit(twins)) == ("old", 500)

    with asked(file, *site, "--reason", "test") as popen:
        out, _ = popen.communicate("confirm\n", timeout=START_S)
    assert popen.returncode == 0, out
    assert ": new." in out and "not yet proven" in out and limit(twins) == 490


def test_what_can_never_be_finished_is_given_up_for_a_reason(twins: Twins, tmp_path: Path) -> None:
    data = tmp_path / "data"
    site = (*at(twins), "--data", str(data))
    file = other_set(twins, data)
    with asked(file, *site) as popen:
        popen.kill()
    (row,) = hubside("restore", "--list", "--data", str(data), "--json").json
    order = ("restore", "--give-up", row["id"], "--data", str(data), "--json")
    for terms in ((), ("--expert",), ("--expert", "--reason", " ")):
        refused = hubside(*order, *terms)
        assert (refused.code, refused.error["error"]) == (2, "usage"), terms
    assert hubside("save", *site, PMM, "--json").code == 3
    done = hubside(*order, "--expert", "--reason", "PMC exchanged")
    assert (done.code, done.json["state"]) == (0, "given-up"), done.err
    assert hubside("save", *site, PMM, "--json").code == 0
    assert hubside(*order, "--expert", "--reason", "once more").error["error"] == "restore_state"


def test_the_gate_holds_beside_a_server_that_has_the_store(twins: Twins, tmp_path: Path) -> None:
    data = tmp_path / "data"
    site = (*at(twins), "--data", str(data))
    file = other_set(twins, data)
    with asked(file, *site) as popen:
        refused = hubside("write", *site, PMM, LIMIT, "48", "--json")
        assert (refused.code, refused.error["error"]) == (3, "restore_open"), refused.err
        popen.kill()
    with running("serve", *site, "--port", "0", "--json") as server:
        _until_served(server)
        refused = hubside("save", *site, PMM, "--json")
        assert (refused.code, refused.error["error"]) == (3, "restore_open"), refused.err
        again = hubside("restore", "--resume", *site, "--json")
        assert (again.code, again.error["error"]) == (2, "store_in_use")


def _until_served(server: Process) -> None:
    server.wait_for('"url"')
