"""The peer of ``record``: python-can's own logger program with its own socketcand client, writing BLF.

python -m bench._record_peer HOST PORT FILE
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time

import can.logger

from bench._meter import start_meter

AGAIN_S = 15.0


def _interrupt() -> None:
    """Ctrl-C until it is heard: python-can takes one that comes in a callback for an error of the bus, and goes on."""
    while True:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(AGAIN_S)


def main() -> None:
    host, port, file = sys.argv[1:]
    start_meter(lambda: threading.Thread(target=_interrupt, daemon=True).start(), ready=True)
    sys.argv[1:] = ["-i", "socketcand", "-c", "can0", "-f", file, "--bus-kwargs", f"host={host}", f"port={port}"]
    can.logger.main()


if __name__ == "__main__":
    main()
