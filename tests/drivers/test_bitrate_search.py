"""The search for the bit rate, on a serial adapter over a pty: what it finds, and that the bus is never disturbed."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path

import pytest

from app.drivers.bitrate_search import USUAL_RATES, Ear, rates_to_try, search_bitrate
from app.drivers.can_config import BITRATES_OF, CanConfig, CanInterface, parse_can
from app.drivers.canopen import CanOpenDriver
from app.errors import BusOpenError, UsageError
from app.wire.frame import Can, Direction, Frame, Stamper

if sys.platform == "win32":
    pytest.skip("Windows has no pty", allow_module_level=True)

from tests.drivers.slcan_adapter import SlcanOnBus

Bench = Callable[..., tuple[CanConfig, SlcanOnBus]]


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    with ExitStack() as stack:

        def make(bus_rate: int, period_s: float = 0.01, left_open: bool = False) -> tuple[CanConfig, SlcanOnBus]:
            adapter = stack.enter_context(closing(SlcanOnBus(tmp_path / "tty", bus_rate, period_s, left_open)))
            return parse_can(f"slcan:{tmp_path / 'tty'}@search"), adapter

        yield make


def only_listened(adapter: SlcanOnBus) -> bool:
    return {command for _, command in adapter.opened} == {b"L"} and not adapter.sent


async def test_it_is_found_and_nothing_was_sent(bench: Bench) -> None:
    config, adapter = bench(250_000)
    tried: list[int] = []
    assert await search_bitrate(config, 0.3, tried.append) == 250_000
    assert tried == adapter.tried == [500_000, 250_000]
    assert only_listened(adapter)


async def test_the_usual_rates_first_then_what_the_adapter_offers(bench: Bench) -> None:
    config, adapter = bench(83_300)
    assert await search_bitrate(config, 0.1) == 83_300
    assert adapter.tried == [
        500_000, 250_000, 125_000, 1_000_000, 50_000, 20_000, 10_000, 750_000, 100_000, 83_300,
    ]  # fmt: skip
    assert only_listened(adapter)


async def test_a_silent_bus_names_the_rates_tried(bench: Bench) -> None:
    config, adapter = bench(bus_rate=0)
    with pytest.raises(BusOpenError) as caught:
        await search_bitrate(config, 0.02)
    reason = caught.value.details["reason"]
    assert all(f"{rate}: nothing" in reason for rate in BITRATES_OF[CanInterface.SLCAN])
    assert caught.value.details["bus"] == f"slcan:{config.channel}"
    assert caught.value.exit_code == 5
    assert len(adapter.tried) == 10
    assert only_listened(adapter)


async def test_the_second_frame_may_come_later(bench: Bench) -> None:
    config, adapter = bench(500_000, period_s=0.4)
    assert await search_bitrate(config, 0.6) == 500_000
    assert only_listened(adapter)


async def test_what_an_adapter_left_open_still_hands_over_proves_nothing(bench: Bench) -> None:
    config, adapter = bench(250_000, left_open=True)
    assert await search_bitrate(config, 0.3) == 250_000
    assert adapter.tried == [500_000, 250_000]
    assert only_listened(adapter)


async def test_no_adapter_is_told_at_once(tmp_path: Path) -> None:
    tried: list[int] = []
    with pytest.raises(BusOpenError):
        await search_bitrate(parse_can(f"slcan:{tmp_path / 'none'}@search"), 0.1, tried.append)
    assert tried == [500_000]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("socketcan:can0@search", "socketcan does not set it"),
        ("socketcand:127.0.0.1:29536@search", "socketcand does not set it"),
        ("virtual:bus@search", "virtual does not set it"),
        ("ixxat:0@search", "would disturb the bus"),
    ],
)
async def test_refused_where_it_would_disturb_or_change_nothing(text: str, why: str) -> None:
    with pytest.raises(UsageError) as caught:
        await search_bitrate(parse_can(text), 0.1, lambda bitrate: pytest.fail(f"tried {bitrate}"))
    assert why in caught.value.details["reason"]


async def test_error_frames_disqualify() -> None:
    def frame(error: bool, direction: Direction = Direction.RX) -> Frame:
        return Frame(0, "can0", direction, Can(0x701, b"\x7f", error=error))

    good, bad, alone, own = Ear(), Ear(), Ear(), Ear()
    good.on_frames([frame(False), frame(False)])
    bad.on_frames([frame(False), frame(False), frame(True)])
    alone.on_frames([frame(False)])
    own.on_frames([frame(False, Direction.TX)] * 2)
    assert [ear.fits for ear in (good, bad, alone, own)] == [True, False, False, False]
    assert str(bad) == "2 frames, 1 error frames"


async def test_nothing_is_opened_at_a_bit_rate_that_was_not_found(bench: Bench) -> None:
    config, adapter = bench(250_000)
    driver = CanOpenDriver(config, Stamper(0, lambda: 0))
    with pytest.raises(BusOpenError):
        await driver.connect(1.0)
    await driver.close()
    assert adapter.opened == []


def test_rates_of_each_adapter_and_the_text_of_a_connection() -> None:
    assert rates_to_try(parse_can("kvaser:0@search")) == USUAL_RATES
    assert rates_to_try(parse_can("pcan:PCAN_USBBUS1@search"))[:5] == USUAL_RATES[:5]
    for text in ("slcan:COM3@search", "kvaser:0@search", "socketcand:127.0.0.1:29536/can0@search"):
        assert parse_can(text).search
        assert str(parse_can(text)) == text
        assert not parse_can(text.replace("search", "250000")).search
