"""Named views of plots: a person's own, kept by the server, in their order."""

from __future__ import annotations

from pathlib import Path

from tests.web.rig import make_connection, running

PATH = "/api/desk/views"


async def test_views_are_kept_for_the_person_whatever_is_shown(tmp_path: Path) -> None:
    async with running(make_connection(), data=tmp_path) as server:
        assert (await server.client.get(PATH)).json() == {"views": []}
        mains = {"name": "mains", "plots": "blade-1/pmm/3062"}
        given = {"views": [{"name": "twice", "plots": "a/b/1"}, mains, {"name": "twice", "plots": "a/b/2"}]}
        in_replay = {"X-Hubside-Context": "replay/3-following-error"}
        kept = {"views": [{"name": "twice", "plots": "a/b/2"}, mains]}
        assert (await server.client.put(PATH, json=given, headers=in_replay)).json() == kept
        assert (await server.client.get(PATH)).json() == kept
        assert (await server.client.put(PATH, json={"views": [{"name": "", "plots": "x"}]})).status_code == 422
        await server.client.post("/api/users", json={"name": "Anna", "password": "pitch and yaw 7"})
        await server.client.post("/api/login", json={"name": "Anna", "password": "pitch and yaw 7"})
        assert (await server.client.get(PATH)).json() == {"views": []}
