"""Other addresses than the loopback one: TLS, users, and names that are allowed."""

from __future__ import annotations

import ssl
import subprocess
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from ipaddress import ip_address
from pathlib import Path

import httpx
import pytest
from websockets.asyncio.client import connect

from app.errors import UsageError
from app.model.roles import Role
from app.web.access import Access
from app.web.app import create_app
from app.web.listen import Listen, Tls, parse_listen
from app.web.serve import open_port, port_of, serve
from tests.e2e.processes import HUBSIDE, running
from tests.web.certificates import self_signed
from tests.web.rig import Page, bench_with, denied, make_connection

ANNA = {"name": "Anna", "password": "pitch and yaw 7"}
ADDRESS = "127.0.0.2"


@dataclass
class Secure:
    """A server by TLS on another loopback address, with a user; ``client`` trusts its certificate."""

    port: int
    client: httpx.AsyncClient
    trust: ssl.SSLContext

    @property
    def origin(self) -> str:
        return f"https://{ADDRESS}:{self.port}"

    def socket(self, origin: str, host: str | None = None) -> connect:
        cookie = "; ".join(f"{name}={text}" for name, text in self.client.cookies.items())
        return connect(
            f"wss://{host or f'{ADDRESS}:{self.port}'}/api/ws",
            origin=origin,  # type: ignore[arg-type]
            additional_headers={"Cookie": cookie},
            ssl=self.trust,
            host=ADDRESS,
            port=self.port,
            proxy=None,
        )


@asynccontextmanager
async def secure(tls: Tls, names: tuple[str, ...] = ("bench.example",)) -> AsyncIterator[Secure]:
    bench = bench_with(make_connection())
    listen = Listen(ip_address(ADDRESS), 0, tls, names)
    listener = open_port(0, ADDRESS)
    port = port_of(listener)
    reach = listen.reach(port)
    access = Access(bench.office.sessions, port, reach.secure)
    trust = ssl.create_default_context(cafile=str(tls.certificate))
    try:
        async with (
            serve(create_app(bench, access, port, reach=reach), listener, tls),
            httpx.AsyncClient(base_url=f"https://{ADDRESS}:{port}", verify=trust, trust_env=False) as client,
        ):
            await bench.office.users.add(ANNA["name"], ANNA["password"], Role.EXPERT, "x")
            yield Secure(port, client, trust)
    finally:
        await bench.office.close()


@pytest.fixture
async def server(tmp_path: Path) -> AsyncIterator[Secure]:
    async with secure(self_signed(tmp_path)) as started:
        yield started


async def test_a_login_by_tls_gives_a_secure_cookie_and_a_secure_socket(server: Secure) -> None:
    assert (await server.client.get("/api/session")).json()["code"] == "login_needed"
    answer = await server.client.post("/api/login", json=ANNA)
    assert answer.status_code == 200
    assert "Secure" in answer.headers["set-cookie"]
    assert "HttpOnly" in answer.headers["set-cookie"]
    session = await server.client.get("/api/session", headers={"Origin": server.origin})
    assert session.json()["person"] == "Anna"
    policy = session.headers["content-security-policy"]
    assert f"wss://{ADDRESS}:{server.port}" in policy
    assert "ws://" not in policy.replace("wss://", "")
    async with server.socket(server.origin) as socket:
        assert (await Page(socket).until("hello"))["data"]["version"]


async def test_host_and_origin_are_those_of_the_secure_page(server: Secure) -> None:
    await server.client.post("/api/login", json=ANNA)
    port = server.port
    allowed = [f"{ADDRESS}:{port}", f"bench.example:{port}", f"127.0.0.1:{port}", f"localhost:{port}"]
    for host in allowed:
        cookies = "; ".join(f"{name}={text}" for name, text in server.client.cookies.items())
        headers = {"Host": host, "Origin": f"https://{host}", "Cookie": cookies}
        answer = await server.client.get("/api/session", headers=headers)
        assert answer.status_code == 200, host
    for host, origin in (
        (f"evil.example:{port}", None),
        (ADDRESS, None),
        ("bench.example", None),
        (f"bench.example.evil.example:{port}", None),
        (f"{ADDRESS}:{port}", f"http://{ADDRESS}:{port}"),
        (f"{ADDRESS}:{port}", f"https://bench.example:{port}"),
        (f"{ADDRESS}:{port}", "null"),
    ):
        headers = {"Host": host} | ({} if origin is None else {"Origin": origin})
        answer = await server.client.get("/api/session", headers=headers)
        assert (answer.status_code, answer.json()["code"]) == (403, "forbidden_host"), (host, origin)
    assert await denied(server.socket(f"http://{ADDRESS}:{port}")) == 403
    assert await denied(server.socket(server.origin)) == 101


async def test_plain_http_on_the_secure_port_gets_nothing(server: Secure) -> None:
    async with httpx.AsyncClient(trust_env=False) as plain:
        with pytest.raises(httpx.HTTPError):
            await plain.get(f"http://{ADDRESS}:{server.port}/api/session")


def test_another_address_needs_tls_users_and_names(tmp_path: Path) -> None:
    tls = self_signed(tmp_path)
    everywhere, here = ip_address("0.0.0.0"), ip_address("192.0.2.7")
    refused = [
        (Listen(here), True, "TLS only"),
        (Listen(here, 8600, tls), False, "users add"),
        (Listen(everywhere, 8600, tls), True, "--host"),
        (Listen(ip_address("2001:db8::7")), True, "TLS only"),
        (Listen(tls=Tls(tmp_path / "none", tls.key)), True, "no such file"),
        (Listen(tls=Tls(tls.key, tls.key)), True, "server.key"),
        (Listen(tls=Tls(tls.certificate, self_signed(tmp_path, "other").key)), True, "MISMATCH"),
        (Listen(tls=self_signed(tmp_path, "hidden", b"secret")), True, "hidden.key"),
    ]
    for listen, users, why in refused:
        with pytest.raises(UsageError) as told:
            listen.check(users)
        assert why in told.value.details["reason"], listen
    for listen, users in ((Listen(), False), (Listen(tls=tls), False), (Listen(here, 8600, tls), True)):
        listen.check(users)
    Listen(everywhere, 8600, tls, ("bench.example",)).check(True)


def test_the_names_of_an_address() -> None:
    everywhere = Listen(ip_address("0.0.0.0"), 443, Tls(Path("c"), Path("k")), ("Bench.example",)).reach(443)
    assert {"bench.example", "bench.example:443", "localhost:443"} <= everywhere.hosts
    assert not any("0.0.0.0" in host for host in everywhere.hosts)
    six = Listen(ip_address("2001:db8::7"), 8600).reach(8600)
    assert six.hosts == {"[2001:db8::7]:8600"}


@pytest.mark.parametrize(
    ("text", "address", "port"),
    [
        ("192.0.2.7", "192.0.2.7", 8600),
        ("192.0.2.7:443", "192.0.2.7", 443),
        ("[::1]", "::1", 8600),
        ("[::1]:1", "::1", 1),
        ("::1", "::1", 8600),
        ("localhost:9", "127.0.0.1", 9),
    ],
)
def test_addresses_to_listen_on(text: str, address: str, port: int) -> None:
    assert parse_listen(text, 8600) == (ip_address(address), port)


@pytest.mark.parametrize("text", ["", "bench.example", "192.0.2.7:", "192.0.2.7:99999", "[::1]x", "192.0.2:1", "[::1"])
def test_what_is_no_address(text: str) -> None:
    with pytest.raises(UsageError):
        parse_listen(text, 8600)


def test_the_command_refuses_what_is_not_safe_and_serves_what_is(tmp_path: Path) -> None:
    tls = self_signed(tmp_path)
    data = str(tmp_path / "data")

    def command(*arguments: str, given: str = "") -> subprocess.CompletedProcess[str]:
        whole = [*HUBSIDE, *arguments, "--data", data]
        return subprocess.run(whole, input=given, capture_output=True, text=True, timeout=60, check=False)

    secured = ("--tls-cert", str(tls.certificate), "--tls-key", str(tls.key))
    for arguments, why in (
        (("serve", "--listen", "192.0.2.7:0"), "TLS only"),
        (("serve", "--listen", "192.0.2.7:0", *secured), "users add"),
        (("serve", "--listen", "nowhere", *secured), "no address"),
        (("serve", "--tls-cert", str(tls.certificate)), "belong together"),
    ):
        done = command(*arguments)
        assert done.returncode == 2, done.stderr
        assert why in done.stderr
    assert command("users", "add", "Anna", given=f"{ANNA['password']}\n").returncode == 0
    serving = ("serve", "--listen", f"{ADDRESS}:0", *secured, "--data", data)
    with running(*serving) as process:
        line = process.wait_for("https://")
        url = next(word for word in line.split() if word.startswith("https://"))
        assert url.startswith(f"https://{ADDRESS}:")
        assert "token" not in url
        trust = ssl.create_default_context(cafile=str(tls.certificate))
        with httpx.Client(base_url=url, verify=trust, trust_env=False) as client:
            assert client.get("/api/session").json()["code"] == "login_needed"
            assert client.post("/api/login", json=ANNA).json()["role"] == "expert"
            assert client.get("/api/session").json()["person"] == "Anna"
        busy = command("users", "list")
        assert busy.returncode == 2
        assert "in use" in busy.stderr
