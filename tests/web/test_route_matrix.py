"""Every route, HTTP and WebSocket, refuses who must not use it: no session, too low a role, a foreign page or name.

The routes are taken from the running application, so none can be forgotten: one that is not in ``ROUTES`` fails.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass
from typing import Any, Final

import httpx
import pytest
from fastapi.routing import iter_route_contexts

from app.model.roles import Role
from app.scene.hub import HubScene
from app.store.store import Store
from app.web.access import Access
from app.web.app import create_app
from tests.web.rig import Server, bench_with, denied, make_connection, running

VIEWER, TECHNICIAN, EXPERT = Role.VIEWER, Role.TECHNICIAN, Role.EXPERT
SOCKET: Final = "SOCKET"

ROUTES: Final[dict[tuple[str, str], Role]] = {
    ("GET", "/api/session"): VIEWER,
    ("GET", "/api/texts/{locale}"): VIEWER,
    ("POST", "/api/login"): VIEWER,
    ("POST", "/api/logout"): VIEWER,
    ("POST", "/api/password"): VIEWER,
    # people and what they did
    ("GET", "/api/users"): EXPERT,
    ("POST", "/api/users"): EXPERT,
    ("PATCH", "/api/users/{user_id}"): EXPERT,
    ("GET", "/api/audit"): VIEWER,
    ("GET", "/api/audit/head"): VIEWER,
    ("POST", "/api/audit/verify"): VIEWER,
    ("GET", "/api/visits"): VIEWER,
    ("GET", "/api/live/visit"): VIEWER,
    ("PATCH", "/api/live/visit"): TECHNICIAN,
    ("POST", "/api/live/visit/end"): TECHNICIAN,
    ("GET", "/api/live/visit/left"): VIEWER,
    ("GET", "/api/live/changes-since-last-visit"): VIEWER,
    ("GET", "/api/favourites/{description_id}"): VIEWER,
    ("PUT", "/api/favourites/{description_id}"): VIEWER,
    ("GET", "/api/desk/views"): VIEWER,
    ("PUT", "/api/desk/views"): VIEWER,
    # the connection and its devices
    ("GET", "/api/turbines"): VIEWER,
    ("POST", "/api/live/connect"): TECHNICIAN,
    ("POST", "/api/live/disconnect"): TECHNICIAN,
    ("POST", "/api/live/consent"): TECHNICIAN,
    ("GET", "/api/live/turbine"): VIEWER,
    # PDOs of a device
    ("GET", "/api/live/devices/{turbine}/{station}/{device}/pdos"): VIEWER,
    ("GET", "/api/replay/{replay_id}/devices/{turbine}/{station}/{device}/pdos"): VIEWER,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/pdos/preview"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/pdos/apply"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/pdos/undo"): TECHNICIAN,
    # who moves the axes
    ("GET", "/api/live/motion"): VIEWER,
    ("POST", "/api/live/motion/lease"): TECHNICIAN,
    ("POST", "/api/live/motion/lease/ask"): TECHNICIAN,
    ("POST", "/api/live/motion/lease/withdraw"): TECHNICIAN,
    ("POST", "/api/live/motion/lease/answer"): TECHNICIAN,
    ("POST", "/api/live/motion/lease/give-back"): TECHNICIAN,
    ("POST", "/api/live/motion/confirm"): TECHNICIAN,
    ("GET", "/api/live/devices/{turbine}/{station}/{device}/motion/interlocks"): VIEWER,
    ("GET", "/api/live/devices/{turbine}/{station}/{device}/motion/positions"): VIEWER,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/prepare"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/put-back"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/jog"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/manual"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/operation"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/move"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/home"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/search-home"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/reset"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/hold"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/feather"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/brake-test"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/halt"): TECHNICIAN,
    ("GET", "/api/batteries/{turbine}/{station}/{device}"): VIEWER,
    ("GET", "/api/live/devices/{turbine}/{station}/{device}/battery"): VIEWER,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/battery/test"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/battery/test/cancel"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/battery/charge"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/battery/change"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/battery/change/give-up"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/battery/change/done"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/signal"): TECHNICIAN,
    ("GET", "/api/live/devices/{turbine}/{station}/{device}/motion/probe"): VIEWER,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motion/probe/arm"): TECHNICIAN,
    ("GET", "/api/live/devices/{turbine}/{station}/{device}/motion/signals"): VIEWER,
    ("GET", "/api/signals/{run_id}"): VIEWER,
    ("GET", "/api/live/descriptions/{description_id}"): VIEWER,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/read"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/write"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/save"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/restart"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/verify"): TECHNICIAN,
    ("GET", "/api/live/devices/{turbine}/{station}/{device}/changes"): VIEWER,
    ("POST", "/api/live/writes"): TECHNICIAN,
    ("POST", "/api/live/writes/plan"): TECHNICIAN,
    ("GET", "/api/live/bus/lines"): VIEWER,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/order/check"): TECHNICIAN,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/order/keep"): TECHNICIAN,
    ("GET", "/api/live/jobs/{job_id}"): VIEWER,
    ("DELETE", "/api/live/jobs/{job_id}"): TECHNICIAN,
    ("POST", "/api/live/stop"): VIEWER,
    ("POST", "/api/live/feather"): VIEWER,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/stop"): VIEWER,
    # the scope
    ("GET", "/api/live/scope"): VIEWER,
    ("GET", "/api/live/scope/view"): VIEWER,
    ("POST", "/api/live/scope/arm"): TECHNICIAN,
    ("POST", "/api/live/scope/trigger"): TECHNICIAN,
    ("POST", "/api/live/scope/stop"): TECHNICIAN,
    ("GET", "/api/scope/captures"): VIEWER,
    ("GET", "/api/scope/captures/{capture_id}"): VIEWER,
    ("PATCH", "/api/scope/captures/{capture_id}"): TECHNICIAN,
    ("DELETE", "/api/scope/captures/{capture_id}"): TECHNICIAN,
    ("GET", "/api/scope/captures/{capture_id}/series"): VIEWER,
    ("GET", "/api/scope/captures/{capture_id}/spectrum"): VIEWER,
    ("GET", "/api/scope/captures/{capture_id}/xy"): VIEWER,
    ("GET", "/api/scope/captures/{capture_id}/parameters"): VIEWER,
    ("GET", "/api/scope/captures/{capture_id}/csv"): VIEWER,
    ("GET", "/api/scope/captures/{capture_id}/json"): VIEWER,
    # the bus
    ("GET", "/api/live/frames"): VIEWER,
    ("GET", "/api/live/bus/nodes"): VIEWER,
    ("GET", "/api/live/bus/identifiers"): VIEWER,
    ("GET", "/api/live/bus/transfers"): VIEWER,
    ("GET", "/api/live/bus/emergencies"): VIEWER,
    ("GET", "/api/live/bus/load"): VIEWER,
    # why it tripped
    ("GET", "/api/recordings/{name}/trips"): VIEWER,
    ("GET", "/api/recordings/{name}/key-events"): VIEWER,
    ("POST", "/api/search"): VIEWER,
    ("POST", "/api/search/signature"): VIEWER,
    ("GET", "/api/search/{job_id}"): VIEWER,
    ("DELETE", "/api/search/{job_id}"): VIEWER,
    ("POST", "/api/align"): VIEWER,
    # to and from other formats
    ("GET", "/api/recordings/{name}/losses"): VIEWER,
    ("GET", "/api/recordings/{name}/export"): VIEWER,
    ("GET", "/api/recordings/{name}/table"): VIEWER,
    ("POST", "/api/recordings/import"): TECHNICIAN,
    ("POST", "/api/recordings/merge"): TECHNICIAN,
    ("POST", "/api/recordings/{name}/cut"): TECHNICIAN,
    ("POST", "/api/recordings/{name}/anonymise"): TECHNICIAN,
    ("GET", "/api/recordings/made/{job_id}"): VIEWER,
    ("DELETE", "/api/recordings/made/{job_id}"): TECHNICIAN,
    # replay
    ("GET", "/api/replay"): VIEWER,
    ("POST", "/api/replay"): VIEWER,
    ("GET", "/api/replay/{replay_id}"): VIEWER,
    ("DELETE", "/api/replay/{replay_id}"): TECHNICIAN,
    ("POST", "/api/replay/{replay_id}/cursor"): VIEWER,
    ("POST", "/api/replay/{replay_id}/{path:path}"): VIEWER,
    ("PUT", "/api/replay/{replay_id}/{path:path}"): VIEWER,
    ("PATCH", "/api/replay/{replay_id}/{path:path}"): VIEWER,
    ("DELETE", "/api/replay/{replay_id}/{path:path}"): VIEWER,
    ("POST", "/api/replay/{replay_id}/sets"): TECHNICIAN,
    ("GET", "/api/replay/{replay_id}/timeline"): VIEWER,
    ("GET", "/api/replay/{replay_id}/events"): VIEWER,
    ("GET", "/api/replay/{replay_id}/signals"): VIEWER,
    ("GET", "/api/replay/{replay_id}/series"): VIEWER,
    ("GET", "/api/replay/{replay_id}/history"): VIEWER,
    ("GET", "/api/replay/{replay_id}/turbine"): VIEWER,
    ("GET", "/api/replay/{replay_id}/descriptions/{description_id}"): VIEWER,
    ("GET", "/api/replay/{replay_id}/frames"): VIEWER,
    ("GET", "/api/replay/{replay_id}/bus/nodes"): VIEWER,
    ("GET", "/api/replay/{replay_id}/bus/identifiers"): VIEWER,
    ("GET", "/api/replay/{replay_id}/bus/transfers"): VIEWER,
    ("GET", "/api/replay/{replay_id}/bus/emergencies"): VIEWER,
    ("GET", "/api/replay/{replay_id}/bus/load"): VIEWER,
    # recordings and sets
    ("GET", "/api/recordings"): VIEWER,
    ("GET", "/api/recordings/{name}"): VIEWER,
    ("GET", "/api/recordings/{name}/download"): VIEWER,
    ("GET", "/api/recordings/{name}/attachment"): VIEWER,
    ("GET", "/api/sets"): VIEWER,
    ("GET", "/api/sets/{key}"): VIEWER,
    ("GET", "/api/sets/{key}/download"): VIEWER,
    ("POST", "/api/sets/{key}/tags"): TECHNICIAN,
    ("POST", "/api/sets/import"): TECHNICIAN,
    ("POST", "/api/recordings/{name}/recover-sets"): TECHNICIAN,
    ("GET", "/api/nameplates"): VIEWER,
    ("PUT", "/api/nameplates"): TECHNICIAN,
    ("GET", "/api/descriptions/{description_id}"): VIEWER,
    ("POST", "/api/live/backup"): TECHNICIAN,
    ("POST", "/api/compare"): VIEWER,
    ("POST", "/api/compare/export"): VIEWER,
    ("GET", "/api/parity"): VIEWER,
    ("POST", "/api/fleet"): VIEWER,
    ("GET", "/api/rules"): VIEWER,
    ("POST", "/api/rules/check"): VIEWER,
    # incidents
    ("GET", "/api/incidents"): VIEWER,
    ("POST", "/api/incidents"): TECHNICIAN,
    ("GET", "/api/incidents/{key}"): VIEWER,
    ("PUT", "/api/incidents/{key}"): TECHNICIAN,
    ("DELETE", "/api/incidents/{key}"): EXPERT,
    ("GET", "/api/incidents/{key}/versions"): VIEWER,
    ("GET", "/api/incidents/{key}/bundle"): VIEWER,
    ("GET", "/api/incidents/{key}/report"): VIEWER,
    ("POST", "/api/incidents/import"): TECHNICIAN,
    ("GET", "/api/recordings/{name}/annotations"): VIEWER,
    ("POST", "/api/recordings/{name}/annotations"): TECHNICIAN,
    ("PUT", "/api/annotations/{annotation_id}"): TECHNICIAN,
    ("DELETE", "/api/annotations/{annotation_id}"): TECHNICIAN,
    # motors
    ("GET", "/api/motors"): VIEWER,
    ("GET", "/api/motors/form"): VIEWER,
    ("GET", "/api/motors/export"): VIEWER,
    ("GET", "/api/motors/compare"): VIEWER,
    ("GET", "/api/motors/{motor_id}/versions"): VIEWER,
    ("POST", "/api/motors"): TECHNICIAN,
    ("POST", "/api/motors/import"): TECHNICIAN,
    ("PUT", "/api/motors/{motor_id}"): TECHNICIAN,
    ("POST", "/api/motors/{motor_id}/assign"): TECHNICIAN,
    ("DELETE", "/api/motors/{motor_id}"): EXPERT,
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/motor"): TECHNICIAN,
    # restores
    ("POST", "/api/live/restore/plan"): TECHNICIAN,
    ("POST", "/api/live/restore"): TECHNICIAN,
    ("GET", "/api/live/restores"): VIEWER,
    ("GET", "/api/live/restores/{restore_id}"): VIEWER,
    ("POST", "/api/live/restores/{restore_id}/confirm"): TECHNICIAN,
    ("POST", "/api/live/restores/{restore_id}/unproven"): TECHNICIAN,
    ("POST", "/api/live/restores/{restore_id}/roll-back"): TECHNICIAN,
    ("POST", "/api/live/restores/{restore_id}/resume"): TECHNICIAN,
    ("POST", "/api/live/restores/{restore_id}/give-up"): EXPERT,
    ("GET", "/api/records/{record_file}"): VIEWER,
    # faults in our own twins
    ("GET", "/api/instructor"): VIEWER,
    ("GET", "/api/instructor/catalogue"): VIEWER,
    ("GET", "/api/instructor/scenarios"): VIEWER,
    ("POST", "/api/instructor/faults"): TECHNICIAN,
    ("DELETE", "/api/instructor/faults"): TECHNICIAN,
    ("DELETE", "/api/instructor/faults/{fault}"): TECHNICIAN,
    ("POST", "/api/instructor/play"): TECHNICIAN,
    ("POST", "/api/instructor/stop"): TECHNICIAN,
    # settings
    ("GET", "/api/settings/about"): VIEWER,
    ("GET", "/api/settings/adapters"): VIEWER,
    ("POST", "/api/settings/adapters/test"): TECHNICIAN,
    ("POST", "/api/settings/adapters/bitrate"): TECHNICIAN,
    ("POST", "/api/settings/scan"): TECHNICIAN,
    ("POST", "/api/settings/identify"): TECHNICIAN,
    ("GET", "/api/settings/jobs/{job_id}"): VIEWER,
    ("GET", "/api/settings/site"): VIEWER,
    ("POST", "/api/settings/site/turbines"): TECHNICIAN,
    ("PUT", "/api/settings/site/turbines/{slug}"): TECHNICIAN,
    ("DELETE", "/api/settings/site/turbines/{slug}"): TECHNICIAN,
    ("GET", "/api/settings/polling"): VIEWER,
    ("PUT", "/api/settings/polling"): TECHNICIAN,
    ("GET", "/api/settings/polling/choices/{description_id}"): VIEWER,
    # sockets, the 3D view, the page
    (SOCKET, "/api/ws"): VIEWER,
    (SOCKET, "/viser"): VIEWER,
    (SOCKET, "/viser/"): VIEWER,
    (SOCKET, "/viser/replay/{replay_id}"): VIEWER,
    (SOCKET, "/viser/replay/{replay_id}/"): VIEWER,
    ("GET", "/viser/replay/{replay_id}"): VIEWER,
    ("GET", "/viser/replay/{replay_id}/{path:path}"): VIEWER,
    ("GET", "/viser"): VIEWER,
    ("GET", "/viser/{path:path}"): VIEWER,
    ("GET", "/i/{code}"): VIEWER,
    ("GET", "/{path:path}"): VIEWER,
}
"""The least role of every route."""

WITHOUT_LOGIN: Final = {
    ("GET", "/api/texts/{locale}"),
    ("POST", "/api/login"),
    ("GET", "/i/{code}"),
    ("GET", "/{path:path}"),
}
"""What a login page needs: open once there are users, and only then."""

BODIES: Final[dict[tuple[str, str], dict[str, Any]]] = {
    ("POST", "/api/users"): {"name": "Zoe", "password": "never to be made", "role": "viewer"},
}
"""Bodies of routes that look at the role only when they understood the request; all others are refused before."""

BRINGS_BYTES: Final = {("POST", "/api/recordings/import"), ("POST", "/api/incidents/import")}
"""To these a file is sent as it is."""

PLACES: Final = {
    "{run_id}": "0197a000-0000-7000-8000-000000000001",
    "{turbine}": "wtg-07",
    "{station}": "blade-1",
    "{device}": "pmc",
    "{description_id}": "oat-pmc",
    "{slug}": "wtg-99",
    "{locale}": "en",
    "{path:path}": "index.html",
    "{motor_id}": "0197a000-0000-7000-8000-00000000e001",
    "{user_id}": "0197a000-0000-7000-8000-000000000000",
    "{job_id}": "none",
    "{fault}": "1",
    "{record_file}": "none.json",
    "{capture_id}": "0197a000-0000-7000-8000-00000000ca97",
    "{restore_id}": "0197a000-0000-7000-8000-000000000000",
    "{name}": "none.mcap",
    "{replay_id}": "none",
    "{key}": "none",
    "{annotation_id}": "none",
    "{code}": "none",
}

PEOPLE: Final = {
    EXPERT: {"name": "Eva", "password": "blade and hub 12"},
    TECHNICIAN: {"name": "Tom", "password": "pitch and yaw 34"},
    VIEWER: {"name": "Vera", "password": "wind and rain 56"},
}


@pytest.fixture(scope="module")
def scene() -> Iterator[HubScene]:
    """A 3D server, so that its routes are there."""
    started = HubScene("s" * 32)
    yield started
    started.close()


def real_routes(scene: HubScene) -> set[tuple[str, str]]:
    """Method and path of every route of the application."""
    bench = bench_with(make_connection())
    guard = create_app(bench, Access(bench.office.sessions, 1), 1, scene)
    found = set()
    for route in iter_route_contexts(guard.app.routes):  # type: ignore[attr-defined]
        methods = getattr(route, "methods", None) or {SOCKET}
        found |= {(method, str(route.path)) for method in methods}
    return found


def path_of(route: tuple[str, str]) -> str:
    path = route[1]
    for name, place in PLACES.items():
        path = path.replace(name, place)
    assert "{" not in path, f"{route}: say in PLACES what to put there"
    return path


async def ask(client: httpx.AsyncClient, route: tuple[str, str], **headers: str) -> httpx.Response:
    """Ask as our own page does, but for ``headers``."""
    body = BODIES.get(route, {}) if route[0] in ("POST", "PUT", "PATCH") else None
    named = {name.replace("_", "-"): text for name, text in headers.items()}
    if route in BRINGS_BYTES:
        named.setdefault("Content-Type", "application/octet-stream")
        return await client.request(route[0], path_of(route), content=b"", headers=named)
    return await client.request(route[0], path_of(route), json=body, headers=named)


def http_routes() -> list[tuple[str, str]]:
    return [route for route in ROUTES if route[0] != SOCKET]


def socket_paths() -> list[str]:
    return [path for method, path in ROUTES if method == SOCKET]


@dataclass
class Staffed:
    """A server with one user of each role, and a client of each."""

    server: Server
    clients: dict[Role, httpx.AsyncClient]


@pytest.fixture
async def fresh(scene: HubScene) -> AsyncIterator[Server]:
    """No users yet: the launch address is the only way in."""
    async with running(scene=scene) as server:
        yield server


@pytest.fixture
async def staffed(scene: HubScene) -> AsyncIterator[Staffed]:
    """Users exist."""
    async with running(scene=scene, store=Store.in_memory()) as server:
        clients = {role: httpx.AsyncClient(base_url=server.origin, trust_env=False, timeout=30) for role in PEOPLE}
        maker = server.client
        for role, who in PEOPLE.items():
            made = await maker.post("/api/users", json=who | {"role": role.value})
            assert made.status_code == 200, made.text
            answer = await clients[role].post("/api/login", json=who)
            assert answer.status_code == 200, answer.text
            maker = clients[EXPERT]
        yield Staffed(server, clients)
        for client in clients.values():
            await client.aclose()


def test_every_route_is_in_the_table(scene: HubScene) -> None:
    real = real_routes(scene)
    assert real - ROUTES.keys() == set(), "say in ROUTES which role these need"
    assert ROUTES.keys() - real == set(), "these are gone"
    assert ROUTES.keys() >= WITHOUT_LOGIN


async def test_without_a_session_nothing_is_answered(fresh: Server) -> None:
    for route in http_routes():
        answer = await ask(fresh.stranger, route)
        assert (answer.status_code, answer.json()["code"]) == (401, "unauthorised"), route
    for path in socket_paths():
        assert await denied(fresh.socket(path, additional_headers={})) == 401, path


async def test_once_there_are_users_only_what_the_login_page_needs_is_open(staffed: Staffed) -> None:
    for route in http_routes():
        answer = await ask(staffed.server.stranger, route)
        if route in WITHOUT_LOGIN:
            assert answer.status_code not in (401, 403), route
        else:
            assert (answer.status_code, answer.json()["code"]) == (401, "login_needed"), route
    for path in socket_paths():
        assert await denied(staffed.server.socket(path, additional_headers={})) == 401, path


async def test_a_launch_session_from_before_the_first_user_is_worth_nothing(staffed: Staffed) -> None:
    for route in set(http_routes()) - WITHOUT_LOGIN:
        assert (await ask(staffed.server.client, route)).status_code == 401, route
    for path in socket_paths():
        assert await denied(staffed.server.socket(path)) == 401, path


async def test_too_low_a_role_is_refused(staffed: Staffed) -> None:
    for route, needed in ROUTES.items():
        for role, client in staffed.clients.items():
            if not role.covers(needed):
                answer = await ask(client, route)
                assert (answer.status_code, answer.json()["code"]) == (403, "role"), (route, role)
    users = (await staffed.clients[EXPERT].get("/api/users")).json()
    assert "Zoe" not in str(users)


async def test_the_role_that_is_needed_is_let_in(staffed: Staffed) -> None:
    ending = ("POST", "/api/logout")
    for route in [route for route in http_routes() if route != ending] + [ending]:
        answer = await ask(staffed.clients[ROUTES[route]], route)
        assert answer.status_code not in (401, 403), (route, answer.text)


async def test_pages_of_other_origins_are_refused(fresh: Server) -> None:
    for route in http_routes():
        for origin in ("https://evil.example", f"http://localhost:{fresh.port}", "null"):
            answer = await ask(fresh.client, route, Origin=origin)
            assert (answer.status_code, answer.json()["code"]) == (403, "forbidden_host"), (route, origin)
        for site in ("cross-site", "same-site"):
            answer = await ask(fresh.client, route, Sec_Fetch_Site=site)
            assert (answer.status_code, answer.json()["code"]) == (403, "forbidden_host"), (route, site)
    for path in socket_paths():
        for foreign in ("https://evil.example", f"http://localhost:{fresh.port}", "null", None):
            assert await denied(fresh.socket(path, origin=foreign)) == 403, (path, foreign)


async def test_other_names_of_the_host_are_refused(fresh: Server) -> None:
    for called in ("evil.example", f"evil.example:{fresh.port}", "127.0.0.1", "127.0.0.1:1"):
        for route in http_routes():
            answer = await ask(fresh.client, route, Host=called)
            assert (answer.status_code, answer.json()["code"]) == (403, "forbidden_host"), (route, called)
        for path in socket_paths():
            socket = fresh.socket(path, called=called, origin=f"http://{called}")
            assert await denied(socket) == 403, (path, called)


async def test_forms_of_other_pages_are_refused(fresh: Server) -> None:
    """What a page may send without asking first: a form, or text."""
    for method, path in http_routes():
        if method in ("POST", "PUT", "PATCH"):
            for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x"):
                answer = await fresh.client.request(
                    method, path_of((method, path)), content=b"{}", headers={"Content-Type": kind}
                )
                assert (answer.status_code, answer.json()["code"]) == (422, "invalid"), (path, kind)
