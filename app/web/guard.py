"""The guard before everything: pure ASGI, so that HTTP and WebSocket pass the same checks.

1. Host is a loopback name with our very port: no foreign name may be pointed at us (DNS rebinding).
2. Origin, where present, is ours; a WebSocket must have one, for the browser's same-origin rule does not cover it.
3. A request that another site's page makes (Sec-Fetch-Site) is refused, but for opening the page itself.
4. A session by cookie; ``/?token=...`` opens one and is the only thing that works without.
5. A body is JSON and says so: a form or text/plain needs no preflight, so a foreign page could send it.
6. A body is small: a larger one is refused unread, or as soon as it turns out to be larger than it said.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Awaitable, Callable, MutableMapping
from html import escape
from typing import Any, Final
from urllib.parse import parse_qs

from app.errors import HubsideError
from app.model.roles import SignedIn
from app.web.access import SESSION_S, Access
from app.web.problem import (
    MEDIA_TYPE,
    ForbiddenHostError,
    InvalidRequestError,
    TooLargeError,
    UnauthorisedError,
    problem_of,
)

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]
Headers = list[tuple[bytes, bytes]]

SIGNED_IN: Final = "hubside.signed_in"
"""Key of the scope under which an application finds who asks (``SignedIn``)."""
LOOPBACK_NAMES: Final = ("127.0.0.1", "localhost", "[::1]")
VISER_PATH: Final = "/viser"
MAX_BODY: Final = 65_536
"""Of a request, in bytes: the longest list of addresses and the longest value fit."""
_WITH_BODY: Final = ("POST", "PUT", "PATCH")
_FOREIGN: Final = ("cross-site", "same-site")
_COMMON: Final = "default-src 'self'; base-uri 'none'; form-action 'none'; object-src 'none'"


class Guard:
    """Wraps ``app``. ``port`` is ours; ``sign_in_text`` is told to a person who comes without a session.

    ``person`` is who a launch token lets in.
    """

    def __init__(self, app: App, access: Access, port: int, sign_in_text: str, person: SignedIn) -> None:
        self._app = app
        self._access = access
        self._hosts = frozenset(f"{name}:{port}" for name in LOOPBACK_NAMES)
        self._sign_in_text = sign_in_text
        self._person = person
        # Cookies are shared by all ports of a host: a second bench on another port must not end our session.
        self._cookie = f"hubside_{port}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """ASGI."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = _headers(scope)
        refusal = self._refusal(scope, headers)
        if refusal is not None:
            await _refuse(scope, headers, send, refusal)
        elif self._has_session(headers):
            scope[SIGNED_IN] = self._person
            await self._pass(scope, receive, send, headers)
        elif session := self._new_session(scope):
            await _redirect(send, self._set_cookie(session))
        else:
            await _refuse(scope, headers, send, UnauthorisedError(), self._sign_in_text)

    # -- checks ------------------------------------------------------------------

    def _refusal(self, scope: Scope, headers: dict[str, str]) -> HubsideError | None:
        """What is wrong with the request itself, whoever sent it."""
        host, origin = headers.get("host", ""), headers.get("origin")
        if host not in self._hosts:
            return ForbiddenHostError(host=host, origin=origin)
        socket = scope["type"] == "websocket"
        if (origin is None and socket) or (origin is not None and origin != f"http://{host}"):
            return ForbiddenHostError(host=host, origin=origin)
        method = scope.get("method", "GET")
        opens_page = not socket and method == "GET" and headers.get("sec-fetch-dest") == "document"
        if headers.get("sec-fetch-site") in _FOREIGN and not opens_page:
            return ForbiddenHostError(host=host, origin=headers["sec-fetch-site"])
        if method in _WITH_BODY and _media_type(headers) != "application/json":
            return InvalidRequestError(reason=f"Content-Type '{_media_type(headers)}' is not application/json")
        length = headers.get("content-length", "")
        if length.isdecimal() and int(length) > MAX_BODY:
            return _too_large()
        return None

    def _has_session(self, headers: dict[str, str]) -> bool:
        for part in headers.get("cookie", "").split(";"):
            name, _, secret = part.strip().partition("=")
            if name == self._cookie and self._access.holds(secret):
                return True
        return False

    def _new_session(self, scope: Scope) -> str | None:
        token = _token(scope)
        return None if token is None else self._access.open_session(token)

    def _set_cookie(self, session: str) -> str:
        return f"{self._cookie}={session}; Path=/; Max-Age={SESSION_S}; HttpOnly; SameSite=Strict"

    # -- passing -----------------------------------------------------------------

    async def _pass(self, scope: Scope, receive: Receive, send: Send, headers: dict[str, str]) -> None:
        if _token(scope) is not None:
            await _redirect(send)  # opened again with a session: the token must leave the address bar
            return
        extra = security_headers(str(scope["path"]), headers["host"])

        async def secured(message: Message) -> None:
            if message["type"] == "http.response.start":
                given = {name.lower() for name, _ in message.get("headers", [])}
                added = [header for header in extra if header[0] not in given]
                message = {**message, "headers": [*message.get("headers", []), *added]}
            await send(message)

        if scope.get("method") not in _WITH_BODY:
            await self._app(scope, receive, secured)
            return
        body = await _body(receive)
        if body is None:
            await _refuse(scope, headers, send, _too_large())
        else:
            await self._app(scope, _given(body, receive), secured)


async def _body(receive: Receive) -> list[Message] | None:
    """A request's messages up to the end of its body, or until it is gone; None where the body is too large."""
    messages: list[Message] = []
    size = 0
    while True:
        message = await receive()
        messages.append(message)
        size += len(message.get("body", b""))
        if size > MAX_BODY:
            return None
        if not message.get("more_body", False):
            return messages


def _given(messages: list[Message], receive: Receive) -> Receive:
    """``receive`` that gives ``messages`` first."""
    waiting = deque(messages)

    async def next_one() -> Message:
        return waiting.popleft() if waiting else await receive()

    return next_one


def _too_large() -> TooLargeError:
    return TooLargeError(reason=f"the body is larger than {MAX_BODY} bytes")


def security_headers(path: str, host: str) -> Headers:
    """The headers of every answer under ``path``. The 3D client is one page of inline code, so it has rules of its own.

    ``host`` is named because not every browser counts ws: to 'self'.
    """
    scene = path == VISER_PATH or path.startswith(f"{VISER_PATH}/")
    connect = f"connect-src 'self' ws://{host}"
    if scene:
        # Its WebAssembly decoder and its worker are inline too; the worker inherits these rules.
        policy = (
            f"{_COMMON}; {connect} blob: data:; script-src 'unsafe-inline' 'wasm-unsafe-eval' blob:; "
            "style-src 'unsafe-inline'; worker-src blob:; img-src 'self' blob: data:; font-src data:; "
            "frame-ancestors 'self'"
        )
    else:
        # Mantine sets styles on elements and in style tags that it makes.
        policy = f"{_COMMON}; {connect}; style-src 'self' 'unsafe-inline'; img-src 'self' data:; frame-ancestors 'none'"
    headers = {
        "content-security-policy": policy,
        "x-content-type-options": "nosniff",
        "referrer-policy": "no-referrer",
        "cross-origin-opener-policy": "same-origin",
        "cross-origin-resource-policy": "same-origin",
        "cache-control": "no-store",
    }
    return [(name.encode(), text.encode()) for name, text in headers.items()]


def _headers(scope: Scope) -> dict[str, str]:
    """Header fields by name. One that comes twice is joined, so that neither can hide behind the other."""
    found: dict[str, str] = {}
    for name, text in scope["headers"]:
        key, value = name.decode("latin-1").lower(), text.decode("latin-1")
        joint = "; " if key == "cookie" else ", "
        found[key] = f"{found[key]}{joint}{value}" if key in found else value
    return found


def _media_type(headers: dict[str, str]) -> str:
    return headers.get("content-type", "").partition(";")[0].strip().lower()


def _token(scope: Scope) -> str | None:
    if scope["type"] != "http" or scope["method"] != "GET" or scope["path"] != "/":
        return None
    return next(iter(parse_qs(scope["query_string"].decode("latin-1")).get("token", [])), None)


async def _redirect(send: Send, cookie: str | None = None) -> None:
    headers: Headers = [(b"location", b"/"), (b"cache-control", b"no-store"), (b"referrer-policy", b"no-referrer")]
    if cookie is not None:
        headers.append((b"set-cookie", cookie.encode()))
    await _answer(send, "http", 303, headers, b"")


async def _refuse(
    scope: Scope, headers: dict[str, str], send: Send, error: HubsideError, page_text: str | None = None
) -> None:
    """A problem document; a person who opens the page gets ``page_text`` in plain HTML."""
    problem = problem_of(error)
    if page_text is not None and scope["type"] == "http" and "text/html" in headers.get("accept", ""):
        kind, body = "text/html; charset=utf-8", _page(page_text)
    else:
        kind, body = MEDIA_TYPE, problem.model_dump_json().encode()
    fields: Headers = [
        (b"content-type", kind.encode()),
        (b"content-length", str(len(body)).encode()),
        (b"cache-control", b"no-store"),
        (b"x-content-type-options", b"nosniff"),
        (b"content-security-policy", b"default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'self'"),
    ]
    await _answer(send, scope["type"], problem.status, fields, body)


async def _answer(send: Send, scope_type: str, status: int, headers: Headers, body: bytes) -> None:
    """An HTTP answer; a WebSocket is denied by one, before it is opened (ASGI websocket.http.response)."""
    prefix = "websocket.http.response" if scope_type == "websocket" else "http.response"
    await send({"type": f"{prefix}.start", "status": status, "headers": headers})
    await send({"type": f"{prefix}.body", "body": body})


def _page(text: str) -> bytes:
    style = (
        "body{font:18px/1.5 system-ui,sans-serif;max-width:36em;margin:15vh auto;padding:0 1em;color-scheme:dark light}"
    )
    return (
        f"<!doctype html><meta charset=utf-8><title>Hubside</title>"
        f"<style>:root{{color-scheme:dark light}}{style}</style>"
        f"<h1>Hubside</h1><p>{escape(text)}</p>"
    ).encode()
