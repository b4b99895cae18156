"""UUIDs of version 7: the fields of RFC 9562, and their order."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from uuid import RFC_4122, UUID

from app.store.uuid7 import Uuid7

NOW_NS = 1_645_557_742_000_000_000
"""That of the example in RFC 9562, appendix A.6."""


def test_the_fields_are_those_of_the_standard() -> None:
    made = UUID(Uuid7(lambda: NOW_NS)())
    assert made.int >> 80 == 0x017F22E279B0
    assert made.version == 7
    assert made.variant == RFC_4122


def test_each_is_greater_than_the_one_before_even_where_the_clock_goes_back() -> None:
    clock = iter([NOW_NS] * 10_000 + [NOW_NS - 5_000_000_000] * 10_000 + [NOW_NS + 60_000_000_000] * 100)
    new_id = Uuid7(lambda: next(clock))
    made = [new_id() for _ in range(20_100)]
    assert made == sorted(set(made))


def test_threads_never_get_the_same() -> None:
    new_id = Uuid7(lambda: NOW_NS)
    with ThreadPoolExecutor(8) as pool:
        made = list(pool.map(lambda _n: new_id(), range(5_000)))
    assert len(set(made)) == 5_000
