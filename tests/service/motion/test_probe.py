"""The touch probe: captures told apart from what stood there, and seen at a twin whose input X4.7 is switched."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

import pytest

from app.service.connection import Connection
from app.service.motion.probe import FALLING, INPUTS, LEVEL, RISING, Edge, Probe, ProbeLine, Probes
from tests.service.conftest import Served
from tests.service.motion.rig import AXIS


@dataclass
class Looks:
    """A probe that is looked at: level, rising, falling, as the reader does."""

    probe: Probe
    t_ns: int = 0

    def look(self, level: bool, rising: int, falling: int) -> None:
        """One round."""
        self.t_ns += 50
        for address, raw in ((INPUTS, LEVEL if level else 0), (RISING, rising), (FALLING, falling)):
            self.probe.take(self.t_ns, address, raw)


def test_what_stood_there_is_no_capture() -> None:
    looks = Looks(Probe())
    looks.probe.arm(0)
    looks.look(False, 4500, 4510)
    assert looks.probe.first is None
    assert looks.probe.captured[Edge.RISING].t_ns is None
    assert not looks.probe.is_new(looks.probe.captured[Edge.RISING])


def test_the_first_capture_after_arming_is_marked_and_stays() -> None:
    looks = Looks(Probe())
    looks.look(False, 0, 0)
    looks.look(True, 4500, 0)
    before = looks.probe.first
    assert before is None, "it was not armed"
    looks.probe.arm(looks.t_ns + 1)
    looks.look(False, 4500, 4510)
    looks.look(True, 4620, 4510)
    first = looks.probe.first
    assert first is not None
    assert (first.edge, first.raw) == (Edge.FALLING, 4510)
    assert looks.probe.is_new(looks.probe.captured[Edge.RISING])


def test_the_same_position_captured_again_is_a_capture() -> None:
    looks = Looks(Probe())
    looks.look(False, 4500, 4510)
    looks.probe.arm(looks.t_ns + 1)
    looks.look(True, 4500, 4510)
    assert looks.probe.first is not None
    assert looks.probe.first.raw == 4500


def test_an_edge_between_two_looks_is_one_capture() -> None:
    looks = Looks(Probe())
    looks.look(False, 0, 0)
    looks.look(False, 4500, 0)  # it rose after the level was looked at
    seen_ns = looks.probe.captured[Edge.RISING].t_ns
    looks.look(True, 4500, 0)
    assert looks.probe.captured[Edge.RISING].t_ns == seen_ns
    looks.look(False, 4500, 4500)
    looks.look(True, 4500, 4500)
    assert looks.probe.captured[Edge.RISING].t_ns == looks.t_ns


def test_a_pulse_that_is_over_before_the_next_look_is_seen_by_its_values() -> None:
    looks = Looks(Probe())
    looks.look(False, 0, 0)
    looks.probe.arm(0)
    looks.look(False, 4500, 4505)
    assert looks.probe.captured[Edge.RISING].raw == 4500
    assert looks.probe.captured[Edge.FALLING].raw == 4505
    assert looks.probe.first is not None


async def until(probes: Probes, ready: str) -> ProbeLine:
    """Look until a part of the line is there."""
    async with asyncio.timeout(10.0):
        while True:
            line = await probes.look(AXIS)
            if getattr(line, ready):
                return line
            await asyncio.sleep(0.02)


@pytest.mark.alone
async def test_both_edges_are_seen_at_the_twin(connection: Connection, served: Served) -> None:
    inputs = served.turbine.blades[0].pmc.inputs
    probes = Probes(connection)
    try:
        async with asyncio.timeout(10.0):
            while (await probes.look(AXIS)).level is None:  # noqa: ASYNC110  the device has no event for it
                await asyncio.sleep(0.02)
        armed = await probes.arm(AXIS)
        assert armed.armed_ns is not None
        assert armed.first is None
        served.thread.call_soon(lambda: setattr(inputs, "probe", True))
        line = await until(probes, "rising_new")
        assert line.first == "rising"
        assert line.level is True
        assert line.rising_deg == pytest.approx(80.0, abs=0.05)
        assert line.rising_ns is not None
        assert line.rising_ns >= armed.armed_ns
        served.thread.call_soon(lambda: setattr(inputs, "probe", False))
        line = await until(probes, "falling_new")
        assert line.falling_deg == pytest.approx(80.0, abs=0.05)
        assert line.first == "rising"
        rearmed = await probes.arm(AXIS)
        assert (rearmed.first, rearmed.rising_new, rearmed.falling_new) == (None, False, False)
    finally:
        await probes.close()
