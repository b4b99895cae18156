"""The page's server, as a command runs it. To be imported late: its libraries take some time to load."""

from __future__ import annotations

import argparse
import asyncio
import secrets
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from app.scene.hub import HubScene
from app.service.bench import Bench
from app.web.access import Access
from app.web.app import create_app
from app.web.serve import launch_url, open_port, port_of, serve


@asynccontextmanager
async def serve_page(arguments: argparse.Namespace, bench: Bench) -> AsyncIterator[str]:
    """Serve the page while the block runs; gives the address to open. Raises UsageError where the port is taken."""
    listener = open_port(arguments.port)
    at = port_of(listener)
    access = Access(bench.office.sessions, at)
    scene = await asyncio.to_thread(HubScene, secrets.token_urlsafe(32))
    try:
        application = create_app(bench, access, at, scene, arguments.settings.language)
        async with serve(application, listener):
            yield launch_url(at, access.issue_token())
    finally:
        await asyncio.to_thread(scene.close)
