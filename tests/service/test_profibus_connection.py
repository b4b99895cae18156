"""A device of PROFIBUS-DP is connected, read, written and recorded as one of a CAN bus is."""

from __future__ import annotations

import builtins
import sys
from pathlib import Path
from typing import Any

import pytest

from app.drivers.contract import LinkState
from app.errors import BusOpenError, ExtraMissingError, LimitError, UsageError
from app.model.description_file import load_builtin
from app.model.site import read_site
from app.model.slaves import SlaveSetup
from app.recording.reader import open_recording
from app.service.backup import read_device
from app.service.bus_driver import make_driver
from app.service.connection import Connection
from app.service.journal import Kind
from app.service.options import Options
from app.service.views import node_lines
from app.service.write import write_text
from app.wire.frame import Direction, Fdl
from app.wire.profibus.pzd import First, Order
from tests.drivers.profibus_rig import ACTUAL, NODE, RAMP_VELOCITY, STATUSWORD, wire
from tests.drivers.wire import stamper
from tests.e2e.test_interoperation import until
from tests.service.profibus_rig import BUS, CYLINDERS, bench, connected, site_text

pytestmark = [pytest.mark.alone, pytest.mark.timeout(120)]  # a serial line in its own time


async def test_what_is_read_is_seen_live_and_every_telegram_is_recorded(tmp_path: Path) -> None:
    with wire() as line:
        async with connected(line, tmp_path) as connection:
            target = connection.target(CYLINDERS)
            assert connection.buses[BUS].status.state is LinkState.CONNECTED
            assert connection.buses[BUS].bitrate == line.baud
            assert [entry.kind for entry in connection.journal.latest()].count(Kind.CONNECTED) == 1
            await connection.driver(target).read(target.node, ACTUAL)
            position = target.lookup(ACTUAL)
            assert position is not None
            (file,) = connection.recorded_files()
    with open_recording(file) as recording:
        frames = list(recording.frames())
        assert recording.info.bit_rates == {BUS: line.baud}
    assert {type(frame.payload) for frame in frames} == {Fdl}
    assert {frame.direction for frame in frames} == {Direction.RX, Direction.TX}


async def test_a_station_that_answers_is_heard() -> None:
    with wire() as line:
        async with connected(line) as connection:
            target = connection.target(CYLINDERS)
            begun_ns = connection.stamper()
            await connection.driver(target).read(target.node, RAMP_VELOCITY)
            (shown,) = node_lines(connection.targets, connection.live)
            assert not shown.managed and not shown.silent, "there are no heartbeats on this bus"
            assert shown.answered_t_ns is not None and shown.answered_t_ns > begun_ns


async def test_a_write_is_checked_done_and_noted() -> None:
    with wire() as line:
        async with connected(line) as connection:
            target = connection.target(CYLINDERS)
            done = await write_text(connection.driver(target), target, RAMP_VELOCITY, "120 mm/s", connection.journal)
            assert (done.was, done.sent, done.read, done.verified) == (1000, 1200, 1200, True)
            assert line.device.channels[0].number(*RAMP_VELOCITY[:2]) == 1200
            assert Kind.WRITTEN in [entry.kind for entry in connection.journal.latest()]
            with pytest.raises(LimitError):
                await write_text(connection.driver(target), target, RAMP_VELOCITY, "99999", connection.journal)
            assert line.device.channels[0].number(*RAMP_VELOCITY[:2]) == 1200


async def test_a_device_is_read_as_a_whole() -> None:
    with wire() as line:
        async with connected(line) as connection:
            target = connection.target(CYLINDERS)
            report = await read_device(connection.driver(target), target)
            assert report.values[RAMP_VELOCITY] == line.device.channels[0].number(*RAMP_VELOCITY[:2])
            assert len(report.values) >= 55


async def test_a_slave_that_was_away_is_found_again() -> None:
    with wire() as line:
        async with connected(line) as connection:
            line.power_off()
            await until(lambda: connection.buses[BUS].status.state is LinkState.LOST)
            line.power_on()
            await until(lambda: connection.buses[BUS].status.state is LinkState.CONNECTED)
            target = connection.target(CYLINDERS)
            assert await connection.driver(target).read(NODE, STATUSWORD)


async def test_a_port_that_is_not_there_is_named() -> None:
    with wire() as line:
        text = site_text(line).replace(line.line.path, "/dev/none")
        (turbine,) = read_site(text, "bench.toml")
        connection = Connection(turbine, {"wandfluh-ed2": load_builtin("wandfluh-ed2")}, Options("tester", None))
        with pytest.raises(BusOpenError, match="/dev/none"):
            await connection.open()


def test_a_description_of_another_bus_is_refused() -> None:
    with wire() as line:
        (turbine,) = read_site(site_text(line).replace("wandfluh-ed2", "oat-pmc"), "bench.toml")
    with pytest.raises(UsageError, match="oat-pmc is no device of a bus with profibus-dp"):
        Connection(turbine, {"oat-pmc": load_builtin("oat-pmc")}, Options("tester", None))


def test_what_the_site_knows_of_a_slave_is_what_the_driver_gets(tmp_path: Path) -> None:
    more = ', telegram = 101, pzd_order = "high-low", gsd = "own.gsd", modules = ["a", "b"]'
    with wire() as line:
        turbine = bench(line, more)
        assert turbine.devices[0].slave == SlaveSetup(101, "high-low", "own.gsd", ("a", "b"))
        driver = make_driver(turbine.buses[0], turbine, (), stamper(), Options("tester", None, site=tmp_path))
    (station,) = driver._config.stations
    assert station == (NODE, 101, tmp_path / "own.gsd", ("a", "b"), Order(First.HIGH, First.LOW))


def test_without_the_extra_it_is_said_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    real: Any = builtins.__import__

    def without(name: str, *rest: Any, **more: Any) -> Any:
        if name.partition(".")[0] == "pyprofibus":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return real(name, *rest, **more)

    for name in [one for one in sys.modules if one.startswith(("pyprofibus", "app.drivers.profibus"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(builtins, "__import__", without)
    (turbine,) = read_site(
        'schema = 1\n[turbine.b.bus.dp0]\nconnection = "profibus:/dev/ttyUSB0"\n[turbine.b.station.s]\n', "bench.toml"
    )
    with pytest.raises(ExtraMissingError) as refused:
        Connection(turbine, {}, Options("tester", None))
    assert refused.value.details == {"package": "pyprofibus", "extra": "profibus"}
