"""A process of its own that drives the cylinders by hand, until somebody ends it: ``ed2_driver PORT RATE FOLDER``."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

from app.model.site import read_site
from app.service.connection import Connection
from app.service.motion.hydraulic_moves import Way, drive_by_hand
from app.service.options import Options
from tests.drivers.profibus_rig import ED2, LISTEN_S
from tests.service.motion.ed2_rig import AXIS, ORDER, SITE
from tests.service.motion.rig import at_the_desk


async def drive(port: str, baud: int, folder: Path) -> None:
    """Hold the rapid to the positive side."""
    (turbine,) = read_site(SITE.format(port=port, baud=baud, more=ORDER), "site.toml")
    async with (
        Connection(turbine, {"wandfluh-ed2": ED2}, Options("tester", folder, listen_s=LISTEN_S)) as connection,
        at_the_desk(connection) as (desk, page),
    ):
        page.hold()
        await desk.prepare(AXIS, page.fence)
        page.let_go()
        page.hold()
        await drive_by_hand(desk, AXIS, page.fence, Way(positive=True, rapid=True))


if __name__ == "__main__":
    asyncio.run(drive(sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])))
