"""A viewer of a scene without a browser: the 3D server's own protocol, as far as a viewer must speak it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import msgspec
import viser
import websockets
import zstandard
from websockets.asyncio.client import ClientConnection, connect

from app.scene.hub import HubScene
from app.scene.server import SECRET_HEADER

PROTOCOL = websockets.Subprotocol(f"viser-v{viser.__version__}")
CAMERA: dict[str, Any] = {
    "type": "ViewerCameraMessage", "wxyz": (1.0, 0.0, 0.0, 0.0), "position": (0.0, 0.0, 9.0), "image_height": 9,
    "image_width": 9, "fov": 1.0, "near": 0.1, "far": 99.0, "look_at": (0.0, 0.0, 0.0), "up_direction": (0.0, 0.0, 1.0),
}  # fmt: skip


class Viewer:
    """What a viewer heard: the latest of each node's properties, poses and visibility, by name."""

    def __init__(self, socket: ClientConnection) -> None:
        self._socket = socket
        self.turns: dict[str, tuple[float, ...]] = {}
        self.places: dict[str, tuple[float, ...]] = {}
        self.removed: list[str] = []
        self.visible: dict[str, bool] = {}
        self.updates: dict[str, dict[str, Any]] = {}
        self.windows = 0
        """Messages of the 3D server that told a pose of the scene."""

    async def hear(self) -> None:
        """Take what comes, for ever."""
        async for data in self._socket:
            for message in messages_of(bytes(data) if not isinstance(data, str) else data.encode()):
                self._take(message)

    def _take(self, message: dict[str, Any]) -> None:
        name = message.get("name", "")
        match message["type"]:
            case "SetOrientationMessage":
                self.turns[name] = tuple(message["wxyz"])
                self.windows += 1
            case "SetPositionMessage":
                self.places[name] = tuple(message["position"])
            case "RemoveSceneNodeMessage":
                self.removed.append(name)
            case "SetSceneNodeVisibilityMessage":
                self.visible[name] = message["visible"]
            case "SceneNodeUpdateMessage":
                self.updates.setdefault(name, {}).update(message["updates"])


@asynccontextmanager
async def viewing(scene: HubScene) -> AsyncIterator[Viewer]:
    """Look at ``scene`` while the block runs."""
    secret = {SECRET_HEADER: scene.secret}
    url = f"ws://127.0.0.1:{scene.port}"
    async with connect(url, subprotocols=[PROTOCOL], additional_headers=secret, proxy=None, max_size=None) as socket:
        viewer = Viewer(socket)
        hearing = asyncio.create_task(viewer.hear())
        await socket.send(msgspec.msgpack.encode(CAMERA))
        yield viewer
        hearing.cancel()


def messages_of(data: bytes) -> list[dict[str, Any]]:
    """The messages of one window of the 3D server: two lengths, then msgpack in zstd."""
    whole, packed = (int.from_bytes(data[at : at + 8], "little") for at in (0, 8))
    inner = zstandard.decompress(data[16 : 16 + packed], max_output_size=whole)
    messages: list[dict[str, Any]] = msgspec.msgpack.decode(inner)["messages"]
    return messages
