"""Sets as vectors: equal words for equal values, others for others."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.model.address import Address, Addressing
from app.model.datatypes import DataType, Raw
from app.model.description_file import BUILTIN, load_builtin
from app.model.set_vector import WIDTH, layout_of, pack, places, words

INTEGERS = st.integers(-(2**63), 2**64 - 1)
RAW = INTEGERS | st.floats(allow_nan=False) | st.text(max_size=40) | st.binary(max_size=40)
ADDRESSES = st.builds(Address, st.integers(0, 0xFFFF), st.integers(0, 0xFF), st.just(Addressing.OD))


@given(st.dictionaries(ADDRESSES, RAW, max_size=20))
def test_a_layout_names_every_address_in_its_order(values: dict[Address, Raw]) -> None:
    layout = layout_of(values)
    found = places(layout)
    assert list(found) == [str(address) for address in sorted(values)]
    vector, end = pack(values, layout), 0
    for address, (start, count) in zip(sorted(values), found.values(), strict=True):
        assert start == end
        end += count
        assert vector[WIDTH * start : WIDTH * end] == words(values[address], count)
    assert len(vector) == WIDTH * end


TYPES = [one for one in DataType if one.range is not None and not (one.is_signed and (one.bits or 0) > 32)]


@given(st.sampled_from(TYPES).flatmap(lambda one: st.tuples(*[st.integers(*one.range)] * 2)))  # type: ignore[misc]
def test_words_of_integers_are_equal_where_the_values_are(pair: tuple[int, int]) -> None:
    same_words(*pair)


@given(st.tuples(st.text(), st.text()) | st.tuples(st.binary(), st.binary()) | st.tuples(st.floats(), st.floats()))
def test_other_words_are_equal_where_the_values_are(pair: tuple[Raw, Raw]) -> None:
    if repr(pair[0]) != repr(pair[1]) or isinstance(pair[0], str | bytes):  # NaNs of many bits look alike
        same_words(*pair)


def same_words(one: Raw, other: Raw) -> None:
    address = Address(0x6065)
    layouts = [layout_of({address: raw}) for raw in (one, other)]
    vectors = [pack({address: raw}, layout) for raw, layout in zip((one, other), layouts, strict=True)]
    assert ((layouts[0], vectors[0]) == (layouts[1], vectors[1])) == (repr(one) == repr(other))


def test_no_description_has_an_integer_that_two_values_share_a_word_of() -> None:
    types = {entry.type for name in BUILTIN for entry in load_builtin(name)}
    assert not [one for one in types if one.is_signed and (one.bits or 0) > 32]


def test_a_layout_of_other_values_is_refused() -> None:
    with pytest.raises(KeyError):
        pack({Address(0x6065): "text"}, ("6065:00",))
    with pytest.raises(KeyError):
        pack({Address(0x6065): 1}, ("6066:00",))


def test_numbers_of_profibus_are_sorted_as_numbers() -> None:
    values = {Address(12, 221, Addressing.PKW): 1, Address(2, 30, Addressing.PKW): 2}
    assert layout_of(values) == ("2/30", "12/221")
    assert pack(values, ("2/30", "12/221")) == bytes((2, 0, 0, 0, 1, 0, 0, 0))


def test_other_addresses_make_another_layout() -> None:
    assert layout_of({Address(0x6065): 1}) != layout_of({Address(0x6065, 1): 1})
