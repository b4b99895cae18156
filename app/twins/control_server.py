"""Control of running twins: faults and scenarios, as JSON lines over TCP on the loopback, served by the line's thread.

A request is one line, an object with ``id`` (number or text, comes back), ``token`` (the secret of these twins), ``do``
and what that needs:

==============  ==============================  ===============================================================
do              needs                           result
==============  ==============================  ===============================================================
``catalogue``                                   kinds of fault
``active``                                      ``now_ns`` (line time), ``faults``, ``playing`` (or null)
``inject``      ``order`` (table of an order)   the fault
``clear``       ``fault`` (its id)              null
``clear_all``                                   null
``scenarios``                                   ``name``, ``title``, ``duration_s``, ``seed``, ``note`` of each
``play``        ``scenario`` (a name), or       null
                ``text`` and ``file``
``stop``                                        null
==============  ==============================  ===============================================================

An answer is ``{"id", "ok": true, "result"}`` or ``{"id", "ok": false, "error": {"code", "text", "field"}}``. At the
first line that is no request, and at a wrong token, the connection is dropped.
"""

from __future__ import annotations

import hmac
import json
import logging
import socket
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from app.errors import HubsideError, UsageError
from app.model.fault import CATALOGUE, active_table, kind_table, order_from_table
from app.twins.faults import Instructor
from app.twins.line_thread import LineThread
from app.twins.paced_server import PacedServer
from app.twins.scenario import MAX_BYTES, Scenario, load_scenario, read_scenario

_LOG: Final = logging.getLogger(__name__)
HOST: Final = "127.0.0.1"
_READ_BYTES: Final = 65536
_LINE_MAX: Final = 2 * MAX_BYTES
_OUT_LIMIT_BYTES: Final = 1 << 20
_CLIENTS_MAX: Final = 16
_ID_MAX: Final = 64
_KEYS: Final = {
    "catalogue": (),
    "active": (),
    "inject": ("order",),
    "clear": ("fault",),
    "clear_all": (),
    "scenarios": (),
    "play": ("scenario", "text", "file"),
    "stop": (),
}


class ControlServer(PacedServer["_Client"]):
    """The server. ``scenarios``: folder of those that can be played by name; ``problems`` says which cannot be read."""

    def __init__(
        self, thread: LineThread, instructor: Instructor, token: str, scenarios: Path | None = None, port: int = 0
    ) -> None:
        super().__init__(thread, HOST, port, _CLIENTS_MAX)
        self.problems: list[str] = []
        self._thread = thread
        self._token = token.encode()
        self._desk = _Desk(thread, instructor, self._load(scenarios))

    @property
    def address(self) -> str:
        """Where it listens: ``HOST:PORT``."""
        return f"{HOST}:{self.port}"

    def knows(self, token: object) -> bool:
        """Whether it is the secret; takes the same time for every wrong one."""
        return isinstance(token, str) and hmac.compare_digest(token.encode(), self._token)

    def answer(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Do what a request asks for."""
        try:
            return {"id": request["id"], "ok": True, "result": self._desk.do(request)}
        except HubsideError as error:
            told = {"code": error.code, "text": str(error.details.get("reason", error))}
            if "field" in error.details:
                told["field"] = str(error.details["field"])
        except Exception as error:  # noqa: BLE001 - a defect here must not end the connection, nor the line
            _LOG.exception("a request to the twins failed")
            told = {"code": "error", "text": str(error) or type(error).__name__}
        return {"id": request["id"], "ok": False, "error": told}

    def forget(self, client: _Client) -> None:
        """A client has closed."""
        self._clients.discard(client)

    # -- inside ------------------------------------------------------------------------

    def _load(self, folder: Path | None) -> dict[str, Scenario]:
        found: dict[str, Scenario] = {}
        for path in sorted(folder.glob("*.toml")) if folder is not None else ():
            try:
                found[path.stem] = load_scenario(path)
            except UsageError as error:
                self.problems.append(str(error.details["reason"]))
        return found

    def _connected(self, sock: socket.socket, _peer: str) -> _Client:
        return _Client(self, self._thread, sock)


class _Client:
    """One connection."""

    def __init__(self, server: ControlServer, thread: LineThread, sock: socket.socket) -> None:
        self._server = server
        self._thread = thread
        self._sock = sock
        self._in = bytearray()
        self._out = bytearray()
        thread.on_readable(sock, self._read)

    def close(self) -> None:
        """End the connection."""
        if self._sock.fileno() < 0:
            return
        self._thread.on_readable(self._sock, None)
        self._thread.on_writable(self._sock, None)
        self._sock.close()
        self._server.forget(self)

    def _read(self) -> None:
        try:
            data = self._sock.recv(_READ_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self.close()
            return
        self._in += data
        while (end := self._in.find(b"\n")) >= 0:
            line = bytes(self._in[:end])
            del self._in[: end + 1]
            if not self._obey(line):
                self.close()
                return
        if len(self._in) > _LINE_MAX:
            self.close()
            return
        self._send()

    def _obey(self, line: bytes) -> bool:
        """Answer a line; False where it is no request, or not from somebody who knows the secret."""
        request = _request_of(line)
        if request is None or not self._server.knows(request["token"]):
            return False
        self._out += json.dumps(self._server.answer(request), ensure_ascii=False).encode() + b"\n"
        return len(self._out) <= _OUT_LIMIT_BYTES

    def _send(self) -> None:
        try:
            sent = self._sock.send(self._out) if self._out else 0
        except BlockingIOError:
            sent = 0
        except OSError:
            self.close()
            return
        del self._out[:sent]
        self._thread.on_writable(self._sock, self._send if self._out else None)


def _request_of(line: bytes) -> dict[str, Any] | None:
    """The request that a line holds; None where it is none."""
    try:
        request = json.loads(line)
    except (ValueError, RecursionError):
        return None
    if not isinstance(request, dict) or not {"id", "token", "do"} <= request.keys():
        return None
    number = request["id"]
    sound = isinstance(number, int) or (isinstance(number, str) and len(number) <= _ID_MAX)
    return request if sound and isinstance(request["do"], str) else None


class _Desk:
    """What the requests do."""

    def __init__(self, thread: LineThread, instructor: Instructor, scenarios: dict[str, Scenario]) -> None:
        self._thread = thread
        self._instructor = instructor
        self._scenarios = scenarios
        self._playing = ""
        self._actions: dict[str, Callable[[Mapping[str, Any]], Any]] = {
            "catalogue": lambda _request: [kind_table(kind) for kind in CATALOGUE.values()],
            "active": lambda _request: self._situation(),
            "inject": self._inject,
            "clear": self._clear,
            "clear_all": lambda _request: instructor.clear_all(),
            "scenarios": lambda _request: [_scenario_table(*item) for item in scenarios.items()],
            "play": self._play,
            "stop": lambda _request: instructor.stop(),
        }

    def do(self, request: Mapping[str, Any]) -> Any:
        """The result of a request. Raises UsageError."""
        name = request["do"]
        if name not in self._actions:
            raise UsageError(reason=f"'{name}' is nothing that twins do", field="do")
        for key in request:
            if key not in ("id", "token", "do", *_KEYS[name]):
                raise UsageError(reason=f"'{name}' takes no '{key}'", field=key)
        self._thread.catch_up()
        return self._actions[name](request)

    def _situation(self) -> dict[str, Any]:
        instructor, now_ns = self._instructor, self._thread.line.now_ns
        player, playing = instructor.playing, None
        if player is not None:
            elapsed_s = (now_ns - player.since_ns) / 1e9
            title, duration_s = player.scenario.title, player.scenario.duration_s
            playing = {"scenario": self._playing, "title": title, "elapsed_s": elapsed_s, "duration_s": duration_s}
        return {"now_ns": now_ns, "faults": [active_table(one) for one in instructor.active], "playing": playing}

    def _inject(self, request: Mapping[str, Any]) -> Any:
        order = request.get("order")
        if not isinstance(order, dict):
            raise UsageError(reason="'order' is missing or no table", field="order")
        return active_table(self._instructor.inject(order_from_table(order)))

    def _clear(self, request: Mapping[str, Any]) -> None:
        fault = request.get("fault")
        if not isinstance(fault, int):
            raise UsageError(reason="'fault' is missing or no number", field="fault")
        self._instructor.clear(fault)

    def _play(self, request: Mapping[str, Any]) -> None:
        name, text = request.get("scenario"), request.get("text")
        file = str(request.get("file", "scenario"))
        if isinstance(text, str):
            name, scenario = Path(file).stem, read_scenario(text, file)
        elif isinstance(name, str) and name in self._scenarios:
            scenario = self._scenarios[name]
        else:
            raise UsageError(reason=f"there is no scenario '{name}'", field="scenario")
        self._instructor.play(scenario)
        self._playing = str(name)


def _scenario_table(name: str, scenario: Scenario) -> dict[str, Any]:
    return {
        "name": name,
        "title": scenario.title,
        "duration_s": scenario.duration_s,
        "seed": scenario.seed,
        "note": scenario.note,
    }
