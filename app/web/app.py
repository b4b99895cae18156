"""The server's application: guard, API, socket, 3D proxy, page."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from fastapi import FastAPI, Request, Response, WebSocket

from app import __version__
from app.model.roles import SignedIn
from app.model.texts import LANGUAGES, load_texts
from app.scene.hub import HubScene
from app.service.bench import Bench
from app.service.indexing import Indexing
from app.service.instructor import watched
from app.service.jobs import Jobs
from app.service.replay.replays import Replays
from app.service.replay_scenes import ReplayScenes
from app.service.scene_feed import run_scene
from app.service.shown import LiveShown
from app.web import problem
from app.web.access import Access
from app.web.guard import LOOPBACK_NAMES, SIGNED_IN, Guard, Reach
from app.web.problem import NotFoundError
from app.web.routes import api_router, incidents
from app.web.socket import serve_client
from app.web.static import PageFiles, page_folder
from app.web.urgent import Presses
from app.web.viser_proxy import viser_router


def create_app(
    bench: Bench,
    access: Access,
    port: int,
    scene: HubScene | None = None,
    language: str = "en",
    page: Path | None = None,
    reach: Reach | None = None,
) -> Guard:
    """The guarded application. ``port`` is the one that it will listen on; ``page`` is the folder of the built page.

    ``reach`` None: the loopback address alone.
    """
    app = create_api(bench, scene, language)
    app.state.access = access
    files = PageFiles(page or page_folder())
    replays: Replays = app.state.replays
    presses: Presses = app.state.presses

    @app.websocket("/api/ws")
    async def socket(websocket: WebSocket) -> None:
        person: SignedIn = websocket.scope[SIGNED_IN]
        commands = presses.of(bench, person.person)
        await serve_client(websocket, LiveShown(bench), replays, time.monotonic, lambda: bench.motion, commands)

    app.include_router(incidents.links)
    if scene is not None:
        app.include_router(viser_router(scene, app.state.replay_scenes))

    @app.get("/{path:path}", include_in_schema=False)
    async def page_file(request: Request, path: str) -> Response:
        answer = None if path.startswith(("api/", "viser")) else files.answer(request, path)
        if answer is None:
            raise NotFoundError(what=request.url.path)
        return answer

    reach = reach or Reach.of(LOOPBACK_NAMES, port, False)
    return Guard(app, access, reach, load_texts(language)("error.unauthorised"))


def warm_up(application: Guard) -> None:
    """Do now what the first requests would do in the event loop: FastAPI works routes out when they are looked up.

    A STOP that is pressed right after the start must not wait for that. Blocks for some 0.3 s; for a thread.
    """
    routes = application.app.router.routes if isinstance(application.app, FastAPI) else []
    for route in routes:
        route.matches({"type": "http", "method": "GET", "path": "/api/-", "root_path": "", "headers": []})
    for language in LANGUAGES:
        load_texts(language)


def create_api(bench: Bench | None, scene: HubScene | None = None, language: str = "en") -> FastAPI:
    """The HTTP API alone; ``bench`` None serves only to write down the API's types."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        app.state.jobs = Jobs()
        live = None if bench is None else LiveShown(bench)
        desk = None if bench is None else bench.desk
        async with (
            run_scene(live, scene),
            watched(desk),
            app.state.replays.running(),
            app.state.replay_scenes.running(),
        ):
            yield
        await app.state.jobs.close()

    app = FastAPI(
        title="Hubside",
        version=__version__,
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        openapi_url=None,
        generate_unique_id_function=lambda route: route.name,
    )
    app.state.bench = bench
    app.state.replays = _replays(bench)
    app.state.presses = Presses()
    app.state.replay_scenes = ReplayScenes(app.state.replays.shown)
    app.state.language = language
    app.include_router(api_router())
    problem.install(app)
    return app


def _replays(bench: Bench | None) -> Replays:
    """Replays with the names of the turbines that the bench knows; indexes lie in its data folder."""
    if bench is None:
        return Replays(dict, Indexing())
    data = bench.options.data
    return Replays(lambda: bench.sites.turbines, bench.indexing, None if data is None else data / "indexes")
