"""Process images: the example of the manual, the placing of entries, and the order of words that a device must show."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.model.address import Address
from app.wire.modbus.fields import bytes_of
from app.wire.modbus.image import (
    TX_MAPPING,
    MappingObjects,
    Span,
    WordOrder,
    process_image,
    shown_order,
)

STATUSWORD, MODE, POSITION = Address(0x6041), Address(0x6061), Address(0x6064)
VELOCITY, INPUTS = Address(0x6044), Address(0x60FD)
ENTRIES = (0x60410010, 0x00050008, 0x60610008, 0x60640020, 0x60440010, 0x60FD0020)
"""The image of page 115, and defaults of 3602h as sibling manuals have them."""
TX = process_image(5000, ENTRIES, WordOrder.HIGH_FIRST)


def test_where_the_objects_of_the_manuals_image_lie() -> None:
    assert TX.span == Span(5000, 7)
    assert TX.places == {
        STATUSWORD: Span(5000, 1),
        MODE: Span(5001, 1),
        POSITION: Span(5002, 2),
        VELOCITY: Span(5004, 1),
        INPUTS: Span(5005, 2),
    }


def test_bytes_of_page_115() -> None:
    """06 40 is statusword 0640h; the dummy is the high byte beside the mode."""
    values = dict(TX.values(5000, (0x0640, 0x0002, 0x0001, 0x0203, 0xFFFE, 0, 0)))
    assert values[STATUSWORD] == b"\x40\x06"
    assert values[MODE] == b"\x02"
    assert values[POSITION] == (0x00010203).to_bytes(4, "little")
    assert values[VELOCITY] == (-2).to_bytes(2, "little", signed=True)


def test_a_window_gives_what_lies_wholly_in_it() -> None:
    assert [a for a, _ in TX.values(5001, (2, 1))] == [MODE]
    assert TX.touched(5001, 2) == [MODE, POSITION]
    assert TX.values(6000, (1, 2, 3)) == []
    assert [a for a, _ in TX.values(4990, (0,) * 11)] == [STATUSWORD]


@given(st.sampled_from(WordOrder), st.binary(min_size=13, max_size=13))
def test_what_is_packed_comes_back(order: WordOrder, data: bytes) -> None:
    image = process_image(6000, ENTRIES, order)
    sizes = {address: stop - start for address, start, stop in image.slots}
    values, at = {}, 0
    for address, size in sizes.items():
        values[address], at = data[at : at + size], at + size
    registers = image.registers(values)
    assert dict(image.values(6000, registers)) == values
    assert bytes_of(registers)[2] == 0  # the dummy


def test_the_order_of_words_turns_long_values_only() -> None:
    low = process_image(5000, ENTRIES, WordOrder.LOW_FIRST)
    registers = (0x0640, 2, 0x0203, 0x0001, 7, 0, 0)
    assert dict(low.values(5000, registers))[POSITION] == (0x00010203).to_bytes(4, "little")
    assert dict(low.values(5000, registers))[STATUSWORD] == b"\x40\x06"


def test_without_a_known_order_no_value_is_guessed() -> None:
    unknown = process_image(5000, ENTRIES)
    assert set(dict(unknown.values(5000, (0x0640, 2, 1, 0x0203, 7, 5, 5)))) == {STATUSWORD, MODE, VELOCITY, INPUTS}
    values = {STATUSWORD: bytes(2), MODE: b"\2", POSITION: b"\1\0\0\0", VELOCITY: bytes(2), INPUTS: bytes(4)}
    with pytest.raises(ValueError, match="6064"):
        unknown.registers(values)
    assert unknown.registers(values | {POSITION: b"\1\0\1\0"})[2:4] == (1, 1)  # it makes no difference here


def test_without_a_known_order_a_long_value_at_an_odd_byte_is_not_guessed_either() -> None:
    shifted = (0x60610008, 0x60640020, 0x60440010, 0x60600008)
    unknown, known = process_image(5000, shifted), process_image(5000, shifted, WordOrder.HIGH_FIRST)
    registers = (0x0200, 0x0102, 0x03FF, 0xFE06)
    found = dict(known.values(5000, registers))
    assert found[POSITION] == (0x00010203).to_bytes(4, "little")
    assert found.pop(POSITION) not in dict(unknown.values(5000, registers)).values()
    assert dict(unknown.values(5000, registers)) == found
    with pytest.raises(ValueError, match="6064"):
        unknown.registers({**found, POSITION: b"\3\2\1\0"})
    assert unknown.registers({**found, POSITION: bytes(4)}) == (0x0200, 0, 0x00FF, 0xFE06)


def test_the_device_shows_its_order() -> None:
    position = (0x00010203).to_bytes(4, "little")
    assert shown_order(position, (0x0001, 0x0203)) is WordOrder.HIGH_FIRST
    assert shown_order(position, (0x0203, 0x0001)) is WordOrder.LOW_FIRST
    assert shown_order(position, (0x0203, 0x0002)) is None  # it has moved
    assert shown_order(bytes(4), (0, 0)) is None
    assert shown_order(b"\1\0", (1,)) is None


def test_packing_wants_every_value_in_its_width() -> None:
    with pytest.raises(KeyError):
        TX.registers({})
    with pytest.raises(ValueError, match="6041"):
        TX.registers({STATUSWORD: b"\0"})


@pytest.mark.parametrize("entries", [(0x60400004, 0x60600008), (0x60400010,) * 17])
def test_what_has_no_place_is_refused(entries: tuple[int, ...]) -> None:
    with pytest.raises(ValueError):
        process_image(6000, entries)


def test_an_odd_byte_fills_a_register() -> None:
    image = process_image(6000, (0x60400010, 0x60600008), WordOrder.HIGH_FIRST)
    assert image.span == Span(6000, 2)
    assert image.registers({Address(0x6040): b"\x0f\0", Address(0x6060): b"\2"}) == (0x000F, 0x0200)


def test_a_mapping_is_known_when_all_of_it_was_seen() -> None:
    objects = MappingObjects(TX_MAPPING, 5000)

    def span() -> Span | None:
        image = objects.image
        return None if image is None else image.span

    for sub in (3, 1, 2):
        assert objects.learn(Address(TX_MAPPING, sub), ENTRIES[sub - 1].to_bytes(4, "little"))
        assert span() is None
    assert not objects.learn(Address(0x3502, 1), bytes(4))
    objects.learn(Address(TX_MAPPING, 0), b"\3")
    assert span() == Span(5000, 2)
    objects.learn(Address(TX_MAPPING, 0), b"\0")
    assert span() is None
    objects.learn(Address(TX_MAPPING, 0), b"\3")
    kept = objects.snapshot()
    objects.forget(Address(TX_MAPPING, 2))
    assert span() is None
    objects.restore(kept)
    assert span() == Span(5000, 2)
    objects.learn(Address(TX_MAPPING, 1), (0x60400004).to_bytes(4, "little"))
    assert span() is None
