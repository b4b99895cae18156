"""The catalogue of faults, and what an order may say."""

from __future__ import annotations

import json
from typing import Any

import pytest

from app.errors import UsageError
from app.model.fault import (
    CATALOGUE,
    ActiveFault,
    FaultKind,
    FaultLevel,
    FaultOrder,
    FaultTarget,
    active_from_table,
    active_table,
    check_order,
    kind_from_table,
    kind_table,
    order_from_table,
    order_from_words,
    order_table,
    timed_order,
)
from app.model.texts import load_texts

KINDS = sorted(CATALOGUE)


def plain(kind: FaultKind) -> FaultOrder:
    """An order that gives no more than it must."""
    blade = 2 if kind.target is FaultTarget.BLADE else None
    return FaultOrder(kind.id, blade, 11 if kind.target is FaultTarget.NODE else None)


@pytest.mark.parametrize("name", KINDS)
def test_every_default_is_a_value_that_is_taken(name: str) -> None:
    kind = CATALOGUE[name]
    order = check_order(plain(kind))
    assert order.values == {parameter.name: parameter.default for parameter in kind.parameters}
    assert check_order(order) == order


@pytest.mark.parametrize("name", KINDS)
def test_limits_are_taken_and_what_lies_beyond_is_named(name: str) -> None:
    kind = CATALOGUE[name]
    for parameter in kind.parameters:
        if parameter.name in ("first_id", "last_id"):
            continue
        for value in (parameter.low, parameter.high):
            assert check_order(FaultOrder(name, *place(kind), {parameter.name: value})).values[parameter.name] == value
        for value in (parameter.low - 1, parameter.high + 1, float("nan"), float("inf"), True):
            with pytest.raises(UsageError) as caught:
                check_order(FaultOrder(name, *place(kind), {parameter.name: value}))
            assert caught.value.details["field"] == parameter.name


def place(kind: FaultKind) -> tuple[int | None, int | None]:
    order = plain(kind)
    return order.blade, order.node


@pytest.mark.parametrize("name", KINDS)
def test_tables_keep_everything(name: str) -> None:
    kind = CATALOGUE[name]
    seconds = None if kind.momentary else 2.5
    active = ActiveFault(7, check_order(FaultOrder(name, *place(kind), {}, seconds)), 123)
    told = json.loads(json.dumps([active_table(active), kind_table(kind)]))
    assert active_from_table(told[0]) == active
    assert kind_from_table(told[1]) == kind
    assert order_from_table(order_table(active.order)) == active.order


@pytest.mark.parametrize("language", ["en", "de"])
def test_everything_has_its_text(language: str) -> None:
    texts = load_texts(language)
    keys = [f"fault.{name}.{part}" for name in KINDS for part in ("name", "hint")]
    keys += [f"fault_parameter.{parameter.name}" for kind in CATALOGUE.values() for parameter in kind.parameters]
    assert not [key for key in keys if texts(key) == key]


@pytest.mark.parametrize(
    ("table", "field"),
    [
        ({"blade": 1}, "fault"),
        ({"fault": 3}, "fault"),
        ({"fault": "flood"}, "kind"),
        ({"fault": "bloc_weak"}, "blade"),
        ({"fault": "bloc_weak", "blade": 4}, "blade"),
        ({"fault": "bloc_weak", "blade": "2"}, "blade"),
        ({"fault": "bloc_weak", "blade": 1, "node": 2}, "node"),
        ({"fault": "node_gone"}, "node"),
        ({"fault": "node_gone", "node": 0}, "node"),
        ({"fault": "node_gone", "node": 128}, "node"),
        ({"fault": "node_gone", "node": 1.5}, "node"),
        ({"fault": "node_gone", "node": 1, "blade": 1}, "blade"),
        ({"fault": "mains_failure", "for_s": -1}, "for_s"),
        ({"fault": "mains_failure", "for_s": "long"}, "for_s"),
        ({"fault": "gust", "for_s": 3}, "for_s"),
        ({"fault": "gust", "blade": 2}, "blade"),
        ({"fault": "mains_failure", "depth": 3}, "depth"),
        ({"fault": "bloc_weak", "blade": 1, "bloc": 1.5}, "bloc"),
        ({"fault": "bloc_weak", "blade": 1, "bloc": "one"}, "bloc"),
        ({"fault": "frames_lost", "first_id": 9, "last_id": 8}, "first_id"),
    ],
)
def test_what_is_wrong_is_named(table: dict[str, Any], field: str) -> None:
    with pytest.raises(UsageError) as caught:
        order_from_table(table)
    assert caught.value.details["field"] == field
    assert f"'{field}'" in caught.value.details["reason"]


def test_an_order_of_words() -> None:
    order = order_from_words("second_master", ["node=11", "index=0x60FB", "sub=1", "raw=5", "for_s=2.5"])
    assert (order.node, order.seconds, order.values["index"], order.values["sub"]) == (11, 2.5, 0x60FB, 1)
    for word in ("node", "=3", "node=eleven", "fault=gust"):
        with pytest.raises(UsageError):
            order_from_words("node_gone", [word])


def test_an_order_with_its_time() -> None:
    at_s, order = timed_order("brake_stuck@5s,blade=2,lifted=1")
    assert (at_s, order.kind, order.blade, order.values) == (5.0, "brake_stuck", 2, {"lifted": 1})
    assert timed_order("mains_failure")[0] == 0.0
    assert timed_order("mains_failure@1.5")[0] == 1.5
    for text in ("mains_failure@soon", "mains_failure@-1s", "flood@2s", ""):
        with pytest.raises(UsageError):
            timed_order(text)


def test_both_levels_are_there() -> None:
    levels = [kind.level for kind in CATALOGUE.values()]
    assert levels.count(FaultLevel.DEVICE) == 17
    assert levels.count(FaultLevel.WIRE) == 9
