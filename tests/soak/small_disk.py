"""A disk of its own for a program, which can be made to be full at any moment.

``python -m tests.soak.small_disk KIND FOLDER COPY PROGRAM...`` runs PROGRAM with a small disk at FOLDER. On
standard input ``{"leave": N}`` leaves it N free bytes, ``{"leave": null}`` makes room again; both are answered. When
standard input ends, so does the program, and what is in FOLDER is copied to COPY.

KIND ``tmpfs``: a file system in memory that nobody else sees; to be started by ``unshare --user --map-root-user
--mount``, which needs no rights of its own. Where a system forbids that, ``limit``: no file may grow beyond the length
that the largest in FOLDER has, and N more.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Protocol

IN_NAMESPACE = ("unshare", "--user", "--map-root-user", "--mount")
ROOMY = 4 << 30
"""Takes memory only where something is written: well above what a recorder wants to be free."""
LEAST_LEFT = 1 << 16
"""A limit knows no disk that is merely nearly full: more than this is taken as this."""
END_TIMEOUT_S = 30.0


class Disk(Protocol):
    """Where the program writes."""

    def leave(self, pid: int, free_bytes: int | None) -> None:
        """Leave it so much; None for plenty."""


class Tmpfs:
    """A file system in memory."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={ROOMY}", "tmpfs", str(folder)], check=True)

    def leave(self, _pid: int, free_bytes: int | None) -> None:
        """Resize it: to what is used, and the rest."""
        disk = os.statvfs(self._folder)
        used = (disk.f_blocks - disk.f_bfree) * disk.f_frsize
        size = ROOMY if free_bytes is None else used + free_bytes
        subprocess.run(["mount", "-o", f"remount,size={size}", str(self._folder)], check=True)


class Limit:
    """A limit for the length of files."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def leave(self, pid: int, free_bytes: int | None) -> None:
        """Set the limit of the program."""
        size = resource.RLIM_INFINITY
        if free_bytes is not None:
            size = min(free_bytes, LEAST_LEFT) + max(path.stat().st_size for path in self._folder.iterdir())
        resource.prlimit(pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))


def can_mount() -> bool:
    """Whether this system lets anybody have a mount of his own."""
    try:
        return subprocess.run([*IN_NAMESPACE, "mount", "-t", "tmpfs", "tmpfs", "/tmp"], check=False).returncode == 0
    except FileNotFoundError:
        return False


def main() -> None:
    kind, folder, copy = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    folder.mkdir(parents=True, exist_ok=True)
    disk: Disk = Tmpfs(folder) if kind == "tmpfs" else Limit(folder)
    with subprocess.Popen(sys.argv[4:], stdin=subprocess.DEVNULL) as program:
        for line in sys.stdin:
            disk.leave(program.pid, json.loads(line)["leave"])
            print(json.dumps({"done": True}), flush=True)
        disk.leave(program.pid, None)
        program.send_signal(signal.SIGTERM)
        program.wait(END_TIMEOUT_S)
    shutil.copytree(folder, copy)


if __name__ == "__main__":
    main()
