"""The peer of ``record``: python-can's own logger program with its own socketcand client, writing BLF.

python -m bench._record_peer HOST PORT FILE
"""

from __future__ import annotations

import os
import signal
import sys

import can.logger

from bench._meter import start_meter


def main() -> None:
    host, port, file = sys.argv[1:]
    start_meter(lambda: os.kill(os.getpid(), signal.SIGINT), ready=True)
    sys.argv[1:] = ["-i", "socketcand", "-c", "can0", "-f", file, "--bus-kwargs", f"host={host}", f"port={port}"]
    can.logger.main()


if __name__ == "__main__":
    main()
