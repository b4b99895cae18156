"""TWIN is shown only where every device says that it is one, and stays shown while a twin restarts."""

from __future__ import annotations

import pytest

from app.drivers.contract import LinkState
from app.service.connection import Connection
from app.service.journal import Kind
from app.service.link import DEVICE_NAME, TwinWatch
from app.wire.nmt import NmtState
from tests.e2e.test_interoperation import until
from tests.service.conftest import Served
from tests.web.rig import BUS, Feeder, make_connection

TWIN = b"HUBSIDE TWIN PMC"


@pytest.fixture
def bench() -> Connection:
    return make_connection()


@pytest.fixture
def feeder(bench: Connection) -> Feeder:
    return Feeder(bench)


@pytest.fixture
def watch(bench: Connection) -> TwinWatch:
    return TwinWatch(bench.targets, bench.buses)


def nodes(bench: Connection) -> list[int]:
    return [target.node for target in bench.targets]


def test_every_device_must_say_so(bench: Connection, feeder: Feeder, watch: TwinWatch) -> None:
    for node in nodes(bench):
        assert not watch.all_twins()
        feeder.read(node, DEVICE_NAME, TWIN)
    assert watch.all_twins()
    feeder.read(nodes(bench)[0], DEVICE_NAME, b"PMC")
    assert not watch.all_twins()


def test_a_restart_makes_no_twin_a_device(bench: Connection, feeder: Feeder, watch: TwinWatch) -> None:
    for node in nodes(bench):
        feeder.read(node, DEVICE_NAME, TWIN)
    assert watch.all_twins()
    feeder.heartbeat(11, NmtState.BOOT_UP)
    assert watch.all_twins()
    feeder.read(11, DEVICE_NAME, b"PMC")
    assert not watch.all_twins()
    feeder.heartbeat(11, NmtState.BOOT_UP)
    assert not watch.all_twins(), "what it said last is held, whatever that was"
    feeder.read(11, DEVICE_NAME, TWIN)
    assert watch.all_twins()


def test_restarts_make_no_device_a_twin(bench: Connection, feeder: Feeder, watch: TwinWatch) -> None:
    *others, last = nodes(bench)
    for node in others:
        feeder.read(node, DEVICE_NAME, TWIN)
    for _ in range(3):
        feeder.heartbeat(last, NmtState.BOOT_UP)
        assert not watch.all_twins()


def test_a_gap_may_hide_that_another_device_stands_there(bench: Connection, feeder: Feeder, watch: TwinWatch) -> None:
    for node in nodes(bench):
        feeder.read(node, DEVICE_NAME, TWIN)
    assert watch.all_twins()
    bench.buses[BUS].gap(bench.stamper())
    assert not watch.all_twins()
    feeder.heartbeat(11, NmtState.BOOT_UP)
    assert not watch.all_twins(), "what it said before the gap is not held"
    for node in nodes(bench):
        feeder.read(node, DEVICE_NAME, TWIN)
    assert watch.all_twins()


async def test_what_was_said_before_the_link_was_lost_counts_no_more(connection: Connection, served: Served) -> None:
    """Another bus may be connected since, and nothing of it was read yet."""
    watch = TwinWatch(connection.targets, connection.buses)
    link = connection.buses["can0"]
    targets = list(connection.targets)
    for target in targets:
        assert not watch.all_twins()
        await link.driver.read(target.node, DEVICE_NAME)
    assert watch.all_twins()
    served.cut()
    await until(lambda: link.status.reconnects == 1 and link.status.state is LinkState.CONNECTED)
    await until(lambda: connection.journal.latest()[-1].kind is Kind.BUS_BACK)
    for target in targets:
        assert not watch.all_twins()
        await link.driver.read(target.node, DEVICE_NAME)
    assert watch.all_twins()
