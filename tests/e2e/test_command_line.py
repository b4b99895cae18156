"""The whole path by the command line, over TCP, against twins in a process of their own."""

from __future__ import annotations

import json
from pathlib import Path

from app.model.address import Address, parse_address
from app.model.sets import load_set
from app.model.site import load_site
from app.recording.reader import open_recording
from app.wire.decoder import CanOpenDecoder
from app.wire.records import BootUpSeen, Record, SaveSeen, SdoAccess, SdoSeen
from tests.e2e.conftest import Twins, site_for
from tests.e2e.processes import ROOT, hubside, running

PMM1 = "wtg-07/blade-1/pmm"
LIMIT = "3110:01"


def test_the_main_job_from_scan_to_proof(twins: Twins, tmp_path: Path) -> None:
    """Scan, back up completely, write, verify, save, restart, still there; and all of it recorded."""
    data = tmp_path / "data"
    site = ("--site", str(twins.site))

    found = hubside("scan", "--can", twins.address, "--json").json
    assert [(node["node"], node["description"]) for node in found] == [
        (1, "oat-pmm"),
        (2, "oat-pmm"),
        (3, "oat-pmm"),
        (11, "oat-pmc"),
        (12, "oat-pmc"),
        (13, "oat-pmc"),
    ]
    assert all(node["twin"] for node in found)

    backup = hubside("backup", *site, "--record", "--reason", "as found", "--json", data=data)
    assert backup.code == 0, backup.err
    files = [Path(json.loads(line)["file"]) for line in backup.out.splitlines()]
    assert len(files) == 6
    sets = {one.origin.device: one for one in (load_set(path.read_text(), str(path)) for path in files)}
    before = sets[PMM1]
    assert before.values[parse_address(LIMIT)] == 500
    assert before.origin.reason == "as found"
    assert before.complete
    assert {address.major for address in before.empty} == {0x1003}, "only the error history holds no data"

    written = hubside("write", *site, PMM1, LIMIT, "49.0 °C", "--json", "--record", data=data)
    assert written.code == 0, written.err
    assert written.json["was"] == 500 and written.json["now"] == 490 and written.json["verified"]
    assert hubside("save", *site, PMM1, "--record", data=data).code == 0
    assert hubside("restart", *site, PMM1, "--record", data=data).code == 0
    assert _limit(twins) == 490

    recordings = sorted((data / "recordings").glob("*.mcap"))
    assert len(recordings) == 4
    read_addresses = _reads(recordings[0])
    assert {(one.origin.device, a) for one in sets.values() for a in one.values} <= read_addresses
    kinds = [type(record) for path in recordings for record in _decoded(path)]
    assert SaveSeen in kinds and BootUpSeen in kinds


def test_what_is_not_saved_is_gone_after_a_restart(twins: Twins) -> None:
    site = ("--site", str(twins.site))
    assert hubside("write", *site, PMM1, LIMIT, "48.0").code == 0
    assert _limit(twins) == 480
    assert hubside("restart", *site, PMM1).code == 0
    assert _limit(twins) == 500


def test_saved_values_outlive_the_process(tmp_path: Path) -> None:
    state = str(tmp_path / "state")
    for expected, new in ((500, "47.0"), (470, None)):
        with running("twin", "oat", "--can", "socketcand:127.0.0.1:0", "--state", state, "--json") as process:
            address = json.loads(process.wait_for('"address"'))["address"]
            site = site_for(address, tmp_path)
            read = hubside("read", "--site", str(site), PMM1, LIMIT, "--json").json
            assert read["values"][LIMIT]["raw"] == expected
            if new is not None:
                assert hubside("write", "--site", str(site), PMM1, LIMIT, new, "--save").code == 0


def test_a_write_is_refused_before_anything_is_sent(twins: Twins, tmp_path: Path) -> None:
    """Out of range, of a wrong type, read-only, unknown: exit code 3, the limit is named, no download on the bus."""
    data = tmp_path / "data"
    for address, value, code, named in (
        (LIMIT, "99999", "limit", "3276.7"),
        (LIMIT, "warm", "value_type", "no number"),
        ("3000", "1", "access", "ro"),
        ("3999", "1", "unknown_object", "3999"),
    ):
        done = hubside("write", "--site", str(twins.site), PMM1, address, value, "--json", "--record", data=data)
        assert done.code == 3, (address, value, done.err)
        assert done.error["error"] == code
        assert named in done.error["text"]
    for path in (data / "recordings").glob("*.mcap"):
        sent = [r for r in _decoded(path) if isinstance(r, SdoSeen) and r.access is SdoAccess.WRITE]
        assert sent == []


def test_exit_codes(twins: Twins, tmp_path: Path) -> None:
    site = ("--site", str(twins.site))
    assert hubside("read", *site, "wtg-07/blade-9/pmm", LIMIT).code == 2
    assert hubside("read", *site, PMM1, "nonsense").code == 2
    assert hubside("read", "--can", twins.address, "99", "1000").code == 5
    assert hubside("scan", "--can", "socketcand:127.0.0.1:9").code == 5
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("schema = 1\n[turbine.A_]\n")
    assert hubside("scan", "--site", str(wrong)).code == 2


def test_a_factory_object_is_refused_by_us_and_by_the_device(twins: Twins) -> None:
    site = ("--site", str(twins.site))
    assert hubside("write", *site, PMM1, "30F1:01", "5").code == 3
    done = hubside("write", *site, PMM1, "30F1:01", "5", "--factory", "--json")
    assert done.code == 4, done.err
    assert done.error["error"] == "sdo_abort"
    assert "06010002h" in done.error["text"]


def _limit(twins: Twins) -> int:
    raw = hubside("read", "--site", str(twins.site), PMM1, LIMIT, "--json").json["values"][LIMIT]["raw"]
    assert isinstance(raw, int)
    return raw


def _decoded(path: Path) -> list[Record]:
    decoder = CanOpenDecoder("can0")
    with open_recording(path) as recording:
        return decoder.feed_all(recording.frames())


def _reads(path: Path) -> set[tuple[str, Address]]:
    """Device and address of every finished read in a recording."""
    (turbine,) = load_site(ROOT / "docs" / "sites" / "example.toml")
    slugs = {device.node: device.slug for device in turbine.devices}
    return {
        (slugs[record.node], record.address)
        for record in _decoded(path)
        if isinstance(record, SdoSeen) and record.access is SdoAccess.READ and record.data is not None
    }
