"""A restore that is cut at any step: the old values, the new ones, or incomplete with both ways out of it."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from app.drivers.contract import LinkState
from app.errors import NoAnswerError, ProtocolError
from app.model.address import Address, parse_address
from app.model.datatypes import Raw
from app.service.restore.transaction import End
from app.store.restore_rows import RestoreState
from app.twins.object_store import RefusedAccessError
from app.wire.sdo import Abort
from tests.service.pd4e.conftest import SERVO
from tests.service.pd4e.test_restore import CHANGES, MAPPING, Bench, bench
from tests.web.rig import wait_until

__all__ = ["bench"]

WANTED: dict[str, Raw] = {**CHANGES, **MAPPING}
PLACES = ("2031", "3602:02", "1010:04", "1010:06", "2800:01")
"""A value, an entry of an open mapping, saves of several categories, the restart."""


def pull_cable(bench: Bench) -> None:
    """All connections end; the device goes on."""
    bench.served.device.on_restart()


def cut_power(bench: Bench) -> None:
    """RAM is gone, and a save under way with it."""
    bench.served.device.restart()
    bench.served.device.on_restart()


@pytest.mark.parametrize("after", [False, True], ids=["before", "after"])
@pytest.mark.parametrize("cut", [pull_cable, cut_power])
@pytest.mark.parametrize("place", PLACES)
async def test_a_cut_leaves_a_state_that_is_told_and_a_way_out(
    bench: Bench, place: str, cut: Callable[[Bench], None], after: bool
) -> None:
    """``after``: the cut comes when the device has done what it was asked for, its answer still on its way."""
    before = bench.ram(WANTED)
    done = _arm(bench, place, cut, after)
    restore_id, end = await bench.run(WANTED, restart=True)
    assert done(), "nothing was cut"
    row = (await bench.desk.get(restore_id)).row
    if end is End.INCOMPLETE:
        assert row.state is RestoreState.INCOMPLETE and bench.desk.open
        await wait_until(lambda: bench.served.device.online)
        await _answers(bench)
        if after:
            await bench.desk.resume(bench.connection, restore_id, "Anna")
        else:
            await bench.desk.roll_back(bench.connection, restore_id, "Anna")
        end = await bench.desk.wait(restore_id)
    assert end in (End.NEW, End.OLD), (await bench.desk.get(restore_id)).outcome
    assert not bench.desk.open
    wanted = WANTED if end is End.NEW else before
    assert bench.ram(WANTED) == wanted
    bench.served.device.restart()
    assert bench.ram(WANTED) == wanted, "non-volatile memory holds the same"


async def _answers(bench: Bench) -> None:
    """Until the device answers again: it ends connections while it boots."""
    target, link = bench.connection.target(SERVO), bench.connection.buses["lan"]
    for _ in range(100):
        await wait_until(lambda: link.status.state is LinkState.CONNECTED)
        try:
            await link.driver.read(target.node, Address(0x1000))
        except (NoAnswerError, ProtocolError):
            continue
        return
    raise AssertionError("it does not answer")


def _arm(bench: Bench, place: str, cut: Callable[[Bench], None], after: bool) -> Callable[[], bool]:
    """Cut at the next write to the object; gives whether that has come."""
    cell = bench.served.device.store.at(parse_address(place))
    guard, effect = cell.guard, cell.effect
    struck: list[Raw] = []

    def strike(raw: Raw) -> None:
        cell.guard, cell.effect = guard, effect
        struck.append(raw)
        cut(bench)

    def refuse(raw: Raw) -> None:
        strike(raw)
        raise RefusedAccessError(Abort.DEVICE_STATE)

    def obey(raw: Raw) -> None:
        if effect is not None:
            effect(raw)
        strike(raw)

    if after:
        cell.effect = obey
    else:
        cell.guard = refuse
    return lambda: bool(struck)
