"""Makes ``recordings/oat-six-nodes.mcap``: ``python -m tests.recording.make_sample``.

The six twins of a turbine in a process of their own, read completely and then once more, in the archive form. Times
and thus bytes differ from run to run.
"""

from __future__ import annotations

import asyncio
import sys
import tempfile
import time
from pathlib import Path

from app.drivers.can_config import parse_can
from app.drivers.canopen import CanOpenDriver
from app.errors import HubsideError
from app.model.address import Address
from app.model.description import Description
from app.model.description_file import load_builtin
from app.model.od_export import to_json
from app.recording.content import AttachedFile, RecorderClock, RecordingInfo
from app.recording.pack import pack
from app.recording.writer import Recorder, RecorderSettings
from app.wire.frame import Stamper
from bench._twins import twins

SAMPLE = Path(__file__).resolve().parents[2] / "recordings" / "oat-six-nodes.mcap"
BIT_RATE = 500_000
ROUNDS = 2


async def record(address: str, directory: Path) -> Path:
    """Reads every object of every node and records it; the file."""
    pmm, pmc = load_builtin("oat-pmm"), load_builtin("oat-pmc")
    devices = dict.fromkeys((1, 2, 3), pmm) | {10 + blade: pmc for blade in (1, 2, 3)}
    nodes = {
        f"can0/{node}": f"wtg-07/blade-{node % 10}/{device.id[4:]} {device.id}" for node, device in devices.items()
    }
    stamp = Stamper(time.time_ns(), time.monotonic_ns)
    driver = CanOpenDriver(parse_can(f"socketcand:{address}@{BIT_RATE}"), stamp, listen_s=1.0)
    info = RecordingInfo("wtg-07", "sample", {"can0": BIT_RATE}, nodes, {each.id: each.version for each in (pmm, pmc)})
    attached = [AttachedFile(f"{each.id}.json", "application/json", to_json(each).encode()) for each in (pmm, pmc)]
    clock = RecorderClock(time.monotonic_ns, time.time_ns, stamp)
    with Recorder(directory, info, clock, attached, RecorderSettings(min_free_bytes=0)) as recorder:
        driver.subscribe(recorder.write)
        await driver.connect()
        try:
            for _ in range(ROUNDS):
                await read_all(driver, recorder, devices)
        finally:
            await driver.close()
        status = recorder.close()
    if status.file is None:
        raise RuntimeError(f"nothing was recorded: {status.detail}")
    return status.file


async def read_all(driver: CanOpenDriver, recorder: Recorder, devices: dict[int, Description]) -> None:
    """Reads all and notes the values as a keyframe."""
    plans: dict[int, list[Address]] = {
        node: [entry.address for entry in device if entry.access.readable] for node, device in devices.items()
    }
    answers = await asyncio.gather(*(driver.read_many(node, plan) for node, plan in plans.items()))
    values = {
        f"can0/{node}/{address}": answer.hex()
        for node, found in zip(plans, answers, strict=True)
        for address, answer in found.items()
        if not isinstance(answer, HubsideError)
    }
    recorder.keyframe({"values": values, "mappings": {}, "transfers": []})


def main() -> None:
    with tempfile.TemporaryDirectory() as name, twins(BIT_RATE) as address:
        file = asyncio.run(record(address, Path(name)))
        SAMPLE.unlink(missing_ok=True)
        result = pack(file, SAMPLE)
    sys.stdout.write(f"{SAMPLE}: {result.messages} messages, {result.packed_bytes} bytes\n")


if __name__ == "__main__":
    main()
