"""The trace of the buses that are shown: pages of frames; tables of nodes, identifiers, transfers, emergencies, load.

Reads only, for any session. The running trace comes by the socket's topic ``trace``.
"""

from __future__ import annotations

import asyncio
from typing import Annotated, Literal

from fastapi import APIRouter, Query

from app.errors import UsageError
from app.service.trace import tables
from app.service.trace.pages import Side, TracePage, TracePages
from app.service.trace.tables import BusIdentifier, BusLoadLine, BusNode, EmcyLine, SdoLine, Transfers
from app.web.deps import StageOf, reads_both
from app.web.models.trace import TraceFilter, Words, exact_ns

router = APIRouter()
MAX_ROWS = 1000

Limit = Annotated[int, Query(ge=1, le=MAX_ROWS)]
Moment = Annotated[int | None, Query(ge=0, le=2**62, description="A time stamp in ns; exactly one of the three")]
Texts = Annotated[str, Query(max_length=200)]


async def frames(
    stage: StageOf,
    before: Moment = None,
    after: Moment = None,
    around: Moment = None,
    limit: Limit = 200,
    nodes: Annotated[str, Query(max_length=500, description="Node numbers, separated by commas")] = "",
    services: Annotated[str, Query(max_length=300, description="Services, separated by commas")] = "",
    buses: Texts = "",
    direction: Literal["rx", "tx"] | None = None,
    ids: Texts = "",
    data: Texts = "",
    q: Texts = "",
    errors: bool = False,
    from_t_ns: Moment = None,
    to_t_ns: Moment = None,
) -> TracePage:
    """Decoded frames before, after or around a moment: from memory, and what is older from the running recording."""
    asked = [(side, t_ns) for side, t_ns in zip(Side, (before, after, around), strict=True) if t_ns is not None]
    if len(asked) != 1:
        raise UsageError(reason="exactly one of before, after and around is needed")
    wanted = TraceFilter(
        nodes=_numbers(nodes),
        services=_names(services),
        buses=_names(buses),
        direction=direction,
        ids=ids,
        data=data,
        q=q,
        errors=errors,
        from_t_ns=from_t_ns,
        to_t_ns=to_t_ns,
    )
    pages = TracePages(stage, wanted.query())
    side, t_ns = asked[0]
    return await asyncio.to_thread(pages.page, side, exact_ns(t_ns), limit)


def _names(text: str) -> list[Words]:
    return [part.strip() for part in text.split(",") if part.strip()]


def _numbers(text: str) -> list[int]:
    names = _names(text)
    if not all(name.isascii() and name.isdecimal() and len(name) <= 3 for name in names):
        raise UsageError(reason=f"'{text}' is no list of node numbers")
    return [int(name) for name in names]


async def bus_nodes(stage: StageOf) -> list[BusNode]:
    """All nodes that were seen on the buses, and those that the site names."""
    return tables.nodes(stage)


async def bus_identifiers(stage: StageOf) -> list[BusIdentifier]:
    """All CAN identifiers that were seen: latest data, count, rate, period, share of the load."""
    return tables.identifiers(stage)


async def bus_transfers(
    stage: StageOf,
    which: Transfers = "writes",
    node: Annotated[int | None, Query(ge=1, le=127)] = None,
    limit: Limit = 500,
) -> list[SdoLine]:
    """SDO transfers, newest first: all, only writes and what did not succeed, or only what did not succeed."""
    return tables.transfers(stage, which, node, limit)


async def bus_emergencies(stage: StageOf, limit: Limit = 500) -> list[EmcyLine]:
    """Emergency messages, newest first."""
    return tables.emergencies(stage, limit)


async def bus_load(stage: StageOf) -> list[BusLoadLine]:
    """Load of each bus now and second by second, with the share of each node."""
    return tables.load(stage)


reads_both(router, "frames", frames)
reads_both(router, "bus/nodes", bus_nodes)
reads_both(router, "bus/identifiers", bus_identifiers)
reads_both(router, "bus/transfers", bus_transfers)
reads_both(router, "bus/emergencies", bus_emergencies)
reads_both(router, "bus/load", bus_load)
