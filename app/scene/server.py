"""The 3D server: viser on a free loopback port that answers only to our proxy.

viser accepts any origin and can open a public tunnel ("share"). Here every request must carry a secret header that only
the proxy knows, and the share messages have no handler.
"""

from __future__ import annotations

import hmac
import http
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

import rich
import viser
import viser._messages as viser_messages
import websockets.asyncio.server
from websockets import Headers
from websockets.http11 import Request, Response

SECRET_HEADER: Final = "X-Hubside-Scene"
_patching = threading.Lock()


def start_server(secret: str) -> viser.ViserServer:
    """A viser server on 127.0.0.1 and a port of the system's choice; requests without ``secret`` get 403."""
    # viser prints its own address at every start, which only our proxy may open.
    rich.get_console().quiet = True
    with _patching, _guarded(secret):
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    for message in (viser_messages.ShareUrlRequest, viser_messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(message)
    server.gui.configure_theme(show_share_button=False, show_logo=False, dark_mode=False)
    return server


@contextmanager
def _guarded(secret: str) -> Iterator[None]:
    """While viser starts its listener, put our check before its own request handler.

    viser offers no hook for this, so the function that it calls to listen is wrapped for the time of the call; a test
    holds that a request without the secret is refused.
    """
    original: Any = websockets.asyncio.server.serve

    def serve(*args: Any, process_request: Callable[[Any, Request], Response | None], **options: Any) -> Any:
        def check(connection: Any, request: Request) -> Response | None:
            given = request.headers.get(SECRET_HEADER, "")
            if not hmac.compare_digest(given.encode(), secret.encode()):
                return Response(http.HTTPStatus.FORBIDDEN, "FORBIDDEN", Headers())
            return process_request(connection, request)

        return original(*args, process_request=check, **options)

    websockets.asyncio.server.serve = serve  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = original  # type: ignore[misc]
