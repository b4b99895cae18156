"""Who gets in: the same matrix over HTTP and over WebSocket, against a real server."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import httpx
import pytest

from app.web.guard import MAX_BODY
from app.web.serve import launch_url
from tests.web.rig import DEADLINE_S, Server, denied, running

API = "/api/session"
WRITE = "/api/live/devices/wtg-07/blade-1/pmm/write"


@pytest.fixture
async def server() -> AsyncIterator[Server]:
    async with running() as started:
        yield started


def host_and_origin(server: Server, host: str, origin: str | None) -> dict[str, str]:
    headers = {"Host": host.format(port=server.port)}
    return headers if origin is None else headers | {"Origin": origin.format(port=server.port)}


FOREIGN = [
    ("evil.example:{port}", None),
    ("evil.example", None),
    ("127.0.0.1", None),
    ("127.0.0.1:1", None),
    ("127.0.0.1.evil.example:{port}", None),
    ("0.0.0.0:{port}", None),
    ("127.0.0.1:{port}", "http://evil.example"),
    ("127.0.0.1:{port}", "http://evil.example:{port}"),
    ("127.0.0.1:{port}", "http://localhost:{port}"),
    ("127.0.0.1:{port}", "https://127.0.0.1:{port}"),
    ("127.0.0.1:{port}", "http://127.0.0.1:1"),
    ("127.0.0.1:{port}", "null"),
    ("evil.example:{port}", "http://evil.example:{port}"),
]
"""Host and Origin that no page of ours has; the last is DNS rebinding, where both agree."""


async def test_foreign_host_or_origin_is_refused_over_http(server: Server) -> None:
    for host, origin in FOREIGN:
        answer = await server.client.get(API, headers=host_and_origin(server, host, origin))
        assert answer.status_code == 403, (host, origin)
        assert answer.headers["content-type"] == "application/problem+json"
        assert answer.json()["code"] == "forbidden_host"


@pytest.mark.parametrize("path", ["/api/ws", "/viser", "/viser/"])
async def test_foreign_host_or_origin_is_refused_over_websocket(server: Server, path: str) -> None:
    for host, origin in FOREIGN:
        page = None if origin is None else origin.format(port=server.port)
        opening = server.socket(path, host.format(port=server.port), origin=page)
        assert await denied(opening) == 403, (host, origin)


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost", "[::1]"])
async def test_each_loopback_name_is_ours(server: Server, name: str) -> None:
    headers = {"Host": f"{name}:{server.port}", "Origin": f"http://{name}:{server.port}"}
    assert (await server.client.get(API, headers=headers)).status_code == 200
    assert await denied(server.socket(called=headers["Host"], origin=headers["Origin"])) == 101


async def test_a_websocket_needs_an_origin(server: Server) -> None:
    assert await denied(server.socket(origin=None)) == 403
    assert await denied(server.socket()) == 101


async def test_without_a_session_nothing_opens(server: Server) -> None:
    for path in (API, "/", "/index.html", "/assets/x.js", "/viser/", "/api/texts/en", "/api/live/turbine"):
        answer = await server.stranger.get(path)
        assert answer.status_code == 401, path
        assert answer.json()["code"] == "unauthorised"
    answer = await server.stranger.post("/api/live/stop", json={})
    assert answer.status_code == 401
    for cookie in ("", f"hubside_{server.port}=", f"hubside_{server.port}=guess", "other=x"):
        assert await denied(server.socket(additional_headers={"Cookie": cookie})) == 401, cookie


async def test_a_person_without_a_session_is_told_what_to_do(server: Server) -> None:
    answer = await server.stranger.get("/", headers={"Accept": "text/html,*/*"})
    assert answer.status_code == 401
    assert answer.headers["content-type"].startswith("text/html")
    assert "token" in answer.text


async def test_the_token_works_once_and_leaves_the_address(server: Server) -> None:
    used = await server.stranger.get(launch_url(server.port, server.token))
    assert used.status_code == 401
    answer = await server.stranger.get(launch_url(server.port, server.access.issue_token()))
    assert (answer.status_code, answer.headers["location"]) == (303, "/")
    cookie = answer.headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    assert "Path=/" in cookie
    assert (await server.stranger.get(API)).status_code == 200


async def test_a_reload_of_the_launch_address_stays_in(server: Server) -> None:
    again = await server.client.get(launch_url(server.port, server.token))
    assert (again.status_code, again.headers["location"]) == (303, "/")
    assert "set-cookie" not in again.headers
    assert (await server.client.get(API)).status_code == 200


async def test_a_token_opens_nothing_but_the_page(server: Server) -> None:
    token = server.access.issue_token()
    assert (await server.stranger.get(f"{API}?token={token}")).status_code == 401
    assert (await server.stranger.post(f"/?token={token}", json={})).status_code == 401
    assert await denied(server.socket(f"/api/ws?token={token}", additional_headers={})) == 401
    assert (await server.stranger.get(launch_url(server.port, token))).status_code == 303


@pytest.mark.parametrize("kind", ["text/plain", "application/x-www-form-urlencoded", "multipart/form-data", ""])
@pytest.mark.parametrize("path", ["/api/live/stop", "/api/live/devices/wtg-07/blade-1/pmm/write"])
async def test_a_body_that_needs_no_preflight_is_refused(server: Server, kind: str, path: str) -> None:
    body = b'{"address": "3110:01", "raw": 490}'
    headers = {"Content-Type": kind} if kind else {}
    answer = await server.client.post(path, content=body, headers=headers)
    assert answer.status_code == 422
    assert answer.json()["code"] == "invalid"


async def test_a_body_that_says_it_is_too_large_is_refused_unread(server: Server) -> None:
    """Only the head is sent: the answer comes without the body."""
    head = (
        f"POST {WRITE} HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nCookie: {server.cookie}\r\n"
        f"Content-Type: application/json\r\nContent-Length: {MAX_BODY + 1}\r\n\r\n"
    )
    reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
    try:
        writer.write(head.encode())
        answer = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), DEADLINE_S)
    finally:
        writer.close()
    assert answer.startswith(b"HTTP/1.1 413 ")
    assert b"content-type: application/problem+json" in answer


async def test_a_body_that_turns_out_too_large_is_refused_before_its_end(server: Server) -> None:
    """It comes in chunks without a length, and never ends: the answer comes all the same."""
    head = (
        f"POST {WRITE} HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nCookie: {server.cookie}\r\n"
        "Content-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n"
    )
    reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
    try:
        writer.write(head.encode())
        for _ in range(MAX_BODY // 4096 + 1):
            writer.write(b"1000\r\n" + b" " * 4096 + b"\r\n")
            await writer.drain()
        answer = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), DEADLINE_S)
    finally:
        writer.close()
    assert answer.startswith(b"HTTP/1.1 413 ")


async def test_a_body_up_to_the_limit_is_read(server: Server) -> None:
    body = b'{"address": "3110:01", "raw": "x"}'
    headers = {"Content-Type": "application/json"}
    for extra, status, code in ((0, 422, "value_type"), (1, 413, "invalid")):
        padded = body + b" " * (MAX_BODY - len(body) + extra)
        answer = await server.client.post(WRITE, content=padded, headers=headers)
        assert (answer.status_code, answer.json()["code"]) == (status, code)

    async def chunks() -> AsyncIterator[bytes]:
        for at in range(0, len(body), 5):
            yield body[at : at + 5]

    assert (await server.client.post(WRITE, content=chunks(), headers=headers)).json()["code"] == "value_type"


async def test_requests_of_other_sites_are_refused_but_links_open(server: Server) -> None:
    for site in ("cross-site", "same-site"):
        fetched = await server.client.get(API, headers={"Sec-Fetch-Site": site, "Sec-Fetch-Dest": "image"})
        assert fetched.status_code == 403, site
        framed = await server.client.get("/viser/", headers={"Sec-Fetch-Site": site, "Sec-Fetch-Dest": "iframe"})
        assert framed.status_code == 403, site
        address = launch_url(server.port, server.token)
        opened = await server.client.get(address, headers={"Sec-Fetch-Site": site, "Sec-Fetch-Dest": "document"})
        assert opened.status_code == 303, site


async def test_a_header_that_comes_twice_does_not_get_past(server: Server) -> None:
    twice = httpx.Headers([("Host", f"127.0.0.1:{server.port}"), ("Origin", server.origin), ("Origin", "http://evil")])
    assert (await server.client.get(API, headers=twice)).status_code == 403


async def test_security_headers(server: Server) -> None:
    answer = await server.client.get(API)
    assert answer.headers["cache-control"] == "no-store"
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["referrer-policy"] == "no-referrer"
    policy = answer.headers["content-security-policy"]
    assert "default-src 'self'" in policy
    assert "frame-ancestors 'none'" in policy
    assert "script-src" not in policy
    assert "server" not in answer.headers


async def test_unknown_paths_are_problems(server: Server) -> None:
    answer = await server.client.get("/api/nothing")
    assert answer.status_code == 404
    assert answer.json()["code"] == "not_found"
