"""Rows of motors: all or none of many, versions that nobody rewrites, and which motor a device drives."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from decimal import Decimal
from functools import partial
from pathlib import Path

import pytest

from app.errors import StoreError
from app.model.address import Address
from app.model.motor import Draft, Motor, Plate, Source
from app.store import database, motor_rows
from app.store.motor_rows import Assigned
from app.store.store import Store

DRAFT = Draft("Würth", "PM 5.5-2", Plate(power_kw=Decimal("5.5"), brake="24 V"), {Address(0x6410, 3): 4000}, "a\nb")
MOTOR = Motor("m1", 1, DRAFT, Source.DEVICE, "wtg-07/blade-1/pmc", 17, "Anna", "1.0.0")


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    opened = Store.open(tmp_path)
    yield opened
    opened.close()


def test_a_motor_comes_back_as_it_was_and_only_the_newest_is_listed(store: Store) -> None:
    second = replace(MOTOR, version=2, source=Source.TYPED, origin="", draft=replace(DRAFT, remarks=""))
    other = replace(MOTOR, id="m2")
    for motor in (MOTOR, second, other):
        store.call(partial(motor_rows.put_version, motor=motor))
    assert store.call(motor_rows.newest) == [second, other]
    assert store.call(lambda kept: motor_rows.versions_of(kept, "m1")) == [second, MOTOR]


def test_of_many_versions_all_are_kept_or_none(store: Store) -> None:
    with pytest.raises(StoreError):
        store.call(lambda kept: motor_rows.put_versions(kept, [MOTOR, replace(MOTOR, id="m2"), MOTOR]))
    assert store.call(motor_rows.newest) == []


def test_a_deleted_motor_keeps_its_versions_and_another_one_lists_it_again(store: Store) -> None:
    store.call(lambda kept: motor_rows.put_version(kept, MOTOR))
    store.call(lambda kept: motor_rows.delete_motor(kept, "m1", 99))
    assert store.call(motor_rows.newest) == []
    assert store.call(lambda kept: motor_rows.versions_of(kept, "m1")) == [replace(MOTOR, deleted=True)]
    store.call(lambda kept: motor_rows.put_version(kept, replace(MOTOR, version=2)))
    assert [motor.version for motor in store.call(motor_rows.newest)] == [2]


def test_the_newest_word_on_a_device_counts(store: Store) -> None:
    for number, (device, motor) in enumerate((("a", "m1"), ("b", "m1"), ("a", "m2"))):
        row = Assigned(f"{number}", device, motor, 1, number, "Anna")
        store.call(partial(motor_rows.assign, row=row))
    assert [(row.device, row.motor_id) for row in store.call(motor_rows.assigned)] == [("a", "m2"), ("b", "m1")]


def test_no_version_is_rewritten_not_even_behind_our_back(tmp_path: Path) -> None:
    store = Store.open(tmp_path / "data")
    store.call(lambda kept: motor_rows.put_version(kept, MOTOR))
    store.close()
    with (
        closing(sqlite3.connect(tmp_path / "data" / database.FILE)) as raw,
        pytest.raises(sqlite3.IntegrityError, match="never changed"),
    ):
        raw.execute("UPDATE motor_versions SET content = '{}'")
