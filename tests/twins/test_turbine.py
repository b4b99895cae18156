"""Three blades on one line: identity, all objects readable, state kept, bus time, work per second."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from app.errors import UsageError
from app.model.description import Access, Description
from app.model.description_file import load_builtin
from app.twins.line import CanLine
from app.twins.turbine import Turbine, build_turbine
from app.wire.nmt import NmtCommand
from tests.twins.harness import MS, SECOND, AbortedError, Master

NODES = {1: "PMM", 2: "PMM", 3: "PMM", 11: "PMC", 12: "PMC", 13: "PMC"}


def start(state_dir: Path | None = None) -> tuple[Master, Turbine]:
    line = CanLine(500_000)
    master = Master(line)
    turbine = build_turbine(line, load_builtin("oat-pmm"), load_builtin("oat-pmc"), state_dir=state_dir)
    turbine.power_on(0)
    master.run(SECOND)
    return master, turbine


def test_six_nodes_boot_and_name_themselves() -> None:
    master, turbine = start()
    boots = [heard.can.can_id - 0x700 for heard in master.heard if heard.can.data == b"\0"]
    assert boots == sorted(NODES)
    serials = set()
    for node, unit in NODES.items():
        assert master.read(node, "1008") == f"HUBSIDE TWIN {unit}".encode()
        serials.add(master.number(node, "1018:04"))
    assert len(serials) == 6
    assert master.number(11, "1000") == 0x00020192
    assert turbine.problems == ()


def test_healthy_at_80_degrees_and_pre_operational() -> None:
    master, _turbine = start()
    for node in (11, 12, 13):
        assert master.number(node, "6064", signed=True) == 8000
        assert master.number(node, "6864", signed=True) == 8000
        assert master.number(node, "6041") & 0x03FF == 0x0231
        assert master.number(node, "60FD") >> 3 & 1
    for node in NODES:
        assert master.number(node, "603F") == 0
        master.put(node, "1017", 100, 2)
        assert master.wait_id(0x700 + node).can.data == b"\x7f"


@pytest.mark.parametrize(("node", "name"), [(2, "oat-pmm"), (12, "oat-pmc")])
def test_every_object_can_be_read_with_its_size(node: int, name: str) -> None:
    master, _turbine = start()
    description: Description = load_builtin(name)
    read = 0
    for entry in description:
        where = str(entry.address)
        if entry.access is Access.WO:
            continue
        try:
            data = master.read(node, where)
        except AbortedError as error:
            assert entry.address.major == 0x1003, where
            assert error.code == 0x08000024, where
            continue
        read += 1
        assert entry.type.size in (None, len(data)), where
    assert read > 200


@pytest.mark.parametrize(("node", "name"), [(2, "oat-pmm"), (12, "oat-pmc")])
def test_defaults_are_those_of_the_description(node: int, name: str) -> None:
    """What commissioning stored, what this unit is, and what is measured differ; nothing else does."""
    master, turbine = start()
    store = turbine.devices[node].store
    for cell in store:
        entry = cell.entry
        if cell.source is not None or entry.default is None or not entry.type.is_integer:
            continue
        found = master.number(node, str(entry.address), signed=entry.type.is_signed)
        default = entry.default + node if entry.node_id and isinstance(entry.default, int) else entry.default
        if found != default:
            assert str(entry.address) in (
                "607C:00 607F:00 6083:00 6084:00 608F:01 6091:01 6091:02 6402:00 687C:00 688F:01 6891:01 6891:02"
            ), entry.address


def test_units_differ_in_the_same_way_each_time() -> None:
    def values() -> list[tuple[int, ...]]:
        master, _turbine = start()
        return [tuple(master.number(node, where) for where in ("3061:01", "3011", "3012")) for node in (1, 2, 3)]

    first = values()
    assert len(set(first)) == 3
    assert first == values()


def test_each_unit_has_its_own_state(tmp_path: Path) -> None:
    master, _turbine = start(tmp_path)
    master.put(11, "6065", 111, 4)
    master.put(12, "6065", 122, 4)
    for node in (11, 12):
        master.put(node, "1010:03", 0x65766173, 4)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["oat-pmc-node-011.json", "oat-pmc-node-012.json"]
    again, _turbine = start(tmp_path)
    assert [again.number(node, "6065") for node in (11, 12, 13)] == [111, 122, 100]


@pytest.mark.parametrize("below", ["", "wtg-07", "site/wtg-07"])
def test_a_state_folder_that_is_a_file_is_refused_at_the_start(tmp_path: Path, below: str) -> None:
    file = tmp_path / "state"
    file.write_text("kept")
    with pytest.raises(UsageError, match="not a folder") as caught:
        start(file / below)
    assert str(file) in caught.value.details["reason"]
    assert file.read_text() == "kept"


def test_a_state_folder_that_cannot_be_made_is_refused_at_the_start(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="folder for state files"):
        start(tmp_path / ("x" * 300))


def test_load_brings_the_bare_defaults_back() -> None:
    master, _turbine = start()
    master.put(11, "1011:03", 0x64616F6C, 4)
    master.nmt(NmtCommand.RESET_NODE, 11)
    master.wait_id(0x70B)
    assert master.number(11, "6091:01") == 1
    assert master.number(11, "607F") == 20000


def test_switched_off_it_is_silent() -> None:
    master, turbine = start()
    turbine.power_off()
    place = len(master.heard)
    master.nmt(NmtCommand.RESET_NODE, 0)
    master.run(2 * SECOND)
    assert len(master.heard) == place


def test_three_moving_blades_need_less_than_real_time() -> None:
    master, turbine = start()
    master.nmt(NmtCommand.START, 0)
    for node in (11, 12, 13):
        master.put(node, "6060", 3, 1)
        master.put(node, "60FF", -400 & 0xFFFFFFFF, 4)
        master.put(node, "6040", 0x010F, 2)
        master.put(node, "6040", 0x000F, 2)
    began_s = time.process_time()
    for _ in range(100):
        master.run(50 * MS)
    used_s = time.process_time() - began_s
    assert all(blade.axis.angle_deg < 65 for blade in turbine.blades)
    assert used_s < 2.5, f"{used_s:.2f} s of work for 5 s"
