"""Wrong input and bad luck: always a text and an exit code of the contract, never a traceback, nothing claimed."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import can
import durand
import pytest

from tests.e2e.conftest import Twins
from tests.e2e.processes import hubside, running

PMM1 = "wtg-07/blade-1/pmm"


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("demo", "--port", "0", "--data", "{file}"), 2),
        (("serve", "--site", "docs/sites/example.toml", "--port", "99999"), 2),
        (("serve", "--site", "docs/sites/example.toml", "--port", "-1"), 2),
        (("twin", "oat", "--can", "socketcand:127.0.0.1:99999"), 2),
        (("twin", "oat", "--can", "socketcand:127.0.0.1:²"), 2),
        (("twin", "oat", "--turnaround-ms", "nan"), 2),
        (("twin", "oat", "--turnaround-ms", "-4"), 2),
        (("twin", "oat", "--bitrate", "1"), 2),
        (("demo", "--turnaround-ms", "-4"), 2),
        (("scan", "--can", "socketcand:127.0.0.1:9", "--listen-s", "-1"), 2),
        (("scan", "--can", "nonsense:1"), 2),
        (("scan", "--can", "socketcand:127.0.0.1:9"), 5),
        (("read", "--can", "socketcand:127.0.0.1:9", "²", "6065"), 5),
        (("read", "--can", "socketcand:127.0.0.1:9", "--eds", "²={file}", "1", "6065"), 2),
        (("read", "--site", "/nope.toml", "1", "6065"), 2),
        (("od", "export", "oat-pmm", "--output", "/nope/x"), 2),
        (("od", "export", "oat-pmm", "--output", "{folder}"), 2),
        (("od", "show", "oat-pmm", "3110:xx"), 2),
        (("od", "show", "oat-pmm", "4711"), 3),
        (("od", "check", "{file}"), 2),
        (("recover", "/nope"), 2),
        (("export", "--pack", "{file}"), 2),
    ],
)
def test_a_text_and_a_code(arguments: tuple[str, ...], code: int, tmp_path: Path) -> None:
    file = tmp_path / "a file"
    file.write_text("neither TOML nor anything else\n")
    done = hubside(*(part.format(file=file, folder=tmp_path) for part in arguments))
    assert done.code == code, done.err
    assert "Traceback" not in done.err
    assert done.err.strip() or done.out.strip()


def test_data_that_is_no_folder_is_told_before_the_bus_is_touched(twins: Twins, tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    for command in (
        ("record", "--can", twins.address, "--seconds", "1"),
        ("backup", "--site", str(twins.site), "--record"),
    ):
        done = hubside(*command, data=file)
        assert done.code == 2 and "Traceback" not in done.err, done.err


def test_absurd_values_are_refused(twins: Twins) -> None:
    site = ("--site", str(twins.site))
    for value in ("9" * 5000, "1e400", "٣", "0x", ""):
        done = hubside("write", *site, PMM1, "3110:01", value, "--json")
        assert done.code == 3, (value[:20], done.err)
        assert done.error["error"] in ("value_type", "limit")


def test_pdos_and_load_commands_are_no_ordinary_values(twins: Twins) -> None:
    site = ("--site", str(twins.site))
    for address, value in (("1A00:00", "0"), ("1800:01", "0xC000018C"), ("1010:03", "raw:1702257011"), ("6040", "6")):
        assert hubside("write", *site, "wtg-07/blade-1/pmc", address, value).code == 3
    allowed = hubside("write", *site, PMM1, "1010:03", "raw:1702257011", "--communication", "--json")
    assert allowed.code == 0 and allowed.json["verified"] and allowed.json["now"] is None
    moved = hubside("write", *site, "wtg-07/blade-1/pmc", "6040", "6", "--motion", "--json")
    assert moved.code == 6 and not moved.json["verified"], "its effect is not looked for"


def test_a_backup_that_loses_the_bus_says_so_and_writes_nothing(twins: Twins, tmp_path: Path) -> None:
    data = tmp_path / "data"

    def cut() -> None:
        twins.process.popen.send_signal(signal.SIGKILL)

    bus = can.Bus(interface="socketcand", host="127.0.0.1", port=twins.port, channel="can0")
    requests = 0

    def watch() -> None:
        nonlocal requests
        while requests < 60:
            message = bus.recv(20)
            if message is None:
                return
            requests += message.arbitration_id == 0x601
        cut()

    watcher = threading.Thread(target=watch)
    watcher.start()
    done = hubside("backup", "--site", str(twins.site), data=data)
    watcher.join(30)
    bus.shutdown()
    assert requests >= 60
    assert done.code == 5, done.err
    assert "incomplete" in done.err
    assert not list(data.glob("sets/**/*.json"))


def test_sigterm_ends_a_command_properly(twins: Twins) -> None:
    with running("scan", "--can", twins.address, "--listen-s", "60") as process:
        process.wait_for("Listening")
        process.popen.send_signal(signal.SIGTERM)
        assert process.popen.wait(10) == 143
    assert not any("Traceback" in line for line in process.lines)


@contextmanager
def durand_node(twins: Twins, node: int, eds: Path) -> Iterator[None]:
    """A node of another CANopen implementation on the same bus, and its EDS in a file."""
    bus = can.Bus(interface="socketcand", host="127.0.0.1", port=twins.port, channel="can0")
    network = durand.CANBusNetwork(bus)
    try:
        foreign = durand.MinimalNode(network, node)
        setting = durand.Variable(durand.DatatypeEnum.UNSIGNED16, "rw", 5, name="Setting")
        foreign.object_dictionary[0x2000] = setting
        eds.write_text(foreign.eds.content, encoding="ascii")
        yield
    finally:
        network.stop()
        bus.shutdown()


def test_a_device_that_is_not_ours_is_used_by_its_eds(twins: Twins, tmp_path: Path) -> None:
    eds = tmp_path / "dur.eds"
    with durand_node(twins, 33, eds):
        for given in (f"33={eds}", str(eds)):
            place = ("--can", twins.address, "--eds", given)
            found = {one["node"]: one for one in hubside("scan", *place, "--json").json}
            assert found[33]["description"] is not None
            assert found[11]["description"] == "oat-pmc", "ours keep theirs"
            read = hubside("read", *place, "33", "2000", "--json")
            assert read.code == 0, read.err
        written = hubside("write", *place, "33", "2000", "raw:77", "--json")
        assert written.code == 0, written.err
        assert hubside("read", *place, "33", "2000", "--json").json["values"]["2000:00"]["raw"] == 77
        told = hubside("od", "check", str(eds))
        assert told.code == 0 and f"{eds}" in told.err
