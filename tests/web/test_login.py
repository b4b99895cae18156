"""Login, logout and the end of launch tokens: a real server, a real store, real sockets."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest
import websockets

from app.store.store import Store
from app.web.guard import SIGNED_OUT
from app.web.serve import launch_url
from tests.web.rig import DEADLINE_S, Page, Server, denied, running

ANNA = {"name": "Anna", "password": "pitch and yaw 7"}
BEN = {"name": "Ben", "password": "feather at once"}
API = "/api/session"


@pytest.fixture
async def server(tmp_path: Path) -> AsyncIterator[Server]:
    async with running(store=Store.open(tmp_path)) as started:
        yield started


async def with_anna(server: Server) -> httpx.AsyncClient:
    """Anna is the first user; ``client`` of the server is hers."""
    assert (await server.client.post("/api/users", json=ANNA)).json()["role"] == "expert"
    answer = await server.client.post("/api/login", json=ANNA)
    assert answer.status_code == 200, answer.text
    return server.client


async def log_in(server: Server, who: dict[str, str]) -> httpx.AsyncClient:
    client = httpx.AsyncClient(base_url=server.origin, trust_env=False)
    answer = await client.post("/api/login", json=who)
    assert answer.status_code == 200, answer.text
    return client


def socket_of(server: Server, client: httpx.AsyncClient) -> websockets.connect:
    cookie = "; ".join(f"{name}={text}" for name, text in client.cookies.items())
    return server.socket(additional_headers={"Cookie": cookie})


async def closed_within_a_second(socket: websockets.ClientConnection) -> int | None:
    async with asyncio.timeout(1.0):
        await socket.wait_closed()
    return socket.close_code


async def test_the_first_user_is_an_expert_and_ends_all_launch_sessions(server: Server) -> None:
    before = (await server.client.get(API)).json()
    assert (before["role"], before["user"], before["login_needed"]) == ("technician", None, False)
    async with server.socket() as socket:
        await Page(socket).until("hello")
        answer = await server.client.post("/api/users", json={**ANNA, "role": "viewer"})
        assert (answer.status_code, answer.json()["role"]) == (200, "expert")
        assert await closed_within_a_second(socket) == SIGNED_OUT
    refused = await server.client.get(API)
    assert (refused.status_code, refused.json()["code"]) == (401, "login_needed")
    token = server.access.issue_token()
    launched = await server.stranger.get(launch_url(server.port, token))
    assert "set-cookie" not in launched.headers
    assert (await server.stranger.get(API)).status_code == 401
    assert await denied(server.socket()) == 401


async def test_a_login_opens_a_session_in_the_users_name(server: Server) -> None:
    client = await with_anna(server)
    session = (await client.get(API)).json()
    assert (session["person"], session["role"], session["login_needed"]) == ("Anna", "expert", True)
    again = await log_in(server, {**ANNA, "name": " anna "})
    assert (await again.get(API)).json()["user"] == session["user"]
    assert await denied(socket_of(server, again)) == 101
    await again.aclose()


async def test_what_a_login_page_needs_works_without_a_session_and_nothing_else(server: Server) -> None:
    await with_anna(server)
    page = await server.stranger.get("/settings", headers={"Accept": "text/html"})
    assert page.status_code in (200, 404)  # 404 where the page was not built
    assert "content-security-policy" in page.headers
    assert (await server.stranger.get("/api/texts/de")).status_code == 200
    for path in (API, "/api/live/turbine", "/api/users", "/api/audit", "/viser/", "/viser", "/api", "/apix"):
        answer = await server.stranger.get(path)
        assert (answer.status_code, answer.json()["code"]) == (401, "login_needed"), path
    for path in ("/api/live/stop", "/api/users", "/api/logout", "/api/texts/de", "/"):
        assert (await server.stranger.post(path, json={})).status_code == 401, path


async def test_wrong_names_and_passwords_are_told_alike(server: Server) -> None:
    await with_anna(server)
    bodies = []
    for who in ({**ANNA, "password": "something else"}, {**BEN}, {"name": "Anna", "password": ""}):
        answer = await server.stranger.post("/api/login", json=who)
        assert answer.status_code == 401
        assert "set-cookie" not in answer.headers
        bodies.append(answer.json())
    assert bodies[0] == bodies[1] == bodies[2]
    assert bodies[0]["code"] == "login"


async def test_failed_logins_must_wait_and_others_need_not(server: Server) -> None:
    await with_anna(server)
    await server.client.post("/api/users", json={**BEN, "role": "viewer"})
    tries: list[int] = []
    while len(tries) < 10 and 429 not in tries:
        tries.append((await server.stranger.post("/api/login", json={**BEN, "password": "guessing"})).status_code)
    assert tries[:4] == [401] * 4
    paused = await server.stranger.post("/api/login", json=BEN)
    assert (paused.status_code, paused.json()["code"]) == (429, "login_paused"), tries
    assert paused.json()["details"]["retry_after_s"] >= 1
    assert (await server.stranger.post("/api/login", json=ANNA)).status_code == 200

    async def let_in() -> bool:
        return (await server.stranger.post("/api/login", json=BEN)).status_code == 200

    async with asyncio.timeout(DEADLINE_S):
        while not await let_in():  # noqa: ASYNC110  a pause that runs out has no event
            await asyncio.sleep(0.1)


async def test_a_logout_ends_the_session_and_its_sockets(server: Server) -> None:
    client = await with_anna(server)
    cookies = dict(client.cookies)
    other = await log_in(server, ANNA)
    async with socket_of(server, client) as socket, socket_of(server, other) as kept:
        await Page(socket).until("hello")
        answer = await client.post("/api/logout", json={})
        assert answer.status_code == 200
        assert "Max-Age=0" in answer.headers["set-cookie"]
        assert await closed_within_a_second(socket) == SIGNED_OUT
        await Page(kept).until("heartbeat")
    stolen = {"Cookie": "; ".join(f"{name}={text}" for name, text in cookies.items())}
    assert (await server.stranger.get(API, headers=stolen)).status_code == 401
    assert (await other.get(API)).status_code == 200
    await other.aclose()


async def test_disabling_and_a_new_password_end_the_users_sessions(server: Server) -> None:
    expert = await with_anna(server)
    ben = (await expert.post("/api/users", json={**BEN, "role": "technician"})).json()
    for change in ({"password": "another wind blows"}, {"disabled": True}):
        theirs = await log_in(server, BEN)
        async with socket_of(server, theirs) as socket:
            await Page(socket).until("hello")
            assert (await expert.patch(f"/api/users/{ben['id']}", json=change)).status_code == 200
            assert await closed_within_a_second(socket) == SIGNED_OUT
        assert (await theirs.get(API)).status_code == 401
        await theirs.aclose()
        renewed = {**BEN, "password": "another wind blows"}
        status = (await server.stranger.post("/api/login", json=renewed)).status_code
        assert status == (401 if "disabled" in change else 200)
        if "password" in change:
            assert (await expert.patch(f"/api/users/{ben['id']}", json={"password": BEN["password"]})).is_success
    assert (await expert.get(API)).status_code == 200


async def test_a_role_counts_from_the_next_request_on(server: Server) -> None:
    expert = await with_anna(server)
    ben = (await expert.post("/api/users", json={**BEN, "role": "expert"})).json()
    theirs = await log_in(server, BEN)
    assert (await theirs.get("/api/users")).status_code == 200
    assert (await expert.patch(f"/api/users/{ben['id']}", json={"role": "viewer"})).json()["role"] == "viewer"
    refused = await theirs.get("/api/users")
    assert (refused.status_code, refused.json()["code"]) == (403, "role")
    assert (await theirs.get(API)).json()["role"] == "viewer"
    await theirs.aclose()


async def test_one_changes_ones_own_password_by_the_old_one(server: Server) -> None:
    client = await with_anna(server)
    wrong = await client.post("/api/password", json={"old": "not this one", "new": "a better password"})
    assert (wrong.status_code, wrong.json()["code"]) == (401, "login")
    short = await client.post("/api/password", json={"old": ANNA["password"], "new": "short"})
    assert (short.status_code, short.json()["code"]) == (422, "user_rule")
    done = await client.post("/api/password", json={"old": ANNA["password"], "new": "a better password"})
    assert done.status_code == 200
    assert (await client.get(API)).status_code == 401
    assert (await client.post("/api/login", json={**ANNA, "password": "a better password"})).status_code == 200


async def test_a_session_outlives_the_server(tmp_path: Path) -> None:
    async with running(store=Store.open(tmp_path)) as first:
        await with_anna(first)
        secret = next(iter(first.client.cookies.values()))
    async with running(store=Store.open(tmp_path), signed_in=False) as second:
        cookie = {"Cookie": f"hubside_{second.port}={secret}"}
        assert (await second.stranger.get(API, headers=cookie)).json()["person"] == "Anna"
        await second.stranger.post("/api/logout", json={}, headers=cookie)
    async with running(store=Store.open(tmp_path), signed_in=False) as third:
        cookie = {"Cookie": f"hubside_{third.port}={secret}"}
        assert (await third.stranger.get(API, headers=cookie)).status_code == 401


async def test_no_secret_and_no_password_stands_in_the_store(tmp_path: Path) -> None:
    async with running(store=Store.open(tmp_path)) as server:
        await with_anna(server)
        secret = next(iter(server.client.cookies.values()))
    kept = (tmp_path / "store.sqlite3").read_bytes()
    assert secret.encode() not in kept
    assert ANNA["password"].encode() not in kept
    assert b"$argon2id$" in kept
    assert (tmp_path / "store.sqlite3").stat().st_mode & 0o077 == 0
