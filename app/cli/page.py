"""The page's server, as a command runs it. To be imported late: its libraries take some time to load."""

from __future__ import annotations

import argparse
import asyncio
import secrets
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from urllib.parse import urlencode

from app.errors import UsageError
from app.scene.hub import HubScene
from app.service.bench import Bench
from app.web.access import Access
from app.web.app import create_app, warm_up
from app.web.listen import Listen, Tls, parse_listen
from app.web.serve import open_port, port_of, serve


@asynccontextmanager
async def serve_page(arguments: argparse.Namespace, bench: Bench) -> AsyncIterator[str]:
    """Serve the page while the block runs; gives the address to open. Raises UsageError where it cannot be served.

    The address holds a launch token while there are no users.
    """
    listen = listen_of(arguments)
    sessions = bench.office.sessions
    listen.check(sessions.login_needed)
    listener = open_port(listen.port, str(listen.address))
    at = port_of(listener)
    reach = listen.reach(at)
    access = Access(sessions, at, reach.secure)
    scene = await asyncio.to_thread(HubScene, secrets.token_urlsafe(32))
    try:
        application = create_app(bench, access, at, scene, arguments.settings.language, reach=reach)
        await asyncio.to_thread(warm_up, application)
        async with serve(application, listener, listen.tls):
            query = {} if sessions.login_needed else {"token": access.issue_token()}
            first = next(iter(bench.options.more_recordings), None)
            if first is not None:
                query["replay"] = first.stem
            yield f"{listen.url(at)}?{urlencode(query)}" if query else listen.url(at)
    finally:
        await asyncio.to_thread(scene.close)


def listen_of(arguments: argparse.Namespace) -> Listen:
    """Where to serve: ``--listen``, else the loopback address. Raises UsageError."""
    certificate, key = arguments.tls_cert, arguments.tls_key
    if (certificate is None) != (key is None):
        raise UsageError(reason="--tls-cert and --tls-key belong together")
    tls = None if certificate is None else Tls(certificate, key)
    if arguments.listen is None:
        return Listen(port=arguments.port, tls=tls, names=tuple(arguments.host))
    address, port = parse_listen(arguments.listen, arguments.port)
    return Listen(address, port, tls, tuple(arguments.host))
