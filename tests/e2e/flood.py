"""``python -m tests.e2e.flood RATE``: a bus at full load, over the socketcand protocol on a free port, which it prints.

Another master reads objects of two drives, whose PDOs and heartbeats run besides. It takes nothing that is sent to it.
"""

from __future__ import annotations

import itertools
import json
import socket
import sys
import time
from collections.abc import Iterator
from typing import Final

from app.model.address import Address
from app.wire.emcy import emcy
from app.wire.nmt import NmtState, heartbeat
from tests.wire import traffic

TICK_S: Final = 0.01
NODES: Final = (11, 12)
EMERGENCY_EVERY: Final = 4000


def frames() -> Iterator[tuple[int, bytes]]:
    """What crosses the bus, for ever."""
    for number in itertools.count():
        for node in NODES:
            yield 0x180 + node, number.to_bytes(8, "little")
            yield 0x280 + node, number.to_bytes(8, "little")
            for line in traffic.read(Address(0x6064), (number % 9000).to_bytes(4, "little")):
                yield (0x600 if line.client else 0x580) + node, line.data
            for line in traffic.read(Address(0x1008), b"A FOREIGN DRIVE"):
                yield (0x600 if line.client else 0x580) + node, line.data
        if number % 50 == 0:
            yield 0x70B, heartbeat(NmtState.OPERATIONAL)
        if number % EMERGENCY_EVERY == 0:
            yield 0x08B, emcy(0x3284, 0x05)


def serve(client: socket.socket, rate: int) -> None:
    """Send ``rate`` frames a second until the client goes away."""
    client.sendall(b"< hi >")
    for _opened_and_raw in range(2):
        client.recv(4096)
        client.sendall(b"< ok >")
    endless, started_s, sent = frames(), time.monotonic(), 0
    while True:
        due = int((time.monotonic() - started_s) * rate) - sent
        wall_s = time.time()
        batch = itertools.islice(endless, due)
        text = "".join(f"< frame {can_id:03X} {wall_s:.6f} {data.hex().upper()} >" for can_id, data in batch)
        client.sendall(text.encode())
        sent += due
        time.sleep(TICK_S)


def main() -> None:
    """Serve one client after another."""
    listener = socket.create_server(("127.0.0.1", 0))
    print(json.dumps({"port": listener.getsockname()[1]}), flush=True)
    while True:
        client, _ = listener.accept()
        try:
            serve(client, int(sys.argv[1]))
        except OSError:
            client.close()


if __name__ == "__main__":
    main()
