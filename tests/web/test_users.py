"""The users' routes: who may do what, and how refusals are told."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest

from tests.web.rig import Server, running
from tests.web.test_login import ANNA, BEN, log_in, with_anna


@pytest.fixture
async def server() -> AsyncIterator[Server]:
    async with running() as started:
        yield started


async def test_users_are_listed_changed_and_refused(server: Server) -> None:
    assert (await server.client.get("/api/users")).json()["code"] == "role"
    anna = await with_anna(server)
    me = (await anna.get("/api/users")).json()
    assert [(one["name"], one["role"], one["disabled"], one["you"]) for one in me] == [("Anna", "expert", False, True)]
    assert "hash" not in str(me)
    ben = (await anna.post("/api/users", json={**BEN, "role": "technician"})).json()
    here = f"/api/users/{ben['id']}"
    refused = [
        ("POST", "/api/users", {**BEN, "name": "BEN", "role": "viewer"}, 409, "user_exists"),
        ("POST", "/api/users", {"name": "Carl", "password": "short"}, 422, "user_rule"),
        ("POST", "/api/users", {"name": "Carl", "password": "long enough", "role": "king"}, 422, "invalid"),
        ("POST", "/api/users", {"name": "", "password": "long enough"}, 422, "invalid"),
        ("PATCH", here, {"role": "viewer", "more": 1}, 422, "invalid"),
        ("PATCH", here, {"password": "short"}, 422, "user_rule"),
        ("PATCH", "/api/users/nobody", {"role": "viewer"}, 404, "user_unknown"),
        ("PATCH", f"/api/users/{me[0]['id']}", {"role": "viewer"}, 409, "last_expert"),
        ("PATCH", f"/api/users/{me[0]['id']}", {"disabled": True}, 409, "last_expert"),
    ]
    for method, path, body, status, code in refused:
        answer = await anna.request(method, path, json=body)
        assert (answer.status_code, answer.json()["code"]) == (status, code), (path, body)
    changed = (await anna.patch(here, json={"role": "viewer", "disabled": True})).json()
    assert (changed["role"], changed["disabled"], changed["you"]) == ("viewer", True, False)


@pytest.mark.parametrize("role", ["viewer", "technician"])
async def test_only_experts_reach_the_users(server: Server, role: str) -> None:
    anna = await with_anna(server)
    ben = (await anna.post("/api/users", json={**BEN, "role": role})).json()
    theirs = await log_in(server, BEN)
    for method, path, body in (
        ("GET", "/api/users", None),
        ("POST", "/api/users", {"name": "Carl", "password": "long enough"}),
        ("PATCH", f"/api/users/{ben['id']}", {"role": "expert"}),
    ):
        answer = await theirs.request(method, path, json=body)
        assert (answer.status_code, answer.json()["code"]) == (403, "role"), path
    assert (await theirs.post("/api/password", json={"old": BEN["password"], "new": ANNA["password"]})).is_success
    await theirs.aclose()


async def test_a_viewer_may_not_make_the_first_user_and_a_launched_technician_has_no_password(server: Server) -> None:
    answer = await server.client.post("/api/password", json={"old": "x", "new": "long enough"})
    assert (answer.status_code, answer.json()["code"]) == (401, "login_needed")
