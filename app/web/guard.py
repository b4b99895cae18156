"""The guard before everything: pure ASGI, so that HTTP and WebSocket pass the same checks.

1. Host is a loopback name with our very port: no foreign name may be pointed at us (DNS rebinding).
2. Origin, where present, is ours; a WebSocket must have one, for the browser's same-origin rule does not cover it.
3. A request that another site's page makes (Sec-Fetch-Site) is refused, but for opening the page itself.
4. A session by cookie. While there are no users, ``/?token=...`` opens one and is the only thing that works without;
   from the first user on it is a login: the page's own files, its texts and ``POST /api/login`` work without.
5. A body is JSON and says so: a form or text/plain needs no preflight, so a foreign page could send it.
6. A body is small: a larger one is refused unread, or as soon as it turns out to be larger than it said.
7. A socket lives no longer than its session.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from dataclasses import dataclass
from html import escape
from typing import Any, Final
from urllib.parse import parse_qs, urlencode

from app.errors import HubsideError, LoginNeededError
from app.service.office.sessions import Session
from app.web.access import Access
from app.web.problem import (
    MEDIA_TYPE,
    ForbiddenHostError,
    InvalidRequestError,
    TooLargeError,
    UnauthorisedError,
    problem_of,
    texts_for,
)

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]
Headers = list[tuple[bytes, bytes]]

SIGNED_IN: Final = "hubside.signed_in"
"""Key of the scope under which an application finds who asks (``SignedIn``)."""
SESSION: Final = "hubside.session"
"""Key of the scope under which an application finds the session of who asks (``Session``)."""
LOOPBACK_NAMES: Final = ("127.0.0.1", "localhost", "[::1]")
VISER_PATH: Final = "/viser"
LOGIN_PATH: Final = "/api/login"
TEXTS_PATH: Final = "/api/texts/"
SIGNED_OUT: Final = 4401
"""Code with which a socket is closed whose session has ended (4000 to 4999 are for applications, RFC 6455, 7.4.2)."""
MAX_BODY: Final = 65_536
"""Of a request, in bytes: the longest list of addresses and the longest value fit."""
MAX_FILE: Final = 12 * 1024 * 1024
"""Of a request that brings a file, in bytes."""
_BRINGS_FILE: Final = ("/api/sets/import",)
MAX_RECORDING: Final = 4 << 30
"""Of a request that brings a recording, in bytes: eight full parts."""
_STREAMED: Final = ("/api/recordings/import", "/api/incidents/import")
"""Bring a recording or a bundle, which the route counts while it goes to the disk."""
_OCTETS: Final = "application/octet-stream"
_WITH_BODY: Final = ("POST", "PUT", "PATCH")
_FOREIGN: Final = ("cross-site", "same-site")
_COMMON: Final = "default-src 'self'; base-uri 'none'; form-action 'none'; object-src 'none'"


@dataclass(frozen=True, slots=True)
class Reach:
    """Under which names the server is reached, each with its port, and whether by TLS."""

    hosts: frozenset[str]
    secure: bool = False

    @classmethod
    def of(cls, names: Iterable[str], port: int, secure: bool) -> Reach:
        """``names`` on ``port``. Browsers leave the usual port of a scheme away."""
        hosts = {f"{name}:{port}" for name in names}
        if port == (443 if secure else 80):
            hosts |= set(names)
        return cls(frozenset(hosts), secure)

    @property
    def scheme(self) -> str:
        """Of the page."""
        return "https" if self.secure else "http"


class Guard:
    """Wraps ``app``. ``sign_in_text`` is told to a person who comes without a session where only a token opens one."""

    def __init__(self, app: App, access: Access, reach: Reach, sign_in_text: str) -> None:
        self.app = app
        self._access = access
        self._reach = reach
        self._sign_in_text = sign_in_text

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """ASGI."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = _headers(scope)
        refusal = self._refusal(scope, headers)
        session = None if refusal is not None else self._access.find(headers.get("cookie", ""))
        if refusal is not None:
            await _refuse(scope, headers, send, refusal)
        elif session is not None:
            scope[SESSION], scope[SIGNED_IN] = session, self._access.who(session)
            await self._pass_session(session, scope, receive, send, headers)
        elif self._access.sessions.login_needed:
            if _is_open(scope):
                await self._pass(scope, receive, send, headers)
            else:
                await _refuse(scope, headers, send, LoginNeededError())
        elif secret := await self._launched(scope):
            await _redirect(send, _landing(scope), self._access.cookie(secret))
        else:
            await _refuse(scope, headers, send, UnauthorisedError(), self._sign_in_text)

    # -- checks ------------------------------------------------------------------

    def _refusal(self, scope: Scope, headers: dict[str, str]) -> HubsideError | None:
        """What is wrong with the request itself, whoever sent it."""
        host, origin = headers.get("host", ""), headers.get("origin")
        if host not in self._reach.hosts:
            return ForbiddenHostError(host=host, origin=origin)
        socket = scope["type"] == "websocket"
        if (origin is None and socket) or (origin is not None and origin != f"{self._reach.scheme}://{host}"):
            return ForbiddenHostError(host=host, origin=origin)
        method = scope.get("method", "GET")
        opens_page = not socket and method == "GET" and headers.get("sec-fetch-dest") == "document"
        if headers.get("sec-fetch-site") in _FOREIGN and not opens_page:
            return ForbiddenHostError(host=host, origin=headers["sec-fetch-site"])
        # A foreign page can send neither of them without asking first.
        wanted = _OCTETS if scope["path"] in _STREAMED else "application/json"
        if method in _WITH_BODY and _media_type(headers) != wanted:
            return InvalidRequestError(reason=f"Content-Type '{_media_type(headers)}' is not {wanted}")
        length = headers.get("content-length", "")
        most = largest_body(str(scope["path"]))
        if length.isdecimal() and int(length) > most:
            return _too_large(most)
        return None

    async def _launched(self, scope: Scope) -> str | None:
        token = _token(scope)
        return None if token is None else await self._access.sessions.launch(token)

    # -- passing -----------------------------------------------------------------

    async def _pass_session(
        self, session: Session, scope: Scope, receive: Receive, send: Send, headers: dict[str, str]
    ) -> None:
        if scope["type"] != "websocket":
            await self._pass(scope, receive, send, headers)
            return
        leash = Leash(session, self._access.sessions.left_s(session), receive, send)
        try:
            await self._pass(scope, leash.receive, leash.send, headers)
        finally:
            leash.end()

    async def _pass(self, scope: Scope, receive: Receive, send: Send, headers: dict[str, str]) -> None:
        if _token(scope) is not None:
            # Opened again, or where it opens nothing any more: it must leave the address bar.
            await _redirect(send, _landing(scope))
            return
        extra = security_headers(str(scope["path"]), headers["host"], self._reach.secure)

        async def secured(message: Message) -> None:
            if message["type"] == "http.response.start":
                given = {name.lower() for name, _ in message.get("headers", [])}
                added = [header for header in extra if header[0] not in given]
                message = {**message, "headers": [*message.get("headers", []), *added]}
            await send(message)

        if scope.get("method") not in _WITH_BODY or scope["path"] in _STREAMED:
            await self.app(scope, receive, secured)
            return
        most = largest_body(str(scope["path"]))
        body = await _body(receive, most)
        if body is None:
            await _refuse(scope, headers, send, _too_large(most))
        else:
            await self.app(scope, _given(body, receive), secured)


class Leash:
    """Closes a socket when its session ends, or after ``left_s`` seconds. For one use of ``receive`` at a time."""

    def __init__(self, session: Session, left_s: float, receive: Receive, send: Send) -> None:
        self._receive = receive
        self._send = send
        self._coming: asyncio.Task[Message] | None = None
        self._closed = False
        self._ended = asyncio.create_task(_ended(session, left_s))

    async def receive(self) -> Message:
        """The next message of the client; that it went away, where its session ended."""
        if self._coming is None:
            self._coming = asyncio.create_task(_next(self._receive))
        await asyncio.wait({self._coming, self._ended}, return_when=asyncio.FIRST_COMPLETED)
        if self._ended.done():
            if not self._closed:
                self._closed = True
                await self._send({"type": "websocket.close", "code": SIGNED_OUT, "reason": "signed out"})
            return {"type": "websocket.disconnect", "code": SIGNED_OUT}
        coming, self._coming = self._coming, None
        return coming.result()

    async def send(self, message: Message) -> None:
        """To the client, unless the socket was closed for it."""
        if not self._closed and not self._ended.done():
            await self._send(message)

    def end(self) -> None:
        """The application is done."""
        self._ended.cancel()
        if self._coming is not None:
            self._coming.cancel()


async def _ended(session: Session, left_s: float) -> None:
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(left_s):
            await session.ended.wait()


async def _next(receive: Receive) -> Message:
    return await receive()


def _is_open(scope: Scope) -> bool:
    """True for what a login page needs before anybody has logged in."""
    if scope["type"] != "http":
        return False
    path, method = str(scope["path"]), scope["method"]
    if path == LOGIN_PATH:
        return bool(method == "POST")
    served = path.startswith(TEXTS_PATH) or not path.startswith(("/api", VISER_PATH))
    return served and method in ("GET", "HEAD")


def largest_body(path: str) -> int:
    """How many bytes a request to ``path`` may bring."""
    if path in _STREAMED:
        return MAX_RECORDING
    return MAX_FILE if path in _BRINGS_FILE else MAX_BODY


async def _body(receive: Receive, most: int) -> list[Message] | None:
    """A request's messages up to the end of its body, or until it is gone; None where the body is too large."""
    messages: list[Message] = []
    size = 0
    while True:
        message = await receive()
        messages.append(message)
        size += len(message.get("body", b""))
        if size > most:
            return None
        if not message.get("more_body", False):
            return messages


def _given(messages: list[Message], receive: Receive) -> Receive:
    """``receive`` that gives ``messages`` first."""
    waiting = deque(messages)

    async def next_one() -> Message:
        return waiting.popleft() if waiting else await receive()

    return next_one


def _too_large(most: int) -> TooLargeError:
    return TooLargeError(reason=f"the body is larger than {most} bytes")


def security_headers(path: str, host: str, secure: bool = False) -> Headers:
    """The headers of every answer under ``path``. The 3D client is one page of inline code, so it has rules of its own.

    ``host`` is named because not every browser counts ws: to 'self'.
    """
    scene = path == VISER_PATH or path.startswith(f"{VISER_PATH}/")
    connect = f"connect-src 'self' {'wss' if secure else 'ws'}://{host}"
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


def _landing(scope: Scope) -> str:
    """Where the launch address leads: to the replay that it names, else to the first room."""
    replay = next(iter(parse_qs(scope["query_string"].decode("latin-1")).get("replay", [])), None)
    return "/" if replay is None else f"/recordings?{urlencode({'replay': replay})}"


async def _redirect(send: Send, location: str, cookie: str | None = None) -> None:
    headers: Headers = [(b"cache-control", b"no-store"), (b"referrer-policy", b"no-referrer")]
    headers.append((b"location", location.encode("ascii")))
    if cookie is not None:
        headers.append((b"set-cookie", cookie.encode()))
    await _answer(send, "http", 303, headers, b"")


async def _refuse(
    scope: Scope, headers: dict[str, str], send: Send, error: HubsideError, page_text: str | None = None
) -> None:
    """A problem document; a person who opens the page gets ``page_text`` in plain HTML."""
    problem = problem_of(error, texts=texts_for(headers.get("accept-language")))
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
