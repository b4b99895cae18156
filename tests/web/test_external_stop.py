"""Who may answer for the external stop of a drive that does not stop by itself."""

from __future__ import annotations

from typing import Any

import httpx

from app.drivers.modbus_config import ModbusPeer
from app.model.description_file import load_builtin
from app.service.connection import Connection
from app.service.options import Options
from tests.service.modbus_rig import SERVO, bench
from tests.web.rig import Server, running
from tests.web.test_login import with_anna

NAMED = ', external_stop = "S1 at the cabinet"'


def connection(more: str) -> Connection:
    turbine = bench(ModbusPeer(1, "127.0.0.1", 1502), more)
    return Connection(turbine, {"nanotec-pd4e": load_builtin("nanotec-pd4e")}, Options("tester", None))


async def confirmed(client: httpx.AsyncClient, fence: int, stops: list[str]) -> httpx.Response:
    body: dict[str, Any] = {"fence": fence, "rotor_locked": True, "people_out": True, "external_stops": stops}
    return await client.post("/api/live/motion/confirm", json=body)


async def taken(client: httpx.AsyncClient, page: str) -> int:
    answer = await client.post("/api/live/motion/lease", json={"page": page})
    assert answer.status_code == 200, answer.text
    return int(answer.json()["fence"])


def answered(server: Server) -> set[str]:
    desk = server.bench.motion
    assert desk is not None
    return set(desk.confirmed.external_stops)


async def test_an_expert_answers_for_it_and_no_technician() -> None:
    async with running(connection(NAMED)) as server:
        fence = await taken(server.client, "technician")
        refused = await confirmed(server.client, fence, [SERVO])
        assert (refused.status_code, refused.json()["code"]) == (403, "role")
        assert (await confirmed(server.client, fence, [])).is_success
        await server.client.post("/api/live/motion/lease/give-back", json={"fence": fence})
        anna = await with_anna(server)
        fence = await taken(anna, "expert")
        assert (await confirmed(anna, fence, [SERVO])).is_success
        assert answered(server) == {SERVO}


async def test_nobody_answers_for_one_that_the_site_does_not_name() -> None:
    async with running(connection("")) as server:
        anna = await with_anna(server)
        fence = await taken(anna, "expert")
        refused = await confirmed(anna, fence, [SERVO])
        assert refused.status_code == 400
        assert "names no external_stop" in refused.text
        assert answered(server) == set()
