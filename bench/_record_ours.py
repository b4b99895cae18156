"""Our side of ``record``: a turbine connected as ``hubside serve`` does it, every frame decoded and recorded.

python -m bench._record_ours SITE FOLDER
"""

from __future__ import annotations

import asyncio
import json
import sys
from pathlib import Path

from app.cli.connecting import SWITCH_INTERVAL_S
from app.cli.runtime import spare_collector
from app.model.description_file import BUILTIN, load_builtin
from app.model.site import load_site
from app.service.connection import Connection
from app.service.options import Options
from bench._meter import start_meter


async def main() -> None:
    site, folder = map(Path, sys.argv[1:])
    (turbine,) = load_site(site)
    descriptions = {name: load_builtin(name) for name in BUILTIN}
    loop, end = asyncio.get_running_loop(), asyncio.Event()
    connection = Connection(turbine, descriptions, Options("bench", folder, listen_s=0.0))
    spare_collector()
    async with connection:
        start_meter(lambda: loop.call_soon_threadsafe(end.set), ready=True)
        await end.wait()
        recording = connection.recording
    views = [connection.live.values(target.device.bus, target.node) for target in connection.targets]
    lost = -1 if recording is None else recording.status().lost
    print(json.dumps({"values": sum(map(len, views)), "lost": lost}), flush=True)


if __name__ == "__main__":
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    asyncio.run(main())
