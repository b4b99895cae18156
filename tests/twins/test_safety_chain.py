"""The safety chain through three blades: what opens it, the EFC of all blades, and how everything comes back."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from app.model.address import parse_address
from app.model.description_file import load_builtin
from app.twins.cia402 import State
from app.twins.line import CanLine
from app.twins.safety_chain import Contact
from app.twins.turbine import Settings, Turbine
from app.wire.nmt import NmtCommand
from tests.twins.harness import MS, SECOND, Master

PMMS, PMCS = (1, 2, 3), (11, 12, 13)
CHAIN_INPUTS = 0b1101
EFC_INPUT = 1 << 18
RELAY = WATCHDOG = 1 << 16
REMOTE = 1 << 9


class Rig:
    """A turbine on a line with a virtual clock, booted."""

    def __init__(self, angle_deg: float = 80.0) -> None:
        self.line = CanLine(500_000)
        self.master = Master(self.line)
        self.turbine = Turbine(
            self.line, load_builtin("oat-pmm"), load_builtin("oat-pmc"), Settings(angle_deg=angle_deg, boot_ns=10 * MS)
        )
        self.turbine.power_on(0)
        self.master.run(500 * MS)

    @property
    def angles_deg(self) -> list[float]:
        return [blade.axis.angle_deg for blade in self.turbine.blades]

    def get(self, node: int, where: str) -> int:
        signed = self.turbine.devices[node].store.at(parse_address(where)).entry.type.is_signed
        return self.master.number(node, where, signed=signed)

    def put(self, node: int, where: str, number: int) -> None:
        kind = self.turbine.devices[node].store.at(parse_address(where)).entry.type
        assert kind.size is not None
        self.master.put(node, where, number, kind.size, signed=kind.is_signed)

    def mains(self, present: bool) -> None:
        for blade in self.turbine.blades:
            blade.power.mains_present = present

    def closed(self) -> bool:
        """As the devices show it: all chain inputs of the PMMs and X2.3 of the PMCs."""
        pmms = [self.get(node, "30FD") & CHAIN_INPUTS == CHAIN_INPUTS for node in PMMS]
        pmcs = [bool(self.get(node, "60FD") & EFC_INPUT) for node in PMCS]
        assert len({*pmms, *pmcs}) == 1, (pmms, pmcs)
        return pmms[0]

    def open_contacts(self) -> tuple[tuple[Contact, int], ...]:
        return self.turbine.chain.open_contacts

    def wait_feather(self) -> None:
        self.master.until(lambda: all(angle > 89.5 for angle in self.angles_deg), 30 * SECOND)

    def wait(self, condition: Callable[[], bool], timeout_ns: int = 30 * SECOND) -> int:
        """How long it took, in ns."""
        began_ns = self.line.now_ns
        self.master.until(condition, timeout_ns)
        return self.line.now_ns - began_ns


@pytest.fixture
def rig() -> Rig:
    return Rig()


def stopped(rig: Rig) -> bool:
    return all(blade.axis.speed_rad_s == 0.0 for blade in rig.turbine.blades)


def test_a_turbine_starts_with_the_chain_closed_and_stays_where_it_is(rig: Rig) -> None:
    assert rig.closed()
    assert rig.open_contacts() == ()
    rig.master.run(20 * SECOND)
    assert rig.closed()
    assert rig.angles_deg == pytest.approx([80.0] * 3, abs=0.01)
    for node in PMMS:
        assert rig.get(node, "30FE:03") & RELAY
        assert rig.get(node, "30FD") >> 16 & CHAIN_INPUTS == 0
        assert (rig.get(node, "603F"), rig.get(node, "3000")) == (0, 1)
    for blade, node in zip(rig.turbine.blades, PMCS, strict=True):
        assert rig.get(node, "60FE:03") & WATCHDOG
        assert rig.get(node, "603F") == 0
        assert list(blade.pmc.machine.history) == [0, 1, 2]


def test_all_nodes_restarted_at_once_drive_nowhere(rig: Rig) -> None:
    rig.master.nmt(NmtCommand.RESET_NODE, 0)
    rig.master.run(3 * SECOND)
    assert rig.closed()
    assert rig.angles_deg == pytest.approx([80.0] * 3, abs=0.01)
    assert [list(blade.pmc.machine.history) for blade in rig.turbine.blades] == [[0, 1, 2]] * 3


@pytest.mark.rule("I1")
@pytest.mark.rule("L1")
@pytest.mark.rule("L2")
def test_an_open_contact_of_the_turbine_feathers_all_blades_after_50_ms(rig: Rig) -> None:
    rig.turbine.chain.closed = False
    began_ns = rig.line.now_ns
    rig.master.run(45 * MS)
    assert [blade.pmm.inputs.digital & CHAIN_INPUTS for blade in rig.turbine.blades] == [0, 0, 0]
    assert [blade.pmc.inputs.efc for blade in rig.turbine.blades] == [True] * 3
    rig.master.until(lambda: not any(blade.pmc.inputs.efc for blade in rig.turbine.blades), SECOND, MS)
    assert 50 * MS <= rig.line.now_ns - began_ns <= 61 * MS
    assert rig.open_contacts() == ((Contact.TURBINE, 0),)
    rig.wait_feather()
    assert not rig.closed()
    assert all(not rig.get(node, "6041") & REMOTE for node in PMCS)
    rig.wait(lambda: stopped(rig))
    rig.turbine.chain.closed = True
    rig.master.run(50 * MS)
    assert rig.closed()
    assert all(rig.get(node, "6041") & REMOTE for node in PMCS)
    for node in PMCS:
        rig.put(node, "6040", 0x0106)
        rig.put(node, "6040", 0x010F)
    rig.wait(lambda: all(rig.get(node, "6041") & 0x6F == 0x27 for node in PMCS))
    for node in PMCS:
        rig.put(node, "6081", 800)
        rig.put(node, "607A", 7000)
        rig.put(node, "6040", 0x000F)
        rig.put(node, "6040", 0x001F)
    rig.wait(lambda: all(angle < 71 for angle in rig.angles_deg))


@pytest.mark.rule("I1")
def test_a_gap_of_40_ms_feathers_nobody(rig: Rig) -> None:
    rig.turbine.chain.closed = False
    rig.master.run(40 * MS)
    rig.turbine.chain.closed = True
    rig.master.run(SECOND)
    assert all(rig.get(node, "30FD") >> 16 & CHAIN_INPUTS == CHAIN_INPUTS for node in PMMS)
    assert rig.angles_deg == pytest.approx([80.0] * 3, abs=0.01)
    assert [list(blade.pmc.machine.history) for blade in rig.turbine.blades] == [[0, 1, 2]] * 3


@pytest.mark.rule("I9")
def test_an_error_of_one_pmm_feathers_all_blades_until_it_is_reset(rig: Rig) -> None:
    rig.put(2, "3300:01", 0x4200)
    rig.turbine.blades[1].pmm.inputs.digital &= ~(1 << 9)
    rig.wait_feather()
    assert rig.open_contacts() == ((Contact.PMM, 2),)
    assert rig.get(2, "603F") == 0xFFF1
    assert [rig.get(node, "603F") for node in (1, 3)] == [0, 0]
    rig.turbine.blades[1].pmm.inputs.digital |= 1 << 9
    rig.wait(lambda: stopped(rig))
    assert not rig.closed()
    rig.put(2, "3040", 0x80)
    rig.master.run(50 * MS)
    assert rig.closed()


@pytest.mark.rule("B3")
def test_a_warning_opens_nothing(rig: Rig) -> None:
    rig.put(2, "3300:01", 0x0200)
    rig.turbine.blades[1].pmm.inputs.digital &= ~(1 << 9)
    rig.master.run(SECOND)
    assert rig.get(2, "603F") == 0xFFF1
    assert rig.closed()


@pytest.mark.rule("J8")
@pytest.mark.parametrize("reset", ["5040", "X2.4", "NMT"])
def test_an_error_of_one_pmc_feathers_all_blades_and_can_be_reset(rig: Rig, reset: str) -> None:
    """The controlword does not count while X2.3 is at 0; the other ways to reset are open, or it would never end."""
    pmc = rig.turbine.blades[2].pmc
    pmc.errors.event(0x8611)
    rig.wait_feather()
    assert rig.open_contacts() == ((Contact.PMC, 13),)
    assert not rig.get(13, "60FE:03") & WATCHDOG
    rig.wait(lambda: stopped(rig))
    for _ in range(40):  # it neither closes nor flutters
        rig.master.run(25 * MS)
        assert rig.open_contacts() == ((Contact.PMC, 13),)
    rig.put(13, "6040", 0x0000)
    rig.put(13, "6040", 0x0080)
    rig.master.run(100 * MS)
    assert rig.open_contacts() == ((Contact.PMC, 13),)
    if reset == "5040":
        rig.put(13, "5040", 0x80)
    elif reset == "X2.4":
        pmc.inputs.reset = True
    else:
        rig.master.nmt(NmtCommand.RESET_NODE, 13)
    rig.master.run(300 * MS)
    assert rig.open_contacts() == ()
    assert rig.closed()
    assert rig.get(13, "603F") == 0
    assert pmc.machine.state is not State.FAULT


def test_a_pmc_whose_motor_cannot_run_keeps_its_blade_while_the_others_feather(rig: Rig) -> None:
    rig.turbine.blades[0].pmc.errors.condition(0x2320, True)
    rig.wait(lambda: all(angle > 89.5 for angle in rig.angles_deg[1:]))
    rig.master.run(SECOND)
    assert rig.angles_deg[0] == pytest.approx(80.0, abs=0.05)
    assert rig.turbine.blades[0].pmc.machine.state is State.FAULT
    rig.turbine.blades[0].pmc.errors.condition(0x2320, False)
    rig.put(11, "5040", 0x80)
    rig.master.run(100 * MS)
    assert rig.closed()


@pytest.mark.rule("D2")
@pytest.mark.rule("D4")
def test_a_mains_gap_shorter_than_30e0h_does_nothing(rig: Rig) -> None:
    rig.mains(False)
    rig.master.run(2500 * MS)
    assert rig.closed()
    assert all(0 < rig.get(node, "30B2") < 600 for node in PMMS)
    rig.mains(True)
    rig.master.run(3 * SECOND)
    assert [rig.get(node, "30B2") for node in PMMS] == [3000] * 3
    assert rig.angles_deg == pytest.approx([80.0] * 3, abs=0.01)
    assert [list(blade.pmc.machine.history) for blade in rig.turbine.blades] == [[0, 1, 2]] * 3


@pytest.mark.rule("D2")
@pytest.mark.rule("D3")
@pytest.mark.rule("G1")
def test_mains_failure_hold_up_feather_on_battery_shut_down_and_return() -> None:
    rig = Rig(angle_deg=20.0)
    for node in PMMS:
        rig.put(node, "30E1", 25)
    rig.mains(False)
    began_ns = rig.line.now_ns
    rig.master.until(lambda: not rig.turbine.blades[0].pmc.inputs.efc, 10 * SECOND, MS)
    assert 3000 * MS <= rig.line.now_ns - began_ns <= 3090 * MS
    assert all(rig.get(node, "30B2") == 0 for node in PMMS)
    charges = [blade.power.charge for blade in rig.turbine.blades]
    rig.wait_feather()
    assert all(blade.power.charge < before for blade, before in zip(rig.turbine.blades, charges, strict=True))
    assert all(rig.get(node, "603F") == 0 for node in PMCS)
    assert all(rig.get(node, "3000") & 1 << 4 for node in PMMS)
    rig.master.until(lambda: not rig.turbine.blades[0].pmm.running, 40 * SECOND)
    assert 25 * SECOND <= rig.line.now_ns - began_ns <= 25_050 * MS
    rig.master.run(50 * MS)
    silent_ns = rig.line.now_ns
    for node in PMMS + PMCS:
        rig.master.send(0x600 + node, bytes.fromhex("4000100000000000"))
    rig.master.run(5 * SECOND)
    own = {0x600 + node for node in PMMS + PMCS}
    assert not [heard for heard in rig.master.heard if heard.t_ns > silent_ns and heard.can.can_id not in own]
    rig.mains(True)
    back_ns = rig.line.now_ns
    rig.master.run(2 * SECOND)
    boots = [h.can.can_id - 0x700 for h in rig.master.heard if h.t_ns > back_ns and h.can.data == b"\0"]
    assert sorted(boots) == [*PMMS, *PMCS]
    assert rig.closed()
    assert all(rig.get(node, "603F") == 0 for node in PMMS + PMCS)


@pytest.mark.rule("D3")
def test_mains_back_before_the_shut_down_leaves_the_units_on(rig: Rig) -> None:
    rig.mains(False)
    rig.wait_feather()
    rig.mains(True)
    rig.master.run(40 * SECOND)
    assert rig.closed()
    assert len([heard for heard in rig.master.heard if heard.can.data == b"\0"]) == 6
    assert all(rig.get(node, "603F") == 0 for node in PMMS + PMCS)


def test_one_blade_without_mains_feathers_all_three(rig: Rig) -> None:
    rig.turbine.blades[0].power.mains_present = False
    rig.master.run(2900 * MS)
    assert rig.closed()
    rig.wait_feather()
    assert rig.open_contacts() == ((Contact.PMM, 1),)


@pytest.mark.parametrize("node", [2, 12])
def test_a_unit_that_restarts_or_loses_its_supply_opens_the_chain(rig: Rig, node: int) -> None:
    rig.turbine.devices[node].cut_power()
    others = [0, 2] if node == 12 else [0, 1, 2]  # a dead PMC moves nothing
    rig.wait(lambda: all(rig.angles_deg[place] > 89.5 for place in others))
    rig.master.run(SECOND)
    assert node != 12 or rig.angles_deg[1] == pytest.approx(80.0, abs=0.05)
    assert node in {found for _contact, found in rig.open_contacts()}
    rig.turbine.devices[node].power_on(rig.line.now_ns)
    rig.master.run(SECOND)
    assert node != 12 or rig.get(2, "603F") == 0x3221  # missed for longer than a restart takes
    rig.put(2, "3040", 0x80)
    rig.put(12, "5040", 0x80)  # without a PMM nobody chops what the braking motor feeds back
    rig.master.run(100 * MS)
    assert rig.closed()


def test_switched_off_the_chain_rests(rig: Rig) -> None:
    rig.turbine.power_off()
    rig.turbine.chain.closed = False
    rig.master.run(SECOND)
    assert [blade.pmm.inputs.digital & CHAIN_INPUTS for blade in rig.turbine.blades] == [CHAIN_INPUTS] * 3
