"""The memory of a twin on disk: replaced as a whole, readable, never a crash."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from app.model.address import Address
from app.twins.state_file import Memory, StateFile
from tests.twins.oat_rig import PMC, PMM, BladeRig

PMC_FILE = "oat-pmc-node-011.json"


def test_round_trip(tmp_path: Path) -> None:
    file = StateFile(tmp_path / "a" / "b.json", "oat-pmc")
    assert file.load().memory is None
    memory = Memory({Address(0x6065): b"\x64\0\0\0"}, {Address(0x3050): b"\1\2\3\4"})
    file.store(memory)
    assert file.load().memory == memory
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["b.json"]


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "Expecting value"),
        (b'{"format": "hubside-twin-state/1", "descr', "Unterminated string"),
        (b"\xff\xfe\0", "decode"),
        (b"[]", "list indices"),
        (b'{"format": "other"}', "format is 'other'"),
        (b'{"format": "hubside-twin-state/1", "description": "oat-pmm"}', "belongs to 'oat-pmm'"),
        (
            b'{"format": "hubside-twin-state/1", "description": "oat-pmc", "saved": {"6065:00": "xy"}, "remanent": {}}',
            "hex",
        ),
        (
            b'{"format": "hubside-twin-state/1", "description": "oat-pmc", "saved": {"here": "00"}, "remanent": {}}',
            "here",
        ),
    ],
)
def test_a_damaged_file_is_set_aside_and_defaults_are_used(tmp_path: Path, content: bytes, reason: str) -> None:
    path = tmp_path / PMC_FILE
    path.write_bytes(content)
    rig = BladeRig(state_dir=tmp_path)
    problem = rig.pmc.device.memory.problem
    assert problem is not None
    assert reason in problem
    assert str(path) in problem
    assert path.with_suffix(".damaged").read_bytes() == content
    assert rig.get("6091:01") == 1
    rig.put("6065", 123)
    rig.save()
    assert json.loads(path.read_text())["saved"]["6065:00"] == "7b000000"


def test_values_that_do_not_fit_the_description_are_left_out(tmp_path: Path) -> None:
    rig = BladeRig(state_dir=tmp_path)
    rig.save()
    path = tmp_path / PMC_FILE
    document = json.loads(path.read_text())
    document["saved"] |= {"6065:00": "00", "4711:00": "00", "6067:00": "63000000"}
    path.write_text(json.dumps(document))
    again = BladeRig(state_dir=tmp_path)
    assert again.pmc.device.memory.problem is not None
    assert (again.get("6065"), again.get("6067")) == (100, 99)


def test_a_killed_process_comes_back_with_what_was_saved(tmp_path: Path) -> None:
    rig = BladeRig(state_dir=tmp_path)
    rig.put("6065", 222)
    rig.put("3110:01", 444, PMM)
    rig.save()
    rig.save(PMM)
    rig.put("6065", 333)
    again = BladeRig(state_dir=tmp_path)
    assert again.get("6065") == 222
    assert again.get("3110:01", PMM) == 444
    assert again.get("6064") == 8000


def test_a_disk_that_cannot_be_written_is_a_refused_save(tmp_path: Path) -> None:
    folder = tmp_path / "state"
    folder.write_text("a file where a folder should be")
    rig = BladeRig()
    rig.pmc.device.memory._file = StateFile(folder / "x.json", "oat-pmc")
    assert rig.refused("1010:03", 0x65766173) == 0x06060000
    assert rig.pmc.device.memory.problem


_WRITER = """
import sys
from pathlib import Path
from app.model.address import Address
from app.twins.state_file import Memory, StateFile
file = StateFile(Path(sys.argv[1]), "oat-pmc")
for number in range(1, 10**9):
    data = number.to_bytes(4, "little")
    file.store(Memory({Address(0x6065, sub): data for sub in range(200)}, {}))
    print(number, flush=True)
"""


def test_a_kill_at_any_moment_leaves_one_whole_state(tmp_path: Path) -> None:
    path = tmp_path / "state.json"
    for saves in (1, 3, 8, 20):
        writer = subprocess.Popen(
            [sys.executable, "-c", _WRITER, str(path)], stdout=subprocess.PIPE, cwd=Path(__file__).parents[2]
        )
        with writer:
            assert writer.stdout is not None
            for _ in range(saves):
                done = int(writer.stdout.readline())
            writer.kill()
        memory = StateFile(path, "oat-pmc").load().memory
        assert memory is not None
        (data,) = set(memory.saved.values())
        assert int.from_bytes(data, "little") >= done


def test_what_is_saved(tmp_path: Path) -> None:
    rig = BladeRig(state_dir=tmp_path)
    rig.save()
    saved = json.loads((tmp_path / PMC_FILE).read_text())["saved"]
    assert "6065:00" in saved
    for live in ("6510:03", "6510:08", "6410:09", "6510:00", "6040:00", "6081:00", "5083:00"):
        assert live not in saved
    assert PMC == 11
