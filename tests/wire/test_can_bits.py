"""The table-driven bit count against a naive one that writes every bit into a list."""

from __future__ import annotations

import random

import pytest

from app.model.address import Address
from app.wire import sdo
from app.wire.can_bits import ERROR_FRAME_BITS, TRAILER_BITS, frame_bits
from app.wire.frame import Can


def _bits(number: int, width: int) -> list[int]:
    return [number >> i & 1 for i in reversed(range(width))]


def _naive(can: Can) -> int:
    if can.extended:
        bits = [0, *_bits(can.can_id >> 18, 11), 1, 1, *_bits(can.can_id, 18), int(can.remote), 0, 0]
    else:
        bits = [0, *_bits(can.can_id, 11), int(can.remote), 0, 0]
    bits += _bits(can.length, 4)
    if not can.remote:
        for byte in can.data:
            bits += _bits(byte, 8)
    crc = 0
    for bit in bits:
        top = crc >> 14 & 1
        crc = crc << 1 & 0x7FFF
        if top ^ bit:
            crc ^= 0x4599
    sent: list[int] = []
    for bit in bits + _bits(crc, 15):
        sent.append(bit)
        if len(sent) >= 5 and len(set(sent[-5:])) == 1 and _run(sent) % 5 == 0:
            sent.append(1 - bit)
    return len(sent) + 1 + 2 + 7 + 3


def _run(sent: list[int]) -> int:
    run = 0
    for bit in reversed(sent):
        if bit != sent[-1]:
            break
        run += 1
    return run


def _random_can(rng: random.Random) -> Can:
    extended = rng.random() < 0.4
    can_id = rng.getrandbits(29 if extended else 11)
    if rng.random() < 0.2:
        return Can(can_id, b"", extended, remote=True, dlc=rng.randrange(9))
    fill = rng.choice([b"\x00", b"\xff", b"\xf8", b"\x0f", None])
    size = rng.randrange(9)
    return Can(can_id, rng.randbytes(size) if fill is None else fill * size, extended)


def test_equals_the_naive_count() -> None:
    rng = random.Random(1)
    for _ in range(5000):
        can = _random_can(rng)
        assert frame_bits(can) == _naive(can), can


def test_bounds_of_a_frame_with_8_bytes() -> None:
    """Without stuffing 111 bits with intermission; at most (98 - 1) // 4 stuff bits more."""
    rng = random.Random(2)
    seen = {frame_bits(Can(rng.getrandbits(11), rng.randbytes(8))) for _ in range(3000)}
    assert min(seen) >= 111 and max(seen) <= 111 + 24


def test_sdo_exchange_is_about_243_bits() -> None:
    """Expedited reads of a 16-bit value over all kinds of addresses."""
    rng = random.Random(3)
    total = 0
    for _ in range(400):
        address = Address(rng.choice([0x3110, 0x6065, 0x30FA, 0x6410]), rng.randrange(1, 9))
        total += frame_bits(Can(0x600 + 11, sdo.upload_request(address)))
        total += frame_bits(Can(0x580 + 11, sdo.upload_response(address, rng.randbytes(2))))
    assert total / 400 == pytest.approx(243, abs=6)


def test_known_shortest_frames() -> None:
    """A heartbeat of one byte: 19 + 8 + 15 + 13 bits before stuffing."""
    assert TRAILER_BITS == 13
    assert frame_bits(Can(0x555, b"\x55")) == _naive(Can(0x555, b"\x55")) >= 55
    assert frame_bits(Can(0, error=True)) == ERROR_FRAME_BITS


@pytest.mark.parametrize("can", [Can(0x800), Can(1 << 29, extended=True), Can(1, bytes(9)), Can(1, dlc=16), Can(-1)])
def test_impossible_frames_are_refused(can: Can) -> None:
    with pytest.raises(ValueError):
        frame_bits(can)
