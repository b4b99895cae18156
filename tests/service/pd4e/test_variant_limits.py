"""Limits of a variant hold for the device that shows to be it: in a write, in a batch, in a restore."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace

import pytest

from app.errors import LimitError
from app.model.address import parse_address
from app.model.description import VariantValues
from app.model.restore.plan import Treatment, Why
from app.model.restore.planner import make_plan
from app.model.restore.wanted import Wanted
from app.model.site import read_site
from app.service.connection import Connection
from app.service.jobs import Job, RowState
from app.service.options import Options
from app.service.restore.survey import survey, targets_of
from app.service.write import write_raw
from app.service.write_many import Change, OnFailure, Order, prepare, write_many
from tests.service.pd4e.conftest import PD4E, SERVO, STATION, served_twin, site_of

CURRENT = parse_address("2031")
MOST = {"pd4-e591": 2100, "pd4-eb59": 6000}
"""mA; what is between the two is too much for the first and not for the second."""
BETWEEN = 5000


@asynccontextmanager
async def connected(variant: str) -> AsyncIterator[Connection]:
    """A device of a variant; the description gives variants limits of their own."""
    entry = PD4E.entry(CURRENT)
    variants = {name: replace(entry.variants[name], maximum=most) for name, most in MOST.items()}
    variants["pd4-e601"] = VariantValues()
    entries = {**PD4E.entries, CURRENT: replace(entry, variants=variants)}
    with served_twin(variant) as served:
        (turbine,) = read_site(site_of(served.address), "bench.toml")
        described = {PD4E.id: replace(PD4E, entries=entries)}
        async with Connection(turbine, described, Options("tester", None)) as connection:
            yield connection


@pytest.mark.parametrize("variant", MOST)
async def test_a_write_keeps_the_limits_of_the_variant(variant: str) -> None:
    async with connected(variant) as connection:
        target = connection.target(SERVO)
        driver = connection.driver(target)
        with pytest.raises(LimitError) as refused:
            await write_raw(driver, target, CURRENT, MOST[variant] + 1, connection.journal)
        assert refused.value.details["maximum"] == str(MOST[variant])
        await write_raw(driver, target, CURRENT, MOST[variant], connection.journal)
        assert target.variant == variant
        order = Order([Change(driver, target, CURRENT, BETWEEN)], frozenset(), OnFailure.STOP)
        job = Job("1", "write", "", rows=prepare(order))
        await write_many(job, order, connection.journal, connection.stamper)
        refused_here = MOST[variant] < BETWEEN
        assert (job.rows[0].state is RowState.REFUSED) is refused_here
        assert isinstance(job.rows[0].error, LimitError) is refused_here


@pytest.mark.parametrize("variant", MOST)
async def test_a_restore_leaves_out_what_is_too_much_for_the_variant(variant: str) -> None:
    async with connected(variant) as connection:
        found = await survey(connection, targets_of(connection, STATION), "tester", "")
        plan = make_plan(found.station, {SERVO: Wanted({CURRENT: BETWEEN})}, states=found.states)
        (row,) = [one for one in plan.rows if one.place.address == CURRENT]
        assert (row.treatment, row.why) == (
            (Treatment.SKIP, Why.MISFIT) if MOST[variant] < BETWEEN else (Treatment.WRITE, None)
        )
