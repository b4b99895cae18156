"""``python -m tests.soak.feeder TICKS RATE SECONDS BUSES``: numbered frames over the socketcand protocol.

Each bus has a port and RATE frames a second from the moment that its client is ready, for SECONDS; then it is gone.
Prints the ports. A line ``{"stop": false}`` on standard input is answered with what was sent; ``true`` ends the feed
first. The file TICKS tells at what time which frame was in the hands of the system (``numbered.TICKS``).
"""

from __future__ import annotations

import json
import socket
import sys
import threading
import time
from pathlib import Path
from typing import BinaryIO, Final

from tests.soak.numbered import elements

TICK_S: Final = 0.002
HOLD_S: Final = 0.15
"""A client that reads its ``< ok >`` alone has read it by then."""
NS: Final = 1_000_000_000
_TICK_BYTES: Final = (4, 4, 8, 8, 8)


class Feed:
    """One bus: one client, fed from a thread of its own."""

    def __init__(self, bus: int, ticks: BinaryIO, rate: int, seconds: float) -> None:
        self.bus, self.rate, self.seconds = bus, rate, seconds
        self.sent = 0
        self.longest_held_ns = 0
        self.elapsed_s = 0.0
        self.stop = threading.Event()
        self._ticks = ticks
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self.thread = threading.Thread(target=self._serve, daemon=True)

    def _serve(self) -> None:
        client, _ = self._listener.accept()
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        try:
            self._greet(client)
            self._feed(client)
            # The end of the stream tells the client that it has got all there is; it comes back to nobody.
            self._listener.close()
            client.shutdown(socket.SHUT_WR)
            while client.recv(4096):
                continue
        except OSError:
            return
        finally:
            self._listener.close()
            client.close()

    def _greet(self, client: socket.socket) -> None:
        client.sendall(b"< hi >")
        for _opened_and_raw in range(2):
            client.recv(4096)
            client.sendall(b"< ok >")
        time.sleep(HOLD_S)

    def _feed(self, client: socket.socket) -> None:
        start_ns, late_ns = time.monotonic_ns(), 0
        total, period_s = int(self.rate * self.seconds), 1 / self.rate
        while self.sent < total and not self.stop.is_set():
            now_ns = time.monotonic_ns()
            due = min(int((now_ns - start_ns) * self.rate / NS) + 1, total) - self.sent
            text = elements(self.sent, due, time.time(), period_s)
            before_ns = time.monotonic_ns()
            client.sendall(text)
            self._note(self.sent + due, late_ns, before_ns)
            asked_ns = time.monotonic_ns()
            time.sleep(TICK_S)
            late_ns = max(0, time.monotonic_ns() - asked_ns - int(TICK_S * NS))
        self.elapsed_s = (time.monotonic_ns() - start_ns) / NS

    def _note(self, sent: int, late_ns: int, before_ns: int) -> None:
        now_ns = time.monotonic_ns()
        held_ns = now_ns - before_ns
        self.sent = sent
        self.longest_held_ns = max(self.longest_held_ns, held_ns)
        fields = (self.bus, sent, now_ns, late_ns, held_ns)
        self._ticks.write(b"".join(n.to_bytes(size, "little") for n, size in zip(fields, _TICK_BYTES, strict=True)))


def report(feeds: list[Feed]) -> dict[str, list[float]]:
    """Bus by bus: frames sent, seconds from the first to the last, the longest time that a client did not read."""
    return {
        "sent": [feed.sent for feed in feeds],
        "elapsed_s": [feed.elapsed_s for feed in feeds],
        "longest_held_ms": [feed.longest_held_ns / 1e6 for feed in feeds],
    }


def main() -> None:
    """Serve until standard input ends."""
    path, rate, seconds, buses = Path(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]), int(sys.argv[4])
    with path.open("wb", buffering=0) as ticks:
        feeds = [Feed(bus, ticks, rate, seconds) for bus in range(buses)]
        for feed in feeds:
            feed.thread.start()
        print(json.dumps({"ports": [feed.port for feed in feeds]}), flush=True)
        for line in sys.stdin:
            if json.loads(line)["stop"]:
                for feed in feeds:
                    feed.stop.set()
                    feed.thread.join()
            print(json.dumps(report(feeds)), flush=True)


if __name__ == "__main__":
    main()
