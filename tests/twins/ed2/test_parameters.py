"""Every parameter of the description over the line: how it reads, what it takes, and with which code it refuses."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from app.model.checks import limits_of
from app.model.datatypes import Raw
from app.model.description import Access, Entry
from app.model.description_file import load_builtin
from app.twins.ed2.delivered import INCREMENTAL
from app.twins.ed2.device import Settings
from app.wire.profibus import pkw
from app.wire.profibus.pkw import PkwError, ReplyKind
from tests.twins.ed2.rig import Master, RefusedError, made

DESCRIPTION = load_builtin("wandfluh-ed2")
ENTRIES = tuple(DESCRIPTION)
SIZES = {1: ReplyKind.BYTE, 2: ReplyKind.WORD, 4: ReplyKind.DOUBLE}
COMMANDS = {"0/51", "12/224", "12/225", "0/41", "0/53", "0/39", "0/40", "0/37", "12/21"}
"""Their writes do more, or less, than keep a value: other tests have them."""
PLAIN = [one for one in ENTRIES if one.access is Access.RW and one.address.short not in COMMANDS]


def name(entry: Entry) -> str:
    return f"{entry.address.short}-{entry.name}"


@pytest.fixture(scope="module")
def master() -> Master:
    """Of a twin with sensors that open the parameters of reference runs too."""
    rig = made(Settings(transducer=INCREMENTAL))
    rig.master.start(1)
    return rig.master


def opened(master: Master, entry: Entry) -> None:
    """Bring about what a write needs."""
    for condition in entry.requires:
        where = condition.address.short
        if master.read(where) not in condition.values:
            master.write(where, condition.values[0])


def raw_of(master: Master, entry: Entry) -> int:
    return master.read(entry.address.short)


def bounds(master: Master, entry: Entry) -> tuple[int, int]:
    def lookup(address: object) -> Raw | None:
        return master.read(str(address))

    low, high = limits_of(entry, lookup)
    assert low is not None
    assert high is not None
    return int(low), int(high)


def allowed(master: Master, entry: Entry) -> list[int]:
    """Values that must be taken: those of the enumeration, else both limits."""
    names = DESCRIPTION.enumeration_of(entry, lambda address: master.read(str(address)))
    if names is not None:
        return [value.value for value in names.values]
    low, high = entry.only[:: len(entry.only) - 1] if entry.only else bounds(master, entry)
    return [low, high]


def test_there_are_59() -> None:
    assert len(ENTRIES) == 59


@pytest.mark.parametrize("entry", ENTRIES, ids=name)
def test_it_reads_in_its_length_or_says_that_it_cannot(master: Master, entry: Entry) -> None:
    answer = master.do(pkw.read(entry.address, 0x0100))
    if entry.access is Access.WO:
        assert (answer.kind, answer.value) == (ReplyKind.REFUSED, PkwError.OTHER)
    else:
        assert entry.type.size is not None
        assert answer.kind is SIZES[entry.type.size]


@pytest.mark.parametrize("entry", PLAIN, ids=name)
def test_it_takes_what_it_may_and_keeps_it(master: Master, entry: Entry) -> None:
    opened(master, entry)
    before = raw_of(master, entry)
    for raw in (*allowed(master, entry), before):
        master.write(entry.address.short, raw)
        assert raw_of(master, entry) == raw


@pytest.mark.parametrize("entry", PLAIN, ids=name)
def test_it_refuses_what_is_out_of_range_and_stays(master: Master, entry: Entry) -> None:
    opened(master, entry)
    before, values = raw_of(master, entry), allowed(master, entry)
    span = entry.type.range
    assert span is not None
    for raw in (min(values) - 1, max(values) + 1):
        if span[0] <= raw <= span[1]:
            refusal = master.refused(partial(master.write, entry.address.short, raw))
            assert refusal is PkwError.OUT_OF_RANGE
    assert raw_of(master, entry) == before


@pytest.mark.parametrize("entry", [one for one in ENTRIES if one.access is not Access.RO], ids=name)
def test_it_refuses_another_length(master: Master, entry: Entry) -> None:
    for size in SIZES:
        if size != entry.type.size:
            answer = master.do(pkw.write(entry.address, bytes(size)))
            assert (answer.kind, answer.value) == (ReplyKind.REFUSED, PkwError.WRONG_LENGTH)


@pytest.mark.parametrize("entry", [one for one in ENTRIES if one.access is Access.RO], ids=name)
def test_what_is_only_told_cannot_be_changed(master: Master, entry: Entry) -> None:
    assert entry.type.size is not None
    answer = master.do(pkw.write(entry.address, bytes(entry.type.size)))
    assert (answer.kind, answer.value) == (ReplyKind.REFUSED, PkwError.NOT_CHANGEABLE)


@pytest.mark.parametrize(
    "entry", [one for one in PLAIN if any(c.address.short != "0/41" for c in one.requires)], ids=name
)
def test_without_its_condition_it_cannot_be_changed(entry: Entry) -> None:
    rig = made()  # Gray code, proportional valve, limits off
    rig.master.start(1)
    condition = next(one for one in entry.requires if one.address.short != "0/41")
    where, wrong = condition.address.short, 1 - condition.values[0]
    if rig.master.read(where) in condition.values:
        rig.master.write(where, wrong)
    raw = allowed(rig.master, entry)[0]
    with pytest.raises(RefusedError) as caught:
        rig.master.write(entry.address.short, raw)
    assert caught.value.code is PkwError.NOT_CHANGEABLE


def test_a_twin_whose_memory_is_damaged_says_so_and_starts_as_delivered(tmp_path: Path) -> None:
    for number in (1, 2):
        (tmp_path / f"ed2-6-axis-{number}.json").write_text("{", encoding="utf-8")
    rig = made(Settings(state=tmp_path))
    assert len(rig.device.problems) == 2
    rig.master.start(1)
    assert [rig.master.read(where) for where in ("0/40", "0/39", "0/53", "12/219", "12/61")] == [9, 1, 0, 2, 100]
    assert rig.master.set(0x7, 0) & 0xF == 0xF
