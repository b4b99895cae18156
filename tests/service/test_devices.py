"""What comes over the wire as raw values that a set can hold."""

from __future__ import annotations

import struct
from dataclasses import replace

import pytest

from app.model.address import Address
from app.model.datatypes import DataType
from app.model.description_file import load_builtin
from app.model.sets import dump_set, load_set
from app.service.devices import decode
from tests.model.set_rig import whole_set

ENTRY = replace(load_builtin("oat-pmc").entries[Address(0x6065)], type=DataType.REAL32)


@pytest.mark.parametrize("number", [float("nan"), float("inf"), float("-inf")])
def test_a_float_that_is_no_number_stays_its_bytes_so_that_a_set_can_hold_it(number: float) -> None:
    data = struct.pack("<f", number)
    raw = decode(ENTRY, data)
    assert raw == data
    parameters = whole_set("oat-pmc")
    parameters = replace(parameters, values={**parameters.values, ENTRY.address: raw})
    assert load_set(dump_set(parameters), "x.json") == parameters


def test_numbers_are_numbers_and_what_has_another_length_its_bytes() -> None:
    assert decode(ENTRY, struct.pack("<f", -1.5)) == -1.5
    assert decode(ENTRY, b"\1\2") == b"\1\2"
