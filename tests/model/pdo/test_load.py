"""What PDOs cost: the longest frame is as long as the standard says, and each rate names its ground."""

from __future__ import annotations

import random

import pytest

from app.model.pdo.load import ASSUMED_HZ, Basis, estimate, total, worst_bits
from app.model.pdo.setup import PdoSetup
from app.wire.can_bits import frame_bits
from app.wire.frame import Can
from tests.model.pdo.rig import RPDO2, TPDO2, delivered, disabled, enabled

RATE = 500_000


def tpdo2(*objects: str, **parameters: int) -> PdoSetup:
    return enabled(delivered()[TPDO2], *objects, **parameters)


@pytest.mark.parametrize(("size", "bits"), [(0, 55), (1, 65), (2, 75), (8, 135)])
def test_the_longest_frame_of_each_size(size: int, bits: int) -> None:
    assert worst_bits(size) == bits
    assert worst_bits(8, extended=True) == 160


@pytest.mark.parametrize("size", range(9))
def test_no_frame_is_longer(size: int) -> None:
    dice = random.Random(size)
    samples = [bytes(size), b"\xff" * size, *(dice.randbytes(size) for _ in range(300))]
    for data in samples:
        for can_id in (0, 0x7FF, dice.randrange(0x800)):
            assert frame_bits(Can(can_id, data)) <= worst_bits(size)
        assert frame_bits(Can(dice.randrange(1 << 29), data, True)) <= worst_bits(size, extended=True)


@pytest.mark.parametrize(
    ("setup", "sync_hz", "measured", "per_second", "basis"),
    [
        (disabled(tpdo2()), 100.0, 7.0, 0.0, Basis.OFF),
        (tpdo2(), None, 7.0, 7.0, Basis.MEASURED),
        (tpdo2(transmission_type=4), 100.0, None, 25.0, Basis.SYNC),
        (tpdo2(transmission_type=0), 100.0, None, 100.0, Basis.SYNC_AT_MOST),
        (tpdo2(transmission_type=1), None, None, 0.0, Basis.NO_SYNC),
        (tpdo2(inhibit_100us=200, event_ms=1000), None, None, 50.0, Basis.INHIBIT),
        (tpdo2(event_ms=2), None, None, 500.0, Basis.ASSUMED),
        (tpdo2(), None, None, ASSUMED_HZ, Basis.ASSUMED),
        (tpdo2(transmission_type=253), 100.0, None, 0.0, Basis.REMOTE),
        (enabled(delivered()[RPDO2]), 100.0, None, 0.0, Basis.SENDER),
        (enabled(delivered()[RPDO2]), 100.0, 50.0, 50.0, Basis.MEASURED),
    ],
)
def test_a_rate_and_what_it_rests_on(
    setup: PdoSetup, sync_hz: float | None, measured: float | None, per_second: float, basis: Basis
) -> None:
    load = estimate(setup, RATE, sync_hz, measured)
    assert (load.per_second, load.basis) == (per_second, basis)
    assert load.share == pytest.approx(per_second * load.bits / RATE)


def test_shares_add_up() -> None:
    load = estimate(tpdo2("6041/16", transmission_type=1), RATE, 1000.0, None)
    assert load.basis.certain and load.bits == 75
    assert total([load, load]) == pytest.approx(2 * 1000 * 75 / RATE)
    assert not estimate(tpdo2(), RATE, None, None).basis.certain
