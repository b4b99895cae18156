"""A device of Modbus TCP is connected, polled, stopped, recorded and replayed as one of a CAN bus is."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from pyModbusTCP.client import ModbusClient

from app.drivers.contract import LinkState
from app.errors import BusOpenError, UsageError
from app.model.address import Address
from app.model.description_file import load_builtin
from app.model.site import read_site
from app.recording.index import Course, build_index, course_at
from app.recording.reader import open_recording
from app.service.connection import Connection
from app.service.link import TwinWatch, link_line
from app.service.options import Options
from app.service.poll import Poller
from app.service.replay.source import Source
from app.service.replay.stage import ReplayStage
from app.service.stop import Command, command_all
from app.service.stop import Path as Way
from app.wire.frame import Adu, Direction
from app.wire.modbus.requests import ReadObject
from tests.drivers.modbus_rig import twin
from tests.e2e.test_interoperation import until
from tests.service.modbus_rig import BUS, SERVO, bench, connected, site_text

STATUSWORD, POSITION, CONTROLWORD = (Address(number) for number in (0x6041, 0x6064, 0x6040))


async def test_what_is_polled_is_seen_live_and_the_same_in_a_replay(tmp_path: Path) -> None:
    with twin() as peer:
        async with connected(peer, tmp_path) as connection:
            target = connection.target(SERVO)
            watch = TwinWatch(connection.targets, connection.buses)
            poller = Poller(connection)
            await until(lambda: watch.all_twins() and target.lookup(POSITION) is not None)
            await poller.close()
            line = link_line(connection.buses, connection.recorded, watch.all_twins(), connection.stamper())
            assert (line.state, line.mode, line.bus, line.bitrate) == ("connected", "twin", BUS, 0)
            load = connection.buses[BUS].bus_load(connection.stamper() + 50_000_000)  # of full slots of 50 ms
            assert 0 < load < 0.05, "of 100 Mbit/s"
            live = {address: view.reading for address, view in connection.live.values(BUS, peer.node).items()}
            (file,) = connection.recorded_files()
    with open_recording(file) as recording:
        frames = list(recording.frames())
    assert {type(frame.payload) for frame in frames} == {Adu}
    assert {frame.direction for frame in frames} == {Direction.RX, Direction.TX}
    source = Source(file, {})
    try:
        stage = ReplayStage(source, None, lambda: 0)
        stage.advance(source.to_ns, lambda: False)
        assert {at: view.reading for at, view in stage.live.values(BUS, peer.node).items()} == live
        assert stage.targets[0].lookup(STATUSWORD) == target.lookup(STATUSWORD)
        with build_index(file, source.descriptions) as index, open_recording(file) as recording:
            assert index.servers == {(BUS, peer.node): peer.server}
            course = course_at(index, recording, source.descriptions, source.to_ns)
            state = course.snapshot()
            again = Course((), source.descriptions)
            again.restore(state)
            assert again.snapshot() == state
            assert {at: view.reading for at, view in again.live.values(BUS, peer.node).items()} == live
    finally:
        source.close()


async def test_stop_is_written_and_confirmed_and_feather_is_none_of_its_commands() -> None:
    with twin() as peer:
        async with connected(peer) as connection:
            assert await command_all(connection.axes(), Command.FEATHER, connection.journal, connection.stamper) == []
            (done,) = await command_all(connection.axes(), Command.STOP, connection.journal, connection.stamper)
            assert (done.device, done.how, done.error) == (SERVO, Way.SDO, None)
            assert done.confirmed_t_ns is not None
        client = ModbusClient(host=peer.host, port=peer.port, unit_id=0, timeout=5)
        answer = await asyncio.to_thread(client.custom_request, ReadObject(CONTROLWORD, 2).pdu())
        assert answer is not None, client.last_error_as_txt
        assert bytes(answer).endswith(Command.STOP.value.to_bytes(2, "little"))
        client.close()


async def test_a_device_that_restarts_is_found_again(tmp_path: Path) -> None:
    with twin() as peer:
        async with connected(peer, tmp_path) as connection:
            target = connection.target(SERVO)
            await connection.driver(target).read(target.node, POSITION)
            assert target.lookup(POSITION) == 0
            await connection.driver(target).restart(target.node)
            view = connection.live.node(BUS, target.node)
            assert view is not None and view.boots == 1
            assert connection.buses[BUS].status.state is LinkState.CONNECTED


async def test_a_device_that_is_not_there_is_named(tmp_path: Path) -> None:
    with twin() as peer:
        gone = peer
    with pytest.raises(BusOpenError) as caught:
        async with connected(gone, tmp_path):
            pass
    assert str(gone.port) in str(caught.value)


def test_a_description_of_another_bus_is_refused() -> None:
    with twin() as peer:
        text = site_text(peer).replace("nanotec-pd4e", "oat-pmc")
    (turbine,) = read_site(text, "bench.toml")
    with pytest.raises(UsageError, match="oat-pmc is no device of a bus with modbus-tcp"):
        Connection(turbine, {"oat-pmc": load_builtin("oat-pmc")}, Options("tester", None))


def test_a_bus_without_a_device_can_be_named() -> None:
    with twin() as peer:
        turbine = bench(peer)
    head = site_text(peer).partition("[turbine.bench-pd4e.station")[0]
    (empty,) = read_site(head, "bench.toml")
    assert empty.buses == turbine.buses
    connection = Connection(empty, {}, Options("tester", None))
    assert connection.buses[BUS].status.state is LinkState.CLOSED
