"""The 3D views under ``/viser``: the client's page and its socket, passed on to a 3D server behind our guard.

``/viser/`` shows the bench, ``/viser/replay/<id>/`` a recording; each has a 3D server of its own.
The 3D server answers only to the secret that is added here. Its page is shown bare: nothing but the canvas.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Awaitable, Callable
from typing import Final
from urllib.parse import quote

import httpx
import websockets
from fastapi import APIRouter, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.requests import HTTPConnection
from fastapi.responses import RedirectResponse
from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Subprotocol

from app.scene.client import bare_page
from app.scene.hub import HubScene
from app.scene.server import SECRET_HEADER
from app.service.replay_scenes import ReplayScenes
from app.web.problem import NotFoundError, SceneGoneError

log = logging.getLogger(__name__)

TIMEOUT_S: Final = 10.0
_UPSTREAM: Final = "127.0.0.1"


Find = Callable[[HTTPConnection], Awaitable[HubScene]]
"""The 3D view that is asked for. Raises NotFoundError."""


def viser_router(scene: HubScene, replays: ReplayScenes) -> APIRouter:
    """The routes of the bench's 3D server and of those of replays."""

    async def live(_asked: HTTPConnection) -> HubScene:
        return scene

    async def replay(asked: HTTPConnection) -> HubScene:
        name = str(asked.path_params["replay_id"])
        found = await replays.scene(name)
        if found is None:
            raise NotFoundError(what=name)
        return found

    router = APIRouter(include_in_schema=False)
    # What is more particular comes first: the bench's path takes any file.
    _add(router, "/viser/replay/{replay_id}", _Proxy(replay))
    _add(router, "/viser", _Proxy(live))
    return router


def _add(router: APIRouter, path: str, proxy: _Proxy) -> None:
    router.add_api_route(path, proxy.with_slash, methods=["GET"])
    router.add_api_route(f"{path}/{{path:path}}", proxy.page, methods=["GET"])
    # The client drops the trailing slash of its own address; proxies and people add it.
    router.add_api_websocket_route(path, proxy.socket)
    router.add_api_websocket_route(f"{path}/", proxy.socket)


class _Proxy:
    def __init__(self, find: Find) -> None:
        self._find = find

    async def with_slash(self, request: Request) -> Response:
        query = f"?{request.url.query}" if request.url.query else ""
        return RedirectResponse(f"{quote(request.url.path)}/{query}", 307)

    async def page(self, request: Request, path: str) -> Response:
        """A file of the client. Raises NotFoundError or SceneGoneError."""
        scene = await self._find(request)
        url = f"http://{_UPSTREAM}:{scene.port}/{path}"
        headers = {SECRET_HEADER: scene.secret, "Accept-Encoding": "identity"}
        try:
            async with httpx.AsyncClient(trust_env=False, timeout=TIMEOUT_S) as client:
                answer = await client.get(url, headers=headers)
        except httpx.HTTPError as error:
            raise SceneGoneError(reason=type(error).__name__) from error
        if answer.status_code != 200:
            raise NotFoundError(what=request.url.path)
        media_type = answer.headers.get("content-type", "application/octet-stream")
        body = bare_page(answer.content) if media_type.startswith("text/html") else answer.content
        return Response(body, media_type=media_type, headers={"Cache-Control": "no-store"})

    async def socket(self, socket: WebSocket) -> None:
        """Pass frames on in both directions until either side closes. Frames may be of any size."""
        try:
            scene = await self._find(socket)
        except NotFoundError:
            await socket.close(1013, "the replay is not open")
            return
        offered = [Subprotocol(name) for name in socket.scope.get("subprotocols", [])]
        url = f"ws://{_UPSTREAM}:{scene.port}/"
        try:
            upstream = await connect(
                url,
                subprotocols=offered or None,
                additional_headers={SECRET_HEADER: scene.secret},
                max_size=None,
                compression=None,
                proxy=None,
                open_timeout=TIMEOUT_S,
            )
        except (OSError, TimeoutError, websockets.InvalidHandshake) as error:
            log.warning("the 3D server does not answer: %s", error)
            await socket.close(1013, "the 3D server does not answer")
            return
        async with upstream:
            await socket.accept(upstream.subprotocol)
            await _pass_on(socket, upstream)


async def _pass_on(socket: WebSocket, upstream: ClientConnection) -> None:
    tasks = [asyncio.create_task(_up(socket, upstream)), asyncio.create_task(_down(socket, upstream))]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    except WebSocketDisconnect:
        log.debug("a 3D view went away")
    except websockets.ConnectionClosed as closed:
        with contextlib.suppress(RuntimeError):  # both sides closed at once
            await socket.close(_code(closed), "")
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _up(socket: WebSocket, upstream: ClientConnection) -> None:
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            raise WebSocketDisconnect(message.get("code", 1005))
        data = message.get("bytes")
        await upstream.send(data if data is not None else message["text"])


async def _down(socket: WebSocket, upstream: ClientConnection) -> None:
    while True:
        data = await upstream.recv()
        if isinstance(data, bytes):
            await socket.send_bytes(data)
        else:
            await socket.send_text(data)


def _code(closed: websockets.ConnectionClosed) -> int:
    """The close code to pass on; the codes that never travel (no status, abnormal) become "going away"."""
    code = closed.rcvd.code if closed.rcvd is not None else 1001
    return 1001 if code in (1005, 1006, 1015) else code
