"""Looking for adapters: what each place says, and that one that hangs or fails keeps nobody from seeing the others."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from app.drivers import adapters
from app.drivers.adapters import Health, adapter, detect, network_interfaces
from app.drivers.can_config import CanInterface
from app.errors import UsageError


async def test_every_place_answers_whatever_this_machine_has() -> None:
    places = await detect()
    assert [place.interface for place in places] == [
        CanInterface.SLCAN, CanInterface.SOCKETCAN, CanInterface.PCAN,
        CanInterface.KVASER, CanInterface.IXXAT, CanInterface.VECTOR,
    ]  # fmt: skip
    assert all(place.reason for place in places if place.health is not Health.OK)


async def test_a_place_that_hangs_or_fails_is_named_beside_the_others() -> None:
    released = threading.Event()

    def hangs() -> list[adapters.Adapter]:
        released.wait(10)
        return []

    def fails() -> list[adapters.Adapter]:
        raise OSError("no such thing")

    places: dict[CanInterface, adapters.Look] = {
        CanInterface.PCAN: hangs,
        CanInterface.KVASER: fails,
        CanInterface.SLCAN: lambda: [adapter("slcan:COM3", "CANable")],
    }
    try:
        first = await detect(0.1, places)
        again = await detect(0.1, places)
    finally:
        released.set()
    assert [place.health for place in first] == [Health.TIMED_OUT, Health.FAILED, Health.OK]
    assert [place.health for place in again] == [Health.TIMED_OUT, Health.FAILED, Health.OK]
    assert first[1].reason == "no such thing"
    assert first[2].adapters[0].title == "CANable"


def test_can_interfaces_of_linux_are_told_by_their_type(tmp_path: Path) -> None:
    for name, kind in (("can0", "280"), ("eth0", "1"), ("vcan1", "280")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "type").write_text(f"{kind}\n", encoding="ascii")
        (tmp_path / name / "operstate").write_text("up\n", encoding="ascii")
    (tmp_path / "gone").mkdir()
    assert network_interfaces(tmp_path) == [("can0", "up"), ("vcan1", "up")]


def test_an_adapter_knows_whether_it_can_be_silent() -> None:
    assert adapter("slcan:/dev/ttyACM0@250000").connection == "slcan:/dev/ttyACM0"
    assert adapter("slcan:COM3").silent and adapter("slcan:COM3").sets_bitrate
    assert not adapter("ixxat:0").silent
    assert not adapter("socketcan:can0").sets_bitrate
    with pytest.raises(UsageError):
        adapter("nothing")
