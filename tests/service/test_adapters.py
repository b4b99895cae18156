"""Adapters against a served line of twins and a serial adapter on a pty: heard, searched, scanned, never disturbed."""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import ExitStack, asynccontextmanager, closing
from pathlib import Path

import pytest

from app.drivers.can_config import CanConfig
from app.drivers.can_port import CanPort
from app.errors import BusOpenError, SettingsError, UsageError
from app.model.description_file import load_builtin
from app.service.adapters import (
    Heard,
    ScanResult,
    SearchResult,
    Verdict,
    configured,
    find_bitrate,
    in_use,
    listen_to,
    overview,
    scan_adapter,
)
from app.service.connection import Connection
from app.service.jobs import Job
from app.wire.frame import Can, Direction, Frame, Stamper
from tests.service.conftest import Served

NODES = (1, 2, 3, 11, 12, 13)


@pytest.fixture
def job() -> Job:
    return Job("1", "test", "")


def heard(job: Job) -> Heard:
    assert isinstance(job.result, Heard)
    return job.result


def at(served: Served, bitrate: int = 500_000) -> CanConfig:
    return configured(served.address, bitrate)


def not_called_for(job: Job) -> None:
    assert job.result is None


@asynccontextmanager
async def other_master(served: Served) -> AsyncIterator[None]:
    """Sends SYNC every 100 ms, as another master does."""
    port = CanPort(at(served), "other", Stamper(0, time.monotonic_ns))

    def send() -> None:
        port.send(Can(0x080, b""))
        port.call_later(0.1, send)

    await asyncio.to_thread(port.open, 3.0)
    try:
        send()
        yield
    finally:
        await asyncio.to_thread(port.close)


async def test_a_test_hears_the_twins_and_sends_nothing(served: Served, job: Job) -> None:
    await listen_to(job, at(served), False, None)
    result = heard(job)
    assert (result.verdict, result.errors, result.shared) == (Verdict.FITS, 0, False)
    assert result.nodes == NODES and result.masters == ()
    assert result.frames > 10 and 0 < result.load < 0.2
    assert job.done == job.total


async def test_an_adapter_in_use_is_answered_by_its_connection(connection: Connection, served: Served) -> None:
    link = in_use(connection, f"{served.address}@250000")
    assert link is connection.buses["can0"]
    job = Job("1", "test", "")
    clients_before = len(served.server._clients)
    sent: list[Frame] = []
    connection.driver(next(iter(connection.targets))).subscribe(
        lambda frames: sent.extend(f for f in frames if f.direction is Direction.TX)
    )
    await listen_to(job, at(served, 250_000), False, link)
    assert len(served.server._clients) == clients_before, "it was not opened again"
    assert heard(job).shared and heard(job).bitrate == 500_000 and heard(job).nodes == NODES
    assert sent == []
    with pytest.raises(SettingsError) as caught:
        await find_bitrate(Job("2", "search", ""), served.address, link)
    assert caught.value.details["reason_key"] == "settings.refused.in_use"


async def test_another_master_is_named(served: Served, job: Job) -> None:
    async with other_master(served):
        await listen_to(job, at(served), False, None)
    assert [one.sign.value for one in heard(job).masters] == ["sync"]


async def test_what_is_not_there_is_told(job: Job) -> None:
    with pytest.raises(BusOpenError) as caught:
        await listen_to(job, configured("socketcand:127.0.0.1:1", 500_000), False, None)
    assert caught.value.details["bus"].startswith("socketcand:127.0.0.1:1")
    not_called_for(job)


async def test_an_adapter_that_cannot_be_silent_needs_a_rate_that_is_known(job: Job) -> None:
    with pytest.raises(SettingsError) as caught:
        await listen_to(job, configured("ixxat:0", 500_000), False, None)
    assert caught.value.details["reason_key"] == "settings.refused.no_silent_mode"
    with pytest.raises(UsageError):
        configured("nothing", 500_000)


@pytest.mark.parametrize(
    ("text", "key"), [("socketcan:can0", "rate_is_set"), ("virtual:x", "rate_is_set"), ("ixxat:0", "no_silent_mode")]
)
async def test_a_search_that_would_disturb_or_say_nothing_is_refused(text: str, key: str, job: Job) -> None:
    with pytest.raises(SettingsError) as caught:
        await find_bitrate(job, text, None)
    assert caught.value.details["reason_key"] == f"settings.refused.{key}"
    not_called_for(job)


async def test_a_scan_finds_and_recognises_all_six(served: Served, connection: Connection) -> None:
    known = [load_builtin("oat-pmm"), load_builtin("oat-pmc")]
    for link in (None, in_use(connection, served.address)):
        job = Job("1", "scan", "")
        await scan_adapter(job, at(served), known, False, link)
        assert isinstance(job.result, ScanResult)
        assert [(one.node, one.description_id) for one in job.result.found] == [
            *((node, "oat-pmm") for node in (1, 2, 3)),
            *((node, "oat-pmc") for node in (11, 12, 13)),
        ]
        assert all(one.is_twin for one in job.result.found)


async def test_the_overview_joins_what_is_found_and_what_is_named(connection: Connection, served: Served) -> None:
    seen = await overview([connection.turbine], connection)
    (named,) = [one for one in seen.adapters if one.adapter.connection == served.address]
    assert (named.turbines, named.in_use, named.found) == (("wtg-07",), True, False)
    (named,) = [one for one in (await overview([connection.turbine], None)).adapters if one.turbines]
    assert not named.in_use


if sys.platform != "win32":
    from tests.drivers.slcan_adapter import SlcanOnBus

    @pytest.fixture
    def serial(tmp_path: Path) -> Iterator[tuple[str, SlcanOnBus]]:
        with ExitStack() as stack:
            adapter = stack.enter_context(closing(SlcanOnBus(tmp_path / "tty", 250_000)))
            yield f"slcan:{tmp_path / 'tty'}", adapter

    def only_listened(adapter: SlcanOnBus) -> bool:
        return {command for _, command in adapter.opened} == {b"L"} and not adapter.sent

    async def test_a_search_tells_each_rate_and_only_listens(serial: tuple[str, SlcanOnBus], job: Job) -> None:
        connection, adapter = serial
        await find_bitrate(job, connection, None)
        result = job.result
        assert isinstance(result, SearchResult)
        assert result.bitrate == 250_000 and result.trying is None
        assert [(one.bitrate, one.frames > 1) for one in result.tried] == [(500_000, False), (250_000, True)]
        assert (job.done, job.total) == (len(result.rates), 10)
        assert only_listened(adapter)

    async def test_a_test_at_a_wrong_rate_hears_nothing_and_only_listens(
        serial: tuple[str, SlcanOnBus], job: Job
    ) -> None:
        connection, adapter = serial
        await listen_to(job, configured(connection, 500_000), False, None)
        assert (heard(job).verdict, heard(job).frames, heard(job).silent) == (Verdict.SILENT, 0, True)
        again = Job("2", "test", "")
        await listen_to(again, configured(connection, 250_000), False, None)
        assert (heard(again).verdict, heard(again).nodes) == (Verdict.FITS, (11,))
        assert only_listened(adapter)
