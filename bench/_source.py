"""The bus of a benchmark as a process of its own: a simulated line that carries the load of ``bench._load``.

Prints its address. Then every line on standard input, ``{"count": N, "load": 0.2}`` or ``{"count": N,
"period_ns": 125000}``, has that many frames sent, one at a time. It says when it starts, and at the end how long it
took and when each position left the bus for the clients (monotonic clock of the host).
"""

from __future__ import annotations

import argparse
import json
import sys
import threading
from collections.abc import Sequence
from functools import partial
from typing import Any, Final

from app.twins.line import CanLine, TxOrder
from app.twins.line_thread import LineThread
from app.twins.socketcand_server import SocketcandServer
from app.wire.can_bits import frame_bits
from app.wire.frame import Can
from bench._load import frames, position_of

NS: Final = 1_000_000_000
AHEAD_NS: Final = 20_000_000
"""How far ahead of its time a frame is queued."""


class Sender:
    """Feeds frames to the line a little ahead of their times; runs on the line's thread."""

    def __init__(self, thread: LineThread, load: Sequence[Can], due_ns: Sequence[int], done: threading.Event) -> None:
        self._thread = thread
        self._port = thread.line.attach(lambda _can, _t_ns: None, (), TxOrder.FIFO)
        self._load = load
        self._due_ns = due_ns
        self._start_ns = thread.now_ns() + AHEAD_NS
        self._done = done
        self._next = 0

    def feed(self, t_ns: int) -> None:
        """Queue what is due soon; come back for more."""
        until_ns = t_ns + AHEAD_NS - self._start_ns
        while self._next < len(self._load) and self._due_ns[self._next] <= until_ns:
            self._port.send(self._load[self._next], self._start_ns + self._due_ns[self._next])
            self._next += 1
        if self._next < len(self._load) or self._port.pending or self._thread.line.busy:
            self._thread.line.call_at(t_ns + AHEAD_NS // 2, self.feed)
        else:
            self._port.detach()
            self._done.set()


def due_times(load: Sequence[Can], bitrate: int, request: dict[str, Any]) -> list[int]:
    """When each frame is due, in ns from the start: evenly, or so that the bus is loaded to a share of its time."""
    if "period_ns" in request:
        return [n * int(request["period_ns"]) for n in range(len(load))]
    times, bits = [], 0
    for can in load:
        times.append(int(bits * NS / (bitrate * request["load"])))
        bits += frame_bits(can)
    return times


def begin(thread: LineThread, load: Sequence[Can], due_ns: Sequence[int], done: threading.Event) -> None:
    """Start to send; on the line's thread."""
    Sender(thread, load, due_ns, done).feed(thread.now_ns())


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--bitrate", type=int, required=True)
    bitrate: int = parser.parse_args().bitrate
    line = CanLine(bitrate)
    thread = LineThread(line)
    seen: list[tuple[int, int, int]] = []
    sent = 0

    def tap(_start_ns: int, _end_ns: int, can: Can) -> None:
        nonlocal sent
        sent += 1
        position = position_of(can)
        if position is not None:
            seen.append((*position, thread.monotonic_ns()))

    line.tap(tap)
    with thread, SocketcandServer(thread) as server:
        print(json.dumps({"address": f"{server.host}:{server.port}"}), flush=True)
        for text in sys.stdin:
            request = json.loads(text)
            load = frames(request["count"], request.get("cycle", 1))
            due_ns = due_times(load, bitrate, request)
            seen.clear()
            sent, busy_ns, start_ns = 0, line.busy_ns, thread.monotonic_ns()
            done = threading.Event()
            print(json.dumps({"started": True}), flush=True)
            thread.call_soon(partial(begin, thread, load, due_ns, done))
            done.wait(due_ns[-1] / NS + 30)
            answer = {
                "sent": sent,
                "elapsed_s": (thread.monotonic_ns() - start_ns) / NS,
                "busy_s": (line.busy_ns - busy_ns) / NS,
                "skipped_s": thread.skipped_ns / NS,
                "dropped_clients": server.dropped_clients,
                "positions": seen if request.get("positions") else [],
            }
            print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
