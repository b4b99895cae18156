"""The 3D views of replays: one 3D server for each replay that somebody looks at, closed with it. For the event loop."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from typing import Final

from app.scene.hub import HubScene
from app.service.scene_feed import follow
from app.service.shown import Shown

log = logging.getLogger(__name__)

SWEEP_S: Final = 1.0
_SECRET_BYTES: Final = 32


@dataclass(frozen=True, slots=True)
class _View:
    shown: Shown
    scene: HubScene
    feed: asyncio.Task[None]


class ReplayScenes:
    """``find`` gives the replay of a context (``replay/<name>``); None where it is not open, or has ended."""

    def __init__(self, find: Callable[[str], Shown | None]) -> None:
        self._find = find
        self._views: dict[str, _View] = {}
        self._making = asyncio.Lock()

    async def scene(self, name: str) -> HubScene | None:
        """The 3D view of a replay, made where there is none yet; None where the replay is not open."""
        async with self._making:
            shown = self._find(f"replay/{name}")
            view = self._views.get(name)
            if view is not None and view.shown is not shown:
                await self._close(name)
                view = None
            if shown is None:
                return None
            if view is None:
                scene = await asyncio.to_thread(HubScene, secrets.token_urlsafe(_SECRET_BYTES))
                view = self._views[name] = _View(shown, scene, asyncio.create_task(follow(shown, scene)))
            return view.scene

    @contextlib.asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """While the block runs, the views of replays that have ended are closed; at its end all are."""
        sweeper = asyncio.create_task(self._sweep())
        try:
            yield
        finally:
            sweeper.cancel()
            await asyncio.gather(sweeper, return_exceptions=True)
            async with self._making:
                for name in list(self._views):
                    await self._close(name)

    async def _sweep(self) -> None:
        while True:
            await asyncio.sleep(SWEEP_S)
            async with self._making:
                for name, view in list(self._views.items()):
                    if self._find(view.shown.ctx) is not view.shown:
                        await self._close(name)

    async def _close(self, name: str) -> None:
        view = self._views.pop(name)
        view.feed.cancel()
        await asyncio.gather(view.feed, return_exceptions=True)
        await asyncio.to_thread(view.scene.close)
        log.debug("the 3D view of the replay %s was closed", name)
