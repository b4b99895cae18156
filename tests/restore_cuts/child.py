"""A process that forks one tool after the other, each of which restores the station and may be killed at any instant.

A line of JSON on stdin starts one; its process id comes back on stdout, and ``gone`` once it has ended in whatever way.
"""

from __future__ import annotations

import asyncio
import json
import os
import sys
from pathlib import Path
from typing import Any

from app.errors import HubsideError
from tests.restore_cuts.tool import descriptions, hurry, order, tool


async def restore(job: dict[str, Any]) -> None:
    """A whole restore, from the connection to the end."""
    async with tool(Path(job["site"]), Path(job["data"]), job["whole"]) as one:
        prepared = await one.desk.prepare(one.connection, order(map(Path, job["sets"])))
        await one.desk.wait(await one.desk.begin(one.connection, prepared))


def main() -> None:
    """Until stdin ends."""
    hurry()
    for whole in (False, True):
        descriptions(whole)
    for line in sys.stdin:
        pid = os.fork()
        if pid == 0:
            try:
                asyncio.run(restore(json.loads(line)))
            except HubsideError as error:
                print(repr(error), file=sys.stderr)
            finally:
                os._exit(0)
        print(pid, flush=True)
        os.waitpid(pid, 0)
        print("gone", flush=True)


if __name__ == "__main__":
    main()
