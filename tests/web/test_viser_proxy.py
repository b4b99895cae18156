"""The 3D view through the guard, against a real 3D server."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Iterator

import httpx
import numpy as np
import pytest
import websockets

from app.scene.hub import BladePose, BladeState, HubScene
from tests.scene.viewer import messages_of
from tests.web.rig import DEADLINE_S, Server, denied, running

PROTOCOL = websockets.Subprotocol("viser-v1.1.1")


@pytest.fixture(scope="module")
def scene() -> Iterator[HubScene]:
    started = HubScene("a secret of this test")
    yield started
    started.close()


@pytest.fixture
async def server(scene: HubScene) -> AsyncIterator[Server]:
    async with running(scene=scene) as started:
        yield started


async def test_the_client_is_served_bare_and_is_not_kept(server: Server) -> None:
    answer = await server.client.get("/viser/?hideViserLogo&darkMode")
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/html")
    assert answer.headers["cache-control"] == "no-store"
    assert ":not(:has(canvas))" in answer.text
    assert answer.text.index(":has(canvas)") < answer.text.index("</head>")
    policy = answer.headers["content-security-policy"]
    assert "frame-ancestors 'self'" in policy
    assert "wasm-unsafe-eval" in policy


async def test_the_path_without_a_slash_leads_to_it(server: Server) -> None:
    answer = await server.client.get("/viser?darkMode")
    assert (answer.status_code, answer.headers["location"]) == (307, "/viser/?darkMode")


def test_the_3d_server_does_not_advertise_itself(capfd: pytest.CaptureFixture[str]) -> None:
    HubScene("x").close()
    assert capfd.readouterr().out == ""


async def test_nothing_beyond_the_client_can_be_reached(server: Server) -> None:
    for path in ("/viser/nothing.js", "/viser/../api/session", "/viser/%2e%2e/%2e%2e/etc/passwd"):
        answer = await server.client.get(path)
        assert answer.status_code in (200, 404), path
        assert "root:" not in answer.text


@pytest.mark.parametrize("path", ["/viser", "/viser/", "/viser?x=1"])
async def test_the_socket_passes_the_subprotocol_on(server: Server, path: str) -> None:
    async with server.socket(path, subprotocols=[PROTOCOL]) as socket:
        assert socket.subprotocol == PROTOCOL
        first = await asyncio.wait_for(socket.recv(), DEADLINE_S)
        assert isinstance(first, bytes)


async def test_the_3d_server_answers_to_nobody_else(server: Server, scene: HubScene) -> None:
    async with httpx.AsyncClient(trust_env=False) as client:
        assert (await client.get(f"http://127.0.0.1:{scene.port}/")).status_code == 403
    direct = websockets.connect(f"ws://127.0.0.1:{scene.port}", subprotocols=[PROTOCOL], proxy=None)
    assert await denied(direct) == 403
    assert await denied(server.socket("/viser", subprotocols=[PROTOCOL], additional_headers={})) == 401


async def test_messages_of_any_size_pass(server: Server, scene: HubScene) -> None:
    """A mesh of 4 MiB comes as one message; the default limit of a client is 1 MiB."""
    size = 4 << 20
    vertices = np.random.default_rng(1).random((size // 12, 3), dtype=np.float32)
    handle = scene._server.scene.add_mesh_simple("/large", vertices, np.array([[0, 1, 2]], dtype=np.int32))
    try:
        async with server.socket("/viser", subprotocols=[PROTOCOL]) as socket, asyncio.timeout(DEADLINE_S):
            while len(await socket.recv()) < size:
                pass
    finally:
        handle.remove()


async def test_large_messages_pass_to_the_3d_server_too(server: Server) -> None:
    """2 MiB up is taken; what the 3D server does not understand ends the connection there, not here."""
    async with server.socket("/viser", subprotocols=[PROTOCOL]) as socket:
        await asyncio.wait_for(socket.recv(), DEADLINE_S)
        await socket.send(b"\xc4" + bytes(2 << 20))
        await asyncio.wait_for(socket.ping(), DEADLINE_S)


async def test_a_pose_reaches_the_view(server: Server, scene: HubScene) -> None:
    async with server.socket("/viser", subprotocols=[PROTOCOL]) as socket, asyncio.timeout(DEADLINE_S):
        await socket.recv()
        scene.show({2: BladePose(90.0, BladeState.ENABLED)})
        turn, colour = None, None
        while turn is None or colour is None:
            for message in messages_of(bytes(await socket.recv(decode=False))):
                if message.get("name") == "/rotor/blade-2/pitch" and message["type"] == "SetOrientationMessage":
                    turn = message["wxyz"]
                if message.get("name") == "/rotor/blade-2/pitch/blade" and "color" in message.get("updates", {}):
                    colour = tuple(message["updates"]["color"])
        assert turn == pytest.approx((0.5**0.5, 0.0, 0.0, -(0.5**0.5)))
        assert colour == BladeState.ENABLED.rgb


async def test_without_a_3d_view_its_paths_are_not_found() -> None:
    async with running() as server:
        answer = await server.client.get("/viser/")
        assert answer.status_code == 404
        assert json.loads(answer.text)["code"] == "not_found"


async def wait_for_status(server: Server, path: str, status: int) -> str:
    """Ask until the answer has this status; gives its code."""
    async with asyncio.timeout(DEADLINE_S):
        while True:
            answer = await server.client.get(path)
            if answer.status_code == status:
                return str(answer.json()["code"])


async def test_a_3d_server_that_is_gone_is_said() -> None:
    gone = HubScene("x")
    async with running(scene=gone) as server:
        gone.close()
        assert await wait_for_status(server, "/viser/", 502) == "scene_gone"
        assert await denied(server.socket("/viser", subprotocols=[PROTOCOL])) != 101
