"""The 3D view of a replay over a real 3D server: what was recorded at the cursor, apart from the bench's own view."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest

from app.scene.blade import PITCH_AXIS
from app.scene.hub import HubScene
from app.scene.solids import quaternion
from tests.scene.viewer import CAMERA, PROTOCOL, Viewer
from tests.web.rig import DEADLINE_S, Page, Server, denied, make_connection, running

NAME = "3-following-error"
VIEW = f"/viser/replay/{NAME}"
PITCH = "/rotor/blade-2/pitch"
BEFORE_S, TRIPPED_S = 5, 40
S = 1_000_000_000


@pytest.fixture(scope="module")
def scene() -> Iterator[HubScene]:
    started = HubScene("a secret of this test")
    yield started
    started.close()


@pytest.fixture
async def server(scene: HubScene, tmp_path: Path) -> AsyncIterator[Server]:
    async with running(make_connection(), scene=scene, data=tmp_path) as started:
        yield started


async def seek(server: Server, doc: dict[str, Any], at_s: int) -> None:
    order = {"action": "seek", "t_ns": doc["from_ns"] + at_s * S}
    assert (await server.client.post(f"/api/replay/{NAME}/cursor", json=order)).status_code == 200


async def pitched(viewer: Viewer, angle_deg: float) -> None:
    """Until the view was told this angle of blade 2 last."""
    wanted = pytest.approx(tuple(quaternion(PITCH_AXIS, angle_deg)), abs=1e-4)
    async with asyncio.timeout(DEADLINE_S):
        while viewer.turns.get(PITCH) != wanted:  # noqa: ASYNC110  what is waited for has no event
            await asyncio.sleep(0.01)


async def test_it_shows_the_blades_as_they_were_at_the_cursor_and_goes_with_the_replay(server: Server) -> None:
    assert (await server.client.get(f"{VIEW}/")).status_code == 404
    assert await denied(server.socket(VIEW, subprotocols=[PROTOCOL])) == 403
    doc = (await server.client.post("/api/replay", json={"recording": f"{NAME}.mcap"})).json()
    await seek(server, doc, BEFORE_S)
    page = await server.client.get(f"{VIEW}/?hideViserLogo")
    assert page.status_code == 200
    assert "frame-ancestors 'self'" in page.headers["content-security-policy"]
    answer = await server.client.get(VIEW)
    assert (answer.status_code, answer.headers["location"]) == (307, f"{VIEW}/")
    angles: list[float] = []
    async with server.socket(VIEW, subprotocols=[PROTOCOL]) as socket:
        viewer = Viewer(socket)
        hearing = asyncio.create_task(viewer.hear())
        await socket.send(msgspec.msgpack.encode(CAMERA))
        for at_s in (BEFORE_S, TRIPPED_S):
            await seek(server, doc, at_s)
            angle = await recorded(server)
            await pitched(viewer, angle)
            angles.append(angle)
        assert angles[1] > angles[0] + 45.0
        assert (await server.client.delete(f"/api/replay/{NAME}")).status_code == 200
        async with asyncio.timeout(DEADLINE_S):
            await asyncio.gather(hearing, return_exceptions=True)
    assert (await server.client.get(f"{VIEW}/")).status_code == 404


async def recorded(server: Server) -> float:
    """Position of blade 2 at the cursor in degrees, as the page is told."""
    async with server.socket() as connection:
        page = Page(connection)
        await page.say({"type": "subscribe", "ctx": f"replay/{NAME}", "topics": ["axes"]})
        axes = await page.until("axes")
        return float(next(line["position_deg"] for line in axes["data"] if line["blade"] == 2))
