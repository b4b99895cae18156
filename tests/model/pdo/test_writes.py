"""The writes from one setup to another: they lead there, and no PDO is ever enabled with half a mapping."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from app.model.address import Address
from app.model.datatypes import Raw
from app.model.pdo.findings import is_stop_path
from app.model.pdo.objects import PdoParameters
from app.model.pdo.setup import (
    Mapped,
    PdoId,
    PdoPlace,
    PdoSetup,
    PdoSetups,
    objects_of,
    parse_setup,
)
from app.model.pdo.writes import Step, writes_between
from tests.model.pdo.rig import (
    RPDO1,
    RPDO2,
    TPDO2,
    changed,
    delivered,
    delivered_values,
    disabled,
    enabled,
    place,
    places,
)


def raws_of(one: PdoPlace, setup: PdoSetup) -> dict[Address, Raw]:
    pdo, parameters = one.id, setup.parameters
    by_sub = dict(zip((1, 2, 3, 5, 6), parameters, strict=True))
    found: dict[Address, Raw] = {pdo.parameter(sub): by_sub[sub] for sub in one.subs}
    found |= {pdo.mapped(sub): 0 for sub in range(1, one.room + 1)}
    found |= {pdo.mapped(sub): entry.raw for sub, entry in enumerate(setup.mapped, start=1)}
    return {**found, pdo.mapped(0): len(setup.mapped)}


@st.composite
def setups(draw: st.DrawFn) -> dict[PdoId, PdoSetup]:
    """Any setup at all that fits into the places of the device."""
    found = {}
    for one in places():
        subs = one.subs
        parameters = PdoParameters(
            draw(st.integers(0, 0xFFFFFFFF)),
            draw(st.integers(0, 255)),
            draw(st.integers(0, 0xFFFF)) if 3 in subs else 0,
            draw(st.integers(0, 0xFFFF)) if 5 in subs else 0,
        )
        entries = draw(st.lists(st.integers(0, 0xFFFFFFFF).map(Mapped), max_size=one.room))
        found[one.id] = PdoSetup(one.id, parameters, tuple(entries))
    return found


@given(setups(), setups())
def test_the_writes_lead_from_any_setup_to_any_other(before: PdoSetups, after: PdoSetups) -> None:
    values = {address: raw for one in places() for address, raw in raws_of(one, before[one.id]).items()}
    for write in writes_between(places(), before, after, is_stop_path):
        assert write.was is None or values[write.address] == write.was
        values[write.address] = write.raw
    assert {one.id: parse_setup(one, values.get) for one in places()} == after


@given(setups(), setups())
def test_no_pdo_is_enabled_before_all_of_it_is_written(before: PdoSetups, after: PdoSetups) -> None:
    values = {address: raw for one in places() for address, raw in raws_of(one, before[one.id]).items()}
    for write in writes_between(places(), before, after, is_stop_path):
        pdo = write.pdo
        enabled_before = parse_setup(place(pdo), values.get)
        assert enabled_before is not None
        if enabled_before.enabled:
            assert write.step is Step.DISABLE, "a PDO that is enabled is touched only to disable it"
        if write.address.major == pdo.mapped(0).major and write.address.minor:
            assert values[pdo.mapped(0)] == 0, "entries are written while none counts"
        values[write.address] = write.raw
        for one in places():
            now = parse_setup(one, values.get)
            assert now is not None
            assert not now.enabled or now in (before[one.id], after[one.id])


def test_nothing_is_written_where_nothing_changes() -> None:
    assert writes_between(places(), delivered(), delivered()) == []


def test_the_order_of_the_standard() -> None:
    before = delivered()
    after = {**before, TPDO2: enabled(before[TPDO2], "6064/32", "606C/32", event_ms=50)}
    told = [(write.step, write.address.short, write.raw) for write in writes_between(places(), before, after)]
    assert told == [
        (Step.CLEAR, "1A01", 0),
        (Step.MAP, "1A01:01", 0x60640020),
        (Step.MAP, "1A01:02", 0x606C0020),
        (Step.COUNT, "1A01", 2),
        (Step.PARAMETER, "1801:05", 50),
        (Step.ENABLE, "1801:01", 0x40000291),
    ]
    back = [(write.step, write.raw) for write in writes_between(places(), after, before)]
    assert back[0] == (Step.DISABLE, 0xC0000291)
    assert back[-1] == (Step.PARAMETER, 0)


def test_two_pdos_swap_their_identifiers_without_ever_sharing_one() -> None:
    first = {**delivered(), RPDO2: enabled(delivered()[RPDO2])}
    ids = first[RPDO1].parameters.cob_id, first[RPDO2].parameters.cob_id
    after = {**first, RPDO1: changed(first[RPDO1], cob_id=ids[1]), RPDO2: changed(first[RPDO2], cob_id=ids[0])}
    values = delivered_values() | raws_of(place(RPDO2), first[RPDO2])
    for write in writes_between(places(), first, after, is_stop_path):
        values[write.address] = write.raw
        now = [parse_setup(place(pdo), values.get) for pdo in (RPDO1, RPDO2)]
        alive = [one.parameters.can_id for one in now if one is not None and one.enabled]
        assert len(alive) == len(set(alive))


def test_what_stop_goes_by_is_off_for_as_short_as_can_be() -> None:
    before = {**delivered(), RPDO2: enabled(delivered()[RPDO2])}
    after = {
        **before,
        RPDO1: changed(before[RPDO1], cob_id=0x221),
        RPDO2: changed(before[RPDO2], "6040/16", "60FF/32"),
        TPDO2: enabled(before[TPDO2]),
    }
    writes = writes_between(places(), before, after, is_stop_path)
    off = [write.pdo for write in writes if write.step is Step.DISABLE]
    on = [write.pdo for write in writes if write.step is Step.ENABLE]
    assert (off[-1], on[0]) == (RPDO1, RPDO1)


def test_what_is_not_read_is_not_known() -> None:
    values = delivered_values()
    one = place(TPDO2)
    for address in objects_of(one):
        if address.minor <= 2:  # those that count: two objects are mapped
            assert parse_setup(one, {**values, address: b"\0"}.get) is None, address
    assert parse_setup(one, {**values, one.id.mapped(0): 0xFE}.get) is None  # a multiplex PDO
    more = parse_setup(one, {**values, one.id.mapped(0): 5}.get)
    assert more is not None and [entry.raw for entry in more.mapped[2:]] == [0, 0, 0]


def test_disabled_and_enabled_mean_the_same_frame() -> None:
    setup = delivered()[TPDO2]
    assert enabled(setup).same_frame(setup) and disabled(enabled(setup)) == setup
