"""The twin of a PD4-E behind a relay that keeps every request back for a millisecond; ends with standard input."""

from __future__ import annotations

import contextlib
import json
import socket
import sys
import threading
import time
from typing import Final

from app.model.description_file import load_builtin
from app.twins.paced_thread import PacedThread
from app.twins.pd4e.device import BOOT_NS, Pd4e, Settings
from app.twins.pd4e.server import Pd4eServer

LATENCY_S: Final = 0.001


def main() -> None:
    """Serve until standard input is closed."""
    device = Pd4e(load_builtin("nanotec-pd4e"), Settings())
    device.run_until(BOOT_NS)
    thread = PacedThread(device, time.monotonic_ns)
    with thread, Pd4eServer(thread, device, port=0) as server, socket.create_server(("127.0.0.1", 0)) as listener:
        threading.Thread(target=_accept, args=(listener, (server.host, server.port)), daemon=True).start()
        print(json.dumps({"port": listener.getsockname()[1]}), flush=True)
        sys.stdin.read()


def _accept(listener: socket.socket, server: tuple[str, int]) -> None:
    with contextlib.suppress(OSError):  # the listener is closed at the end
        while True:
            client, _ = listener.accept()
            device = socket.create_connection(server)
            for each in (client, device):
                each.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            threading.Thread(target=_relay, args=(client, device, LATENCY_S), daemon=True).start()
            threading.Thread(target=_relay, args=(device, client, 0.0), daemon=True).start()


def _relay(source: socket.socket, target: socket.socket, delay_s: float) -> None:
    """Pass bytes on; a client with one transaction at a time sends nothing more meanwhile."""
    with contextlib.suppress(OSError), source, target:
        while data := source.recv(65536):
            if delay_s:
                time.sleep(delay_s)
            target.sendall(data)


if __name__ == "__main__":
    main()
