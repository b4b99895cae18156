"""The description of ED2 holds what its manual asks of the schema."""

from __future__ import annotations

from decimal import Decimal

import pytest

from app.errors import LimitError, PreconditionError, ValueTypeError
from app.model.address import parse_address
from app.model.checks import check_write, limits_of
from app.model.datatypes import Raw
from app.model.description import Access, Bus, Lookup
from app.model.description_file import load_builtin
from app.model.values import quantity_of

ED2 = load_builtin("wandfluh-ed2")


def device_with(values: dict[str, Raw]) -> Lookup:
    known = {parse_address(address): raw for address, raw in values.items()}
    return known.get


def test_ed2_has_its_parameters_addressed_by_ind_and_pnu() -> None:
    assert {str(row.address) for row in ED2} >= {"0/51", "1/84", "3/73", "3/133", "12/61", "12/216"}
    assert ED2.bus is Bus.PROFIBUS_DP


def test_ed2_magnet_current_needs_a_proportional_valve() -> None:
    current = ED2.entry(parse_address("3/73"))
    assert check_write(ED2, current, 200, device_with({"3/133": 0})) == (200).to_bytes(2, "little")
    with pytest.raises(PreconditionError):
        check_write(ED2, current, 200, device_with({"3/133": 1}))
    with pytest.raises(LimitError):
        check_write(ED2, current, 951, device_with({"3/133": 0}))


def test_ed2_fast_velocity_is_limited_by_the_ramp_velocity() -> None:
    fast = ED2.entry(parse_address("12/216"))
    assert limits_of(fast, device_with({"12/61": 150})) == (Decimal(0), Decimal(150))
    with pytest.raises(LimitError):
        check_write(ED2, fast, 151, device_with({"12/61": 150}))


@pytest.mark.parametrize(("raw", "unit"), [(1, "mm/s"), (2, "in/s"), (3, "°/s")])
def test_ed2_unit_depends_on_the_unit_of_the_device(raw: int, unit: str) -> None:
    for address in ("12/61", "12/216"):
        quantity = quantity_of(ED2.entry(parse_address(address)), device_with({"1/84": raw}))
        assert (quantity.unit, quantity.scale) == (unit, Decimal("0.1"))


def test_ed2_enumeration_takes_its_own_values_only() -> None:
    unit = ED2.entry(parse_address("1/84"))
    assert check_write(ED2, unit, 3, device_with({})) == b"\x03"
    with pytest.raises((LimitError, ValueTypeError)):
        check_write(ED2, unit, 4, device_with({}))


def test_ed2_saves_all_with_the_bytes_of_save_in_telegram_order() -> None:
    (command,) = ED2.save
    assert ED2.entry(command.address).access is Access.WO
    assert command.signature.to_bytes(4, "big") == b"save"
    assert command.category is None
