"""Raw, scaled, shown; and what may be written."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.errors import AccessError, LimitError, MotionError, PreconditionError, UsageError, ValueTypeError
from app.model.address import Address, Addressing, parse_address
from app.model.checks import Allow, check_write, limits_of
from app.model.datatypes import DataType, Raw, decode_raw, encode_raw
from app.model.description import Description, Lookup
from app.model.description_file import load_builtin
from app.model.values import Scaled, parse, show, to_scaled

WARNING, ERROR = Address(0x2000, 1), Address(0x2000, 2)
OUTPUTS, KIND, OFFSET = Address(0x2001), Address(0x2002), Address(0x2003)
FEED, SHAFT, LABEL = Address(0x2004, 1), Address(0x2004, 2), Address(0x2005)


def knows(values: Mapping[Address, Raw] | None = None) -> Lookup:
    return (values or {}).get


def test_scaled_and_shown(toy: Description) -> None:
    entry = toy.entry(WARNING)
    assert to_scaled(entry, 495, knows()) == Scaled(Decimal("49.5"), "°C")
    assert show(entry, 495, knows()) == "49.5"
    assert show(entry, -5, knows()) == "-0.5"
    assert show(toy.entry(OUTPUTS), 0x31, knows()) == "31h"
    assert show(toy.entry(LABEL), "abc", knows()) == "abc"


@pytest.mark.parametrize(
    ("address", "text", "raw"),
    [
        (WARNING, "49.5", 495),
        (WARNING, "49,5 °C", 495),
        (WARNING, "raw:495", 495),
        (WARNING, "FFFFh", -1),
        (WARNING, "-0.1", -1),
        (OUTPUTS, "0x31", 0x31),
        (KIND, "three", -3),
        (KIND, "1", 1),
        (LABEL, "hello", "hello"),
    ],
)
def test_what_a_person_types(toy: Description, address: Address, text: str, raw: Raw) -> None:
    assert parse(toy, toy.entry(address), text, knows()) == raw


@pytest.mark.parametrize(
    ("address", "text", "reason"),
    [
        (WARNING, "warm", "no number"),
        (WARNING, "49.55", "resolution"),
        (WARNING, "49.5 K", "unit"),
        (WARNING, "raw:x", "raw:"),
        (KIND, "two", "no number"),
    ],
)
def test_what_does_not_fit_is_told(toy: Description, address: Address, text: str, reason: str) -> None:
    with pytest.raises(ValueTypeError) as caught:
        parse(toy, toy.entry(address), text, knows())
    assert reason in caught.value.details["reason"]


@pytest.mark.parametrize(
    ("address", "text", "raw"),
    [("2011", "192.168.2.20", 0xC0A80214), ("2012", "255.255.255.0", 0xFFFFFF00), ("2016", "0.0.0.0", 0)],
)
def test_an_address_of_the_internet_is_four_numbers(address: str, text: str, raw: int) -> None:
    pd4e = load_builtin("nanotec-pd4e")
    entry = pd4e.entry(parse_address(address))
    assert show(entry, raw, knows()) == text
    assert parse(pd4e, entry, text, knows()) == raw
    assert parse(pd4e, entry, f"{raw:X}h", knows()) == raw
    for wrong in ("192.168.2", "192.168.2.256", "1.2.3.4.5", "1.2.3.x"):
        with pytest.raises(ValueTypeError) as caught:
            parse(pd4e, entry, wrong, knows())
        assert "192.168.2.20" in caught.value.details["reason"]


def test_a_position_follows_the_feed_constant(toy: Description) -> None:
    entry = toy.entry(OFFSET)
    assert show(entry, 9000, knows()) == "90.00", "the default until the feed constant is known"
    tenth = knows({FEED: 3600, SHAFT: 1})
    assert to_scaled(entry, 900, tenth) == Scaled(Decimal(90), "°")
    assert parse(toy, entry, "90", tenth) == 900


def test_a_write_is_checked_before_it_is_sent(toy: Description) -> None:
    assert check_write(toy, toy.entry(WARNING), 495, knows({ERROR: 550})) == b"\xef\x01"
    with pytest.raises(LimitError) as caught:
        check_write(toy, toy.entry(WARNING), 551, knows({ERROR: 550}))
    assert (caught.value.details["maximum"], caught.value.details["unit"]) == ("55.0", "°C")
    with pytest.raises(LimitError):
        check_write(toy, toy.entry(OUTPUTS), 256, knows())
    with pytest.raises(ValueTypeError):
        check_write(toy, toy.entry(OUTPUTS), "x", knows())
    with pytest.raises(ValueTypeError) as wrong:
        check_write(toy, toy.entry(KIND), 2, knows())
    assert "one of" in wrong.value.details["reason"]
    with pytest.raises(AccessError):
        check_write(toy, toy.entry(LABEL), "x", knows())


def test_factory_objects_need_the_factory(toy: Description) -> None:
    with pytest.raises(AccessError):
        check_write(toy, toy.entry(FEED), 2, knows())
    assert check_write(toy, toy.entry(FEED), 2, knows(), allow=Allow.FACTORY) == b"\2\0\0\0"


def test_what_can_move_an_axis_is_no_ordinary_parameter() -> None:
    pmc = load_builtin("oat-pmc")
    controlword = pmc.entry(Address(0x6040))
    with pytest.raises(MotionError):
        check_write(pmc, controlword, 0x010F, knows())
    assert check_write(pmc, controlword, 0x010F, knows(), allow=Allow.MOTION) == b"\x0f\x01"


def test_preconditions(toy: Description) -> None:
    entry = toy.entry(OFFSET)
    assert check_write(toy, entry, 5, knows({KIND: 1})) == b"\5\0\0\0"
    with pytest.raises(PreconditionError) as caught:
        check_write(toy, entry, 5, knows({KIND: -3}))
    assert caught.value.details["needs"] == "2002 = 1"


def test_a_single_value_beyond_the_limits() -> None:
    """The cycle of the battery test: 0 switches it off, else it is an hour at least."""
    pmm = load_builtin("oat-pmm")
    cycle = pmm.entry(Address(0x30E3))
    assert check_write(pmm, cycle, 0, knows()) == b"\0\0"
    assert check_write(pmm, cycle, 60, knows()) == b"\x3c\0"
    with pytest.raises(LimitError):
        check_write(pmm, cycle, 59, knows())


def test_variants_have_their_own_limits(toy: Description) -> None:
    entry = toy.entry(ERROR)
    assert limits_of(entry, knows()) == (Decimal(-400), Decimal(900))
    assert limits_of(entry, knows(), "big") == (Decimal(-400), Decimal(1200))


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("6065", Address(0x6065)),
        ("3110:01", Address(0x3110, 1)),
        ("0x3110:1", Address(0x3110, 1)),
        ("12/221", Address(12, 221, Addressing.PKW)),
    ],
)
def test_addresses(text: str, address: Address) -> None:
    assert parse_address(text) == address
    assert parse_address(str(address)) == address
    assert parse_address(address.short) == address


@pytest.mark.parametrize("text", ["", "60", "60650", "6065:100", "12/300", "x/1", "6065:"])
def test_no_addresses(text: str) -> None:
    with pytest.raises(UsageError):
        parse_address(text)


@given(st.sampled_from([t for t in DataType if t.is_integer]), st.data())
def test_integers_survive_the_wire(data_type: DataType, data: st.DataObject) -> None:
    span = data_type.range
    assert span is not None
    raw = data.draw(st.integers(*span))
    assert decode_raw(data_type, encode_raw(data_type, raw)) == raw
    for outside in (span[0] - 1, span[1] + 1):
        with pytest.raises(ValueError, match="outside"):
            encode_raw(data_type, outside)
