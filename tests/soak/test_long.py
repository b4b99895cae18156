"""The long figures, run by ``make soak``: hours at work (``HUBSIDE_SOAK_S``, in seconds)."""

from __future__ import annotations

import asyncio
import os
import resource
import time
from pathlib import Path

import pytest

from app.model.description_file import load_builtin
from app.model.site import load_site
from app.recording.reader import open_recording
from app.service.backup import read_devices
from app.service.connection import Connection
from app.service.options import Options
from app.service.poll import Poller
from tests.e2e.conftest import Twins, twins

pytestmark = [pytest.mark.soak, pytest.mark.timeout(6 * 3600)]

__all__ = ["twins"]
SOAK_S = float(os.environ.get("HUBSIDE_SOAK_S", "3600"))
GROWTH_KIB = 100 * 1024


async def test_hours_at_work_lose_nothing_and_do_not_grow(twins: Twins, tmp_path: Path) -> None:
    """Polling and complete backups in turn: every frame is recorded, memory stays, no object fails."""
    (turbine,) = load_site(twins.site)
    descriptions = {name: load_builtin(name) for name in ("oat-pmm", "oat-pmc")}
    async with Connection(turbine, descriptions, Options("soak", tmp_path / "rec", listen_s=1.0)) as connection:
        poller = Poller(connection)
        pairs = [(connection.driver(target), target) for target in connection.targets]
        await read_devices(pairs)
        start_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        end_s = time.monotonic() + SOAK_S
        rounds = 0
        while time.monotonic() < end_s:
            for report in await read_devices(pairs):
                assert {why.code for why in report.failed.values()} <= {"sdo_abort"}, "only the empty error history"
            rounds += 1
            await asyncio.sleep(2.0)
        await poller.close()
        grown_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - start_kib
        assert rounds > 0
        assert grown_kib < GROWTH_KIB, f"{grown_kib} KiB more than at the start"
        assert connection.recording is not None
        assert connection.recording.status().lost == 0
    frames = connection.buses["can0"].frames
    recorded = 0
    for path in sorted((tmp_path / "rec").glob("*.mcap")):
        with open_recording(path) as recording:
            recorded += sum(1 for _ in recording.frames())
    assert recorded == frames
