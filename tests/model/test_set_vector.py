"""Sets as vectors: equal words for equal values, others for others."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from app.model.address import Address, Addressing, parse_address
from app.model.set_vector import WIDTH, layout_of, pack

INTEGERS = st.integers(-(2**63), 2**64 - 1)
RAW = INTEGERS | st.floats(allow_nan=False) | st.text(max_size=40) | st.binary(max_size=40)
ADDRESSES = st.builds(Address, st.integers(0, 0xFFFF), st.integers(0, 0xFF), st.just(Addressing.OD))


@given(st.dictionaries(ADDRESSES, RAW, max_size=20))
def test_a_layout_names_every_address_in_its_order(values: dict[Address, int]) -> None:
    layout = layout_of(values)
    assert [parse_address(text) for text in layout] == sorted(values)
    assert len(pack(values, layout)) == WIDTH * len(values)


@given(ADDRESSES, st.tuples(INTEGERS, INTEGERS) | st.tuples(st.text(), st.text()) | st.tuples(st.binary(), st.binary()))
def test_words_are_equal_where_the_values_are(address: Address, pair: tuple[int, int]) -> None:
    if isinstance(pair[0], int) and pair[0] != pair[1] and (pair[0] - pair[1]) % 2**64 == 0:
        return  # no type holds both: they are apart by the whole range
    layout = layout_of({address: 0})
    words = [pack({address: raw}, layout) for raw in pair]
    assert (words[0] == words[1]) == (pair[0] == pair[1])


def test_numbers_of_profibus_are_sorted_as_numbers() -> None:
    values = {Address(12, 221, Addressing.PKW): 1, Address(2, 30, Addressing.PKW): 2}
    assert layout_of(values) == ("2/30", "12/221")
    assert pack(values, ("2/30", "12/221")) == bytes((2, *bytes(7), 1, *bytes(7)))


def test_other_addresses_make_another_layout() -> None:
    assert layout_of({Address(0x6065): 1}) != layout_of({Address(0x6065, 1): 1})
