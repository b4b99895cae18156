"""What a page has the server do while somebody presses STOP: a backup, saves, a restore."""

from __future__ import annotations

import asyncio
from typing import Any, Final

import httpx

SLUGS: Final = tuple(f"wtg-07/blade-{blade}/pmc" for blade in (1, 2, 3))
STATION: Final = "wtg-07/blade-1"
LOOK_S: Final = 0.05
TIMEOUT_S: Final = 60.0
_FOLLOWING_WINDOW: Final = "6065"
_OTHER: Final = 150
"""Of 6065h, in its unit: not what a twin has from the beginning."""


class Busy:
    """One page and what it has begun. Each method returns while the work it names is going on."""

    def __init__(self, client: httpx.AsyncClient) -> None:
        self._client = client
        self._job: str | None = None
        self._saves: dict[str, asyncio.Task[httpx.Response]] = {}
        self._set: str | None = None
        self._restore: str | None = None

    async def nothing(self) -> None:
        """No more than it does by itself."""
        await asyncio.sleep(LOOK_S)

    async def backup(self) -> None:
        """A backup runs: another one where the last has ended."""
        if self._job is None or (await self._get(f"jobs/{self._job}"))["state"] != "running":
            self._job = (await self._post("backup", reason="bench"))["id"]
        await asyncio.sleep(LOOK_S)

    async def over(self) -> None:
        """No backup runs any more."""
        async with asyncio.timeout(TIMEOUT_S):
            while self._job is not None and (await self._get(f"jobs/{self._job}"))["state"] == "running":  # noqa: ASYNC110
                await asyncio.sleep(LOOK_S)

    async def saves(self) -> None:
        """A save of 10 s runs at every axis: another one where STOP has ended the last."""
        for slug in SLUGS:
            if slug not in self._saves or self._saves[slug].done():
                self._saves[slug] = asyncio.create_task(self._client.post(f"/api/live/devices/{slug}/save", json={}))
        await asyncio.sleep(2 * LOOK_S)

    async def restore(self) -> None:
        """A restore is worked on: the one that STOP has halted goes on, else another one begins."""
        await self._end_saves()
        while True:
            doc = None if self._restore is None else await self._get(f"restores/{self._restore}")
            if doc is None or doc["end"] in ("new", "old", "given-up"):
                await self._begin_restore()
            elif "confirm" in doc["can"]:
                await self._post(f"restores/{self._restore}/confirm")
            elif not doc["running"]:
                await self._post(f"restores/{self._restore}/resume")
            await asyncio.sleep(2 * LOOK_S)
            doc = await self._get(f"restores/{self._restore}")
            if doc["running"] and doc["state"] != "awaiting-confirmation":
                return

    async def _begin_restore(self) -> None:
        """Give the station another value than the set has that it is to get back."""
        self._set = self._set or await self._backed_up()
        await self._post(f"devices/{SLUGS[0]}/write", address=_FOLLOWING_WINDOW, raw=_OTHER)
        wanted: dict[str, Any] = {"station": STATION, "sets": [self._set]}
        plan = await self._post("restore/plan", **wanted)
        if plan["refusals"]:
            raise RuntimeError(f"nothing is restored: {plan['refusals']}")
        self._restore = (await self._post("restore", **wanted, plan_hash=plan["hash"]))["id"]

    async def _backed_up(self) -> str:
        """A set of the axis as it is."""
        job = (await self._post("backup", reason="bench"))["id"]
        async with asyncio.timeout(TIMEOUT_S):
            while (await self._get(f"jobs/{job}"))["state"] == "running":  # noqa: ASYNC110  the server is a process
                await asyncio.sleep(LOOK_S)
        answer = await self._client.get("/api/sets", params={"device": SLUGS[0], "limit": 1})
        return str(answer.raise_for_status().json()["records"][0]["id"])

    async def _end_saves(self) -> None:
        """Wait for nothing that still runs."""
        for save in self._saves.values():
            save.cancel()
        await asyncio.gather(*self._saves.values(), return_exceptions=True)
        self._saves.clear()

    async def end(self) -> None:
        """What is left of it ends by the next STOP; a restore is given back what the station had."""
        await self._end_saves()

    async def _get(self, path: str) -> dict[str, Any]:
        doc: dict[str, Any] = (await self._client.get(f"/api/live/{path}")).raise_for_status().json()
        return doc

    async def _post(self, path: str, **body: Any) -> dict[str, Any]:
        answer = await self._client.post(f"/api/live/{path}", json=body)
        if answer.is_error:
            raise RuntimeError(f"{path}: {answer.text}")
        doc: dict[str, Any] = answer.json()
        return doc
