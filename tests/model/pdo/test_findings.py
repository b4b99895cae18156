"""What is wrong with a setup of PDOs is found, at its place; what is sound is not complained of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest

from app.model.description import Access, PdoWay
from app.model.pdo.findings import Code, Finding, Part, Severity, find, is_stop_path
from app.model.pdo.identifiers import Taken, Use, is_restricted
from app.model.pdo.objects import PdoParameters
from app.model.pdo.setup import Mapped, PdoId, PdoSetup
from tests.model.pdo.rig import (
    NODE,
    RPDO1,
    RPDO2,
    TPDO1,
    TPDO2,
    TPDO3,
    changed,
    delivered,
    disabled,
    enabled,
    mapped,
    places,
    pmc,
)

FREE = 0x40000280 + NODE


def findings(*setups: PdoSetup, others: Sequence[Taken] = ()) -> list[Finding]:
    """Of the device as delivered, with these PDOs set up otherwise."""
    before = delivered()
    return find(pmc(), places(), before, {**before, **{setup.id: setup for setup in setups}}, others)


def errors(*setups: PdoSetup, others: Sequence[Taken] = ()) -> list[tuple[Code, PdoId, Part, int | None]]:
    found = findings(*setups, others=others)
    return [(one.code, one.pdo, one.part, one.entry) for one in found if one.severity is Severity.ERROR]


def codes(*setups: PdoSetup, others: Sequence[Taken] = ()) -> set[Code]:
    return {one.code for one in findings(*setups, others=others)}


def tpdo2(*objects: str, **parameters: int) -> PdoSetup:
    return enabled(delivered()[TPDO2], *objects, **parameters)


def rpdo2(*objects: str, **parameters: int) -> PdoSetup:
    return enabled(delivered()[RPDO2], *objects, **parameters)


def test_what_is_delivered_and_a_sound_change_have_no_error() -> None:
    assert errors() == []
    assert errors(tpdo2(), rpdo2()) == []
    assert findings(tpdo2("6064/32", "6041/16", event_ms=100)) == [f for f in findings() if f.pdo == TPDO1]


@pytest.mark.parametrize(
    ("setup", "code", "entry"),
    [
        (tpdo2("6041/16", "6065/32"), Code.NOT_MAPPABLE, 2),
        (rpdo2("6064/32"), Code.NOT_WRITABLE, 1),
        (tpdo2("7FFF/16"), Code.UNKNOWN_OBJECT, 1),
        (tpdo2("6041/32"), Code.WRONG_LENGTH, 1),
        (tpdo2("6041/16", "0005/8"), Code.DUMMY_IN_TPDO, 2),
        (replace(tpdo2(), mapped=(Mapped(0),)), Code.EMPTY_ENTRY, 1),
        (tpdo2("6041/16", "6064/32", "606C/32"), Code.TOO_MANY_BITS, None),
        (tpdo2("6041/16", "6061/8", "6061/8", "6061/8", "6061/8"), Code.TOO_MANY_OBJECTS, None),
        (replace(tpdo2(), mapped=()), Code.NO_OBJECT, None),
        (rpdo2("6040/16", "0006/32"), Code.WRONG_LENGTH, 2),
    ],
    ids=lambda value: value.value if isinstance(value, Code) else "",
)
def test_a_mapping_that_cannot_be_is_an_error_at_its_object(setup: PdoSetup, code: Code, entry: int | None) -> None:
    assert (code, setup.id, Part.MAPPING, entry) in errors(setup)


def test_an_object_that_can_only_be_written_is_not_sent() -> None:
    entry = pmc().entry(mapped("6041/16")[0].address)
    description = replace(pmc(), entries={**pmc().entries, entry.address: replace(entry, access=Access.WO)})
    before = delivered()
    found = find(description, places(), before, {**before, TPDO2: tpdo2("6041/16")}, [])
    assert Code.NOT_READABLE in {one.code for one in found if one.pdo == TPDO2}


@pytest.mark.parametrize(
    ("way", "sent", "received"),
    [(PdoWay.BOTH, True, True), (PdoWay.TRANSMIT, True, False), (PdoWay.RECEIVE, False, True)],
)
def test_an_object_goes_the_way_that_its_eds_allows(way: PdoWay, sent: bool, received: bool) -> None:
    """CiA 306: rwr is read by PDO and rww written, though both are read and written by SDO."""
    entry = pmc().entry(mapped("607A/32")[0].address)
    description = replace(pmc(), entries={**pmc().entries, entry.address: replace(entry, pdo_way=way)})
    before = delivered()
    after = {**before, TPDO2: tpdo2("607A/32"), RPDO2: rpdo2("607A/32")}
    found = {(one.code, one.pdo) for one in find(description, places(), before, after, [])}
    assert ((Code.NOT_READABLE, TPDO2) not in found) is sent
    assert ((Code.NOT_WRITABLE, RPDO2) not in found) is received


def test_bits_of_a_receive_pdo_may_be_filled_up() -> None:
    assert errors(rpdo2("6040/16", "0005/8", "0007/32")) == []


@pytest.mark.parametrize("odd", [3, 12])
def test_a_width_of_no_full_octets_is_told(odd: int) -> None:
    assert {Code.NOT_BYTES, Code.WRONG_LENGTH} <= codes(tpdo2(f"6041/{odd}", "6064/32"))


def test_an_object_twice_is_told() -> None:
    assert Code.TWICE in codes(tpdo2("6041/16", "6041/16"))


@pytest.mark.parametrize(
    ("first", "last"),
    [
        *[(0x000, 0x000), (0x001, 0x07F), (0x101, 0x180), (0x581, 0x5FF)],
        *[(0x601, 0x67F), (0x6E0, 0x6FF), (0x701, 0x77F), (0x780, 0x7FF)],
    ],
    ids=lambda value: f"{value:03X}",
)
def test_each_restricted_range_is_refused_and_its_neighbours_are_not(first: int, last: int) -> None:
    for can_id in (first, (first + last) // 2, last):
        assert (Code.RESTRICTED, TPDO2, Part.COB_ID, None) in errors(tpdo2(cob_id=0x40000000 | can_id)), hex(can_id)
    every = {can_id for can_id in range(0x800) if is_restricted(can_id)}
    assert set(range(first, last + 1)) <= every
    assert not every & {0x080, 0x100, 0x181, 0x580, 0x600, 0x680, 0x6DF, 0x700}


def test_identifiers_that_are_none_or_long() -> None:
    assert (Code.COB_ID_RANGE, TPDO2, Part.COB_ID, None) in errors(tpdo2(cob_id=0x40000800))
    assert Code.EXTENDED in codes(tpdo2(cob_id=0x60012345))
    assert errors(tpdo2(cob_id=0x60012345)) == []


OTHER = "wtg-07/blade-2/pmc"


@pytest.mark.parametrize(
    ("taken", "code"),
    [
        (Taken(0x291, False, Use.TPDO, OTHER, 2), Code.COB_ID_TAKEN),
        (Taken(0x291, False, Use.EMCY, OTHER), Code.COB_ID_TAKEN),
        (Taken(0x291, False, Use.SYNC, None), Code.COB_ID_TAKEN),
        (Taken(0x291, False, Use.RPDO, OTHER, 3), Code.COB_ID_LINKED),
        (Taken(0x291, True, Use.TPDO, OTHER, 3), None),
        (Taken(0x292, False, Use.TPDO, OTHER, 3), None),
    ],
    ids=str,
)
def test_an_identifier_that_others_use(taken: Taken, code: Code | None) -> None:
    found = {Code.COB_ID_TAKEN, Code.COB_ID_LINKED} & codes(tpdo2(), others=[taken])
    assert found == (set() if code is None else {code})


def test_an_identifier_of_another_pdo_of_the_node_is_taken_and_one_of_a_disabled_pdo_is_not() -> None:
    twin = tpdo2(cob_id=0x40000180 + NODE)
    assert (Code.COB_ID_TAKEN, TPDO2, Part.COB_ID, None) in errors(twin)
    assert (Code.COB_ID_TAKEN, TPDO1, Part.COB_ID, None) in errors(twin)
    assert errors(tpdo2(cob_id=0x40000380 + NODE)) == []  # TPDO3 has it, and is off


def test_two_nodes_may_take_the_same_frame() -> None:
    taken = Taken(0x311, False, Use.RPDO, OTHER, 2)
    assert Code.COB_ID_LINKED in codes(rpdo2(cob_id=0x311), others=[taken])
    assert errors(rpdo2(cob_id=0x311), others=[taken]) == []


@pytest.mark.parametrize("kind", [241, 248, 251])
def test_a_reserved_transmission_type_is_an_error(kind: int) -> None:
    assert (Code.TYPE_RESERVED, TPDO2, Part.TYPE, None) in errors(tpdo2(transmission_type=kind))


@pytest.mark.parametrize("kind", [0, 1, 240, 254, 255])
def test_the_other_types_are_sound(kind: int) -> None:
    assert errors(tpdo2(transmission_type=kind), rpdo2(transmission_type=kind)) == []


@pytest.mark.parametrize("kind", [252, 253])
def test_on_request_only_where_requests_are_allowed(kind: int) -> None:
    assert (Code.REMOTE_FORBIDDEN, TPDO2, Part.TYPE, None) in errors(tpdo2(transmission_type=kind))
    allowed = tpdo2(transmission_type=kind, cob_id=0x280 + NODE)
    assert errors(allowed) == [] and Code.REMOTE_ONLY in codes(allowed)
    assert (Code.TYPE_RESERVED, RPDO2, Part.TYPE, None) in errors(rpdo2(transmission_type=kind))


def test_timers_that_make_no_sense_are_told() -> None:
    assert Code.INHIBIT_OVER_EVENT in codes(tpdo2(inhibit_100us=1001, event_ms=100))
    assert Code.INHIBIT_OVER_EVENT not in codes(tpdo2(inhibit_100us=1000, event_ms=100))
    assert Code.TIMER_UNUSED in codes(tpdo2(transmission_type=1, event_ms=100))
    assert Code.NO_EVENT_TIMER in codes(tpdo2(event_ms=0))
    assert Code.NO_EVENT_TIMER not in codes(disabled(delivered()[TPDO1]), tpdo2("6041/16", event_ms=100))
    assert (Code.SYNC_START_RANGE, TPDO2, Part.SYNC_START, None) in errors(tpdo2(sync_start=241))
    assert (Code.NO_PARAMETER, RPDO2, Part.EVENT, None) in errors(rpdo2(event_ms=10))
    assert (Code.NO_PARAMETER, TPDO2, Part.SYNC_START, None) in errors(tpdo2(sync_start=1))


def test_where_nothing_can_change_an_event_never_comes() -> None:
    entry = pmc().entry(mapped("6041/16")[0].address)
    description = replace(pmc(), entries={**pmc().entries, entry.address: replace(entry, access=Access.CONST)})
    before = delivered()
    found = find(description, places(), before, {**before, TPDO2: tpdo2("6041/16")}, [])
    assert Code.NOTHING_TRIGGERS in {one.code for one in found if one.pdo == TPDO2}


@pytest.mark.parametrize(
    "setup",
    [
        disabled(delivered()[RPDO1]),
        changed(delivered()[RPDO1], "6040/16", "607A/32"),
        changed(delivered()[RPDO1], "607A/32"),
        changed(delivered()[RPDO1], transmission_type=1),
    ],
    ids=["off", "with more", "without", "waits for SYNC"],
)
def test_what_stop_goes_by_is_not_given_away(setup: PdoSetup) -> None:
    assert (Code.STOP_PATH, RPDO1, Part.MAPPING, None) in errors(setup)
    assert errors(setup, rpdo2("6040/16")) == []  # another one carries it


def test_the_statusword_is_not_given_away() -> None:
    assert (Code.STATUS_PATH, TPDO1, Part.MAPPING, None) in errors(disabled(delivered()[TPDO1]))
    assert errors(disabled(delivered()[TPDO1]), tpdo2()) == []


def test_a_node_that_had_no_path_for_stop_is_told_so_and_may_be_changed() -> None:
    before = {**delivered(), RPDO1: disabled(delivered()[RPDO1])}
    after = {**before, TPDO2: tpdo2()}
    found = {one.code: one.severity for one in find(pmc(), places(), before, after, [])}
    assert found[Code.STOP_PATH_MISSING] is Severity.WARNING
    assert Severity.ERROR not in found.values()


def test_what_is_off_and_stays_as_it_is_harms_nobody() -> None:
    before = {**delivered(), TPDO3: PdoSetup(TPDO3, PdoParameters(0x80000001, 245), (Mapped(0),) * 9)}
    assert [one for one in find(pmc(), places(), before, before, []) if one.pdo == TPDO3] == []


def test_the_commands_of_another_axis_are_neither_taken_nor_sent() -> None:
    """What enables that axis would enable this one, or what this one sends would be its controlword."""
    theirs = [Taken(0x293, False, Use.RPDO, OTHER, 1), Taken(0x293, False, Use.COMMANDS, OTHER, 1)]
    for setup in (rpdo2(cob_id=0x293), tpdo2(cob_id=0x40000293)):
        assert errors(setup, others=theirs) == [(Code.COMMANDS_OTHER, setup.id, Part.COB_ID, None)]
    before = {**delivered(), RPDO2: rpdo2(cob_id=0x293)}
    found = find(pmc(), places(), before, {**before, TPDO2: tpdo2()}, theirs)
    assert [one for one in found if one.severity is Severity.ERROR] == [], "where it stands so, other PDOs may change"


def test_frames_of_somebody_unknown_are_told_to_who_would_send_the_same() -> None:
    seen = [Taken(0x291, False, Use.SEEN, None)]
    assert Code.COB_ID_SEEN in codes(tpdo2(cob_id=0x40000291), others=seen)
    assert Code.COB_ID_SEEN not in codes(rpdo2(cob_id=0x291), others=seen)
    assert errors(tpdo2(cob_id=0x40000291), others=seen) == []


def test_a_receive_pdo_with_an_inhibit_time_is_no_way_for_a_stop() -> None:
    """A second STOP that came too soon after a command would be left out."""
    held = changed(delivered()[RPDO1], inhibit_100us=100)
    assert not is_stop_path(held)
    assert is_stop_path(delivered()[RPDO1])
