"""Scenarios on twins: they do what they say when they say it, and the same seed makes the same frames."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from app.errors import UsageError
from app.model.address import Address
from app.model.description_file import load_builtin
from app.twins.faults import Instructor
from app.twins.line import CanLine
from app.twins.rotor import Rotor
from app.twins.scenario import MasterDo, read_scenario
from app.twins.surroundings import Surroundings
from app.twins.turbine import Settings, Turbine
from app.wire.frame import Can
from tests.twins.harness import MS, SECOND
from tests.twins.turbine_rig import PMCS, PMMS, TurbineRig

HEAD = 'title = "t"\nduration_s = 20\n'
EVERYTHING = """
title = "Everything at once"
duration_s = 5
[start]
wind_mps = 12
operational = true
controller = true
[[parameters]]
device = "pmc"
address = "1017"
raw = 40
[[event]]
at_s = 1.0
fault = "frames_lost"
percent = 10
for_s = 2
[[event]]
at_s = 1.2
fault = "frames_reordered"
percent = 15
node = 12
[[event]]
at_s = 1.5
fault = "frames_delayed"
percent = 20
delay_ms = 2
spread_ms = 9
node = 11
[[event]]
at_s = 2.0
fault = "second_master"
node = 13
interval_ms = 70
[[event]]
at_s = 2.2
fault = "babbling_node"
load_percent = 35
for_s = 1
[[event]]
at_s = 2.4
fault = "power_cut"
node = 2
off_s = 0.7
[[event]]
at_s = 2.6
fault = "mains_failure"
for_s = 1
[[event]]
at_s = 2.8
fault = "gust"
duration_s = 3
[[event]]
at_s = 3.0
master = { do = "read", node = 11, address = "1008" }
[[event]]
at_s = 3.0
master = { do = "write", node = 11, address = "60FB:01", raw = 9 }
[[event]]
at_s = 3.6
controller = { angle_deg = 40.0 }
[[event]]
at_s = 4.6
clear = true
"""


def steps_of_all(line: CanLine, end_ns: int) -> None:
    line.run_until(end_ns)


def small_steps(seed: int) -> Callable[[CanLine, int], None]:
    """Drives a line in steps of random lengths, some of them of no length."""

    def drive(line: CanLine, end_ns: int) -> None:
        random = Random(seed)
        while line.now_ns < end_ns:
            line.run_until(min(end_ns, line.now_ns + random.choice((0, 1, 997, 100_000, 3 * MS, 77 * MS))))

    return drive


def frames(seed: int, drive: Callable[[CanLine, int], None], text: str = EVERYTHING) -> list[tuple[int, int, Can]]:
    """All frames of a scenario on a fresh turbine, with their times."""
    line = CanLine(500_000)
    heard: list[tuple[int, int, Can]] = []
    line.tap(lambda start_ns, end_ns, can: heard.append((start_ns, end_ns, can)))
    turbine = Turbine(line, load_builtin("oat-pmm"), load_builtin("oat-pmc"), Settings(boot_ns=10 * MS))
    turbine.power_on(0)
    surroundings = Surroundings(line, Rotor(seed=seed), [blade.axis for blade in turbine.blades])
    surroundings.start(0)
    scenario = read_scenario(f"seed = {seed}\n{text}", "s.toml")
    Instructor(turbine, line, surroundings).play(scenario)
    drive(line, scenario.duration_ns)
    return heard


def digest(heard: list[tuple[int, int, Can]]) -> str:
    """Of all bytes and times."""
    return hashlib.sha256(repr(heard).encode()).hexdigest()


def test_the_same_seed_makes_the_same_frames_however_the_line_is_driven() -> None:
    seen = []
    for seed in (0, 1, 20261122):
        once = frames(seed, steps_of_all)
        assert len(once) > 1500
        assert frames(seed, small_steps(seed)) == once
        seen.append(digest(once))
    assert len(set(seen)) == len(seen), "another seed makes other frames"


def test_the_frames_do_not_depend_on_the_process() -> None:
    """Not on the seed of hashes, for instance."""
    program = "import tests.twins.test_scenario_player as own; print(own.digest(own.frames(3, own.steps_of_all)))"
    told = {
        subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "PYTHONHASHSEED": hashes},
            cwd=Path(__file__).parents[2],
            check=True,
            capture_output=True,
            text=True,
        ).stdout.strip()
        for hashes in ("1", "2")
    }
    assert told == {digest(frames(3, steps_of_all))}


def play(rig: TurbineRig, text: str) -> None:
    rig.instructor.play(read_scenario(HEAD + text, "s.toml"))


def test_events_come_at_their_times() -> None:
    rig = TurbineRig()
    play(rig, "[[event]]\nat_s = 1\nfault = 'node_gone'\nnode = 12\n[[event]]\nat_s = 3\nclear = 'node_gone'\n")
    since_ns = rig.line.now_ns
    rig.run(0.999)
    assert list(rig.instructor.active) == []
    rig.run(0.002)
    assert [fault.order.node for fault in rig.instructor.active] == [12]
    assert rig.instructor.active[0].since_ns == since_ns + SECOND
    rig.run(2)
    assert list(rig.instructor.active) == []


def test_a_clear_takes_out_only_what_it_names() -> None:
    rig = TurbineRig()
    faults = "".join(f"[[event]]\nat_s = 1\nfault = 'node_gone'\nnode = {node}\n" for node in (11, 12, 13))
    play(rig, faults + "[[event]]\nat_s = 2\nclear = 'node_gone'\nnode = 12\n")
    rig.run(2.5)
    assert [fault.order.node for fault in rig.instructor.active] == [11, 13]


def test_at_its_end_all_is_over() -> None:
    rig = TurbineRig()
    play(rig, "[start]\ncontroller = true\n[[event]]\nat_s = 19\nfault = 'mains_failure'\n")
    rig.run(19.5)
    assert rig.instructor.playing is not None
    assert len(rig.instructor.active) == 1
    since_ns = rig.line.now_ns + SECOND
    rig.run(2)
    assert [rig.instructor.playing, *rig.instructor.active] == [None]
    assert rig.heard_since(since_ns, 0x080) == 0, "the controller sends no SYNC any more"
    assert rig.turbine.chain.closed


def test_a_stopped_scenario_does_nothing_more() -> None:
    rig = TurbineRig()
    play(rig, "[[event]]\nat_s = 1\nfault = 'node_gone'\nnode = 12\n[[event]]\nat_s = 2\nfault = 'mains_failure'\n")
    rig.run(1.5)
    rig.instructor.stop()
    assert rig.instructor.active == ()
    rig.run(2)
    assert rig.instructor.active == ()


def test_another_scenario_takes_its_place() -> None:
    rig = TurbineRig()
    play(rig, "[[event]]\nat_s = 1\nfault = 'mains_failure'\n")
    rig.run(0.5)
    play(rig, "[[event]]\nat_s = 1\nfault = 'node_gone'\nnode = 12\n")
    rig.run(1.5)
    assert [fault.order.kind for fault in rig.instructor.active] == ["node_gone"]


def test_what_was_changed_before_stands_in_ram_or_in_the_memory_too() -> None:
    rig = TurbineRig()
    play(
        rig,
        "[[parameters]]\ndevice = 'pmc'\nblade = 2\naddress = '60FB:01'\nraw = 3\n"
        "[[parameters]]\ndevice = 'pmc'\naddress = '6066'\nraw = 44\nsave = true\n",
    )
    assert [rig.number(node, "60FB:01") for node in PMCS] == [17, 3, 17]
    assert [rig.number(node, "6066") for node in PMCS] == [44, 44, 44]
    rig.fault("power_cut", node=12, off_s=0.1)
    rig.run(1)
    assert (rig.number(12, "60FB:01"), rig.number(12, "6066")) == (17, 44)


def test_all_nodes_are_started_as_soon_as_they_have_booted() -> None:
    rig = TurbineRig()
    rig.fault("power_cut", node=13, off_s=2)
    play(rig, "[start]\noperational = true\n")  # which ends the fault
    rig.run(1)
    for node in (*PMMS, *PMCS):
        rig.master.put(node, "1017", 100, 2)
        assert rig.master.wait_id(0x700 + node).can.data == b"\x05"


def test_a_service_master_does_what_it_is_told() -> None:
    rig = TurbineRig()
    orders = (
        "{ do = 'read', node = 12, address = '1008' }",
        "{ do = 'write', node = 12, address = '6066', raw = 55 }",
        "{ do = 'write', node = 12, address = '6064', raw = 1 }",
        "{ do = 'save', node = 12 }",
        "{ do = 'restart', node = 12 }",
        "{ do = 'nmt', node = 0, command = 'start' }",
    )
    play(rig, "".join(f"[[event]]\nat_s = {place + 1}\nmaster = {order}\n" for place, order in enumerate(orders)))
    player = rig.instructor.playing
    assert player is not None
    since_ns = rig.line.now_ns
    rig.run(5.5)
    assert rig.master.all_of(0x700 + 12, since_ns)[-1].can.data == b"\0", "restarted"
    assert rig.number(12, "6066") == 55, "saved"
    answers = {(done.order.do, done.order.address): done.answer for done in player.master.done}
    assert answers[MasterDo.READ, Address(0x1008)].data.startswith(b"HUBSIDE TWIN")
    assert answers[MasterDo.WRITE, Address(0x6066)].abort is None
    assert answers[MasterDo.WRITE, Address(0x6064)].abort is not None
    assert answers[MasterDo.SAVE, None].abort is None
    rig.run(1)
    rig.master.put(1, "1017", 100, 2)
    assert rig.master.wait_id(0x701).can.data == b"\x05"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[[parameters]]\ndevice = 'pmc'\naddress = '2FFF'\nraw = 1\n", "2FFF"),
        ("[[parameters]]\ndevice = 'pmc'\naddress = '6066'\nraw = 70000\n", "70000"),
        ("[[parameters]]\ndevice = 'pmc'\naddress = '1008'\nraw = 7\n", "1008"),
        ("[[parameters]]\ndevice = 'pmc'\naddress = '6064'\nraw = 7\n", "refused"),
        ("[[event]]\nat_s = 1\nfault = 'node_gone'\nnode = 9\n", "node 9"),
        ("[[event]]\nat_s = 1\nmaster = { do = 'save', node = 9 }\n", "node 9"),
        ("[[event]]\nat_s = 1\nmaster = { do = 'write', node = 11, address = '6066', raw = 70000 }\n", "70000"),
        ("[start]\ncontroller = true\n[[event]]\nat_s = 1\ncontroller = { jump = 3 }\n", "jump"),
        ("[start]\ncontroller = true\n[[event]]\nat_s = 1\ncontroller = { angle_deg = 300 }\n", "angle_deg"),
    ],
)
def test_what_cannot_be_played_here_is_told_and_nothing_happens(text: str, told: str) -> None:
    rig = TurbineRig()
    nodes = rig.line.nodes
    with pytest.raises(UsageError) as caught:
        play(rig, text)
    assert told in caught.value.details["reason"]
    assert rig.line.nodes == nodes
    assert rig.instructor.playing is None


def test_without_wind_there_is_no_gust_and_no_controller() -> None:
    rig = TurbineRig()
    alone = Instructor(rig.turbine, rig.line)
    for text in ("[start]\nwind_mps = 3\n", "[start]\ncontroller = true\n", "[[event]]\nat_s = 1\nfault = 'gust'\n"):
        with pytest.raises(UsageError):
            alone.play(read_scenario(HEAD + text, "s.toml"))
