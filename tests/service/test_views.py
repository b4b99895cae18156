"""What the page is told, from frames through the real decoder; and what becomes of it in the 3D view."""

from __future__ import annotations

import struct

import pytest

from app.errors import ValueTypeError
from app.model.address import Address
from app.model.datatypes import DataType, encode_raw
from app.scene.hub import BladeState
from app.service import views
from app.service.connection import Connection
from app.service.journal import Journal, Kind
from app.service.scene_feed import pose
from app.wire import sdo
from app.wire.events import EventKind
from app.wire.nmt import NmtState
from tests.web.rig import BUS, Feeder, make_connection

PMC = "wtg-07/blade-1/pmc"
PMM = "wtg-07/blade-1/pmm"
STATUSWORD = Address(0x6041)
SECOND_NS = 1_000_000_000


@pytest.fixture
def bench() -> Connection:
    return make_connection()


@pytest.fixture
def feeder(bench: Connection) -> Feeder:
    return Feeder(bench)


def axis(bench: Connection, later_ns: int = 0) -> views.AxisLine:
    targets = {target.slug: target for target in bench.targets}
    return views.axis_lines(bench.turbine, targets, bench.stamper() + later_ns)[0]


def feed_angle(feeder: Feeder, raw: int) -> None:
    feeder.read(11, Address(0x6092, 1), struct.pack("<I", 36_000))
    feeder.read(11, Address(0x6092, 2), struct.pack("<I", 1))
    feeder.read(11, Address(0x6064), struct.pack("<i", raw))


def test_the_newest_of_two_objects_of_one_quantity_counts(bench: Connection, feeder: Feeder) -> None:
    feed_angle(feeder, 8000)
    feeder.read(11, Address(0x5064), struct.pack("<h", 8100))
    assert axis(bench).position_deg == 81.0
    feeder.read(11, Address(0x6064), struct.pack("<i", 8200))
    assert axis(bench).position_deg == 82.0


def test_a_target_is_a_demand_only_while_the_axis_follows_it(bench: Connection, feeder: Feeder) -> None:
    feed_angle(feeder, 8000)
    feeder.read(11, Address(0x607A), bytes(4))
    assert axis(bench).demand_deg is None
    feeder.read(11, Address(0x6041), struct.pack("<H", 0x0237))
    feeder.read(11, Address(0x6061), bytes((1,)))
    assert axis(bench).demand_deg == 0.0
    feeder.read(11, Address(0x6061), bytes((3,)))
    assert axis(bench).demand_deg is None


def test_units_are_those_of_the_names(bench: Connection, feeder: Feeder) -> None:
    feeder.read(11, Address(0x6079), struct.pack("<I", 315_500))
    assert axis(bench).dc_link_v == 315.5
    feeder.read(1, Address(0x3063), struct.pack("<H", 320))
    assert axis(bench).dc_link_v == 320


def test_a_position_is_stale_after_a_second_and_after_lost_frames(bench: Connection, feeder: Feeder) -> None:
    assert axis(bench).stale
    feed_angle(feeder, 8000)
    assert not axis(bench).stale
    assert axis(bench, SECOND_NS + 1).stale
    bench.buses[BUS].gap(bench.stamper())
    assert axis(bench).stale
    assert axis(bench).position_deg == 80.0


def test_a_restart_makes_the_position_unknown(bench: Connection, feeder: Feeder) -> None:
    feed_angle(feeder, 8000)
    feeder.heartbeat(11, NmtState.BOOT_UP)
    assert (axis(bench).position_deg, axis(bench).stale) == (None, True)


STATES = [
    (0x0000, "not_ready_to_switch_on"), (0x0240, "switch_on_disabled"), (0x0231, "ready_to_switch_on"),
    (0x0233, "switched_on"), (0x0637, "operation_enabled"), (0x0217, "quick_stop_active"),
    (0x021F, "fault_reaction_active"), (0x0218, "fault"), (0x0238, "fault"),
]  # fmt: skip


@pytest.mark.parametrize(("status", "name"), STATES)
def test_states_of_the_statusword(bench: Connection, feeder: Feeder, status: int, name: str) -> None:
    feeder.read(11, Address(0x6041), struct.pack("<H", status))
    assert axis(bench).state == f"axis_state.{name}"
    assert views.device_state(bench.target(PMC)) == f"axis_state.{name}"


def test_faults_come_from_the_error_code_or_from_an_emergency_whichever_is_newer(
    bench: Connection, feeder: Feeder
) -> None:
    assert axis(bench).fault_code is None
    feeder.read(11, Address(0x603F), bytes(2))
    assert (axis(bench).fault_code, axis(bench).fault_text_key) == (0, None)
    feeder.can(0x80 + 11, struct.pack("<HB5x", 0x2310, 1))
    assert (axis(bench).fault_code, axis(bench).fault_text_key) == (0x2310, "error_code.over_current_output")
    feeder.read(11, Address(0x603F), bytes(2))
    assert axis(bench).fault_code == 0
    feeder.can(0x80 + 1, struct.pack("<HB5x", 0xFFFE, 1))
    assert (axis(bench).fault_code, axis(bench).fault_text_key) == (0xFFFE, None)


def test_each_device_complains_for_itself_and_errors_come_before_warnings(bench: Connection, feeder: Feeder) -> None:
    feeder.read(1, Address(0x3000), bytes((0b010,)))
    feeder.read(1, Address(0x603F), struct.pack("<H", 0x4410))
    assert [(line.device, line.code, line.severity) for line in axis(bench).faults] == [(PMM, 0x4410, "warning")]
    feeder.read(11, Address(0x6041), struct.pack("<H", 0x0218))
    feeder.read(11, Address(0x603F), struct.pack("<H", 0x8611))
    assert [(line.device, line.code, line.severity) for line in axis(bench).faults] == [
        (PMC, 0x8611, "error"),
        (PMM, 0x4410, "warning"),
    ]
    assert axis(bench).fault_code == 0x8611
    feeder.read(1, Address(0x3000), bytes((0b110,)))
    assert [line.severity for line in axis(bench).faults] == ["error", "error"]


def test_current_and_following_error_are_told(bench: Connection, feeder: Feeder) -> None:
    assert (axis(bench).current_pct, axis(bench).following_error_deg) == (None, None)
    feeder.read(11, Address(0x6078), struct.pack("<h", -123))
    feeder.read(11, Address(0x60F4), struct.pack("<i", 150))
    assert (axis(bench).current_pct, axis(bench).following_error_deg) == (-12.3, 1.5)


def test_a_silent_node_is_in_no_known_state(bench: Connection, feeder: Feeder) -> None:
    feeder.read(11, Address(0x1017), struct.pack("<H", 100))
    feeder.heartbeat(11, NmtState.OPERATIONAL)
    lines = {line.device: line for line in views.node_lines(bench.targets, bench.live)}
    assert (lines[PMC].nmt, lines[PMC].silent, lines[PMC].heartbeat_period_ms) == ("operational", False, 100)
    assert (lines[PMM].nmt, lines[PMM].heartbeat_t_ns) == ("unknown", None)
    bench.live.tick(bench.stamper() + SECOND_NS)
    silent = next(line for line in views.node_lines(bench.targets, bench.live) if line.device == PMC)
    assert (silent.nmt, silent.silent) == ("unknown", True)


def test_reads_of_what_is_empty_are_no_events_but_refused_writes_are(bench: Connection, feeder: Feeder) -> None:
    history = Address(0x1003, 1)
    for request, code in (
        (sdo.upload_request(history), sdo.Abort.NO_DATA),
        (sdo.upload_request(history), sdo.Abort.NO_SUB_INDEX),
        (sdo.download_request(history, bytes(4)), sdo.Abort.NO_DATA),
    ):
        feeder.can(0x600 + 11, request)
        feeder.can(0x580 + 11, sdo.abort(history, code))
    told = [event.details for event in bench.live.events() if views.is_told(event)]
    assert [(details["access"], details["abort_code"]) for details in told] == [
        ("read", sdo.Abort.NO_SUB_INDEX),
        ("write", sdo.Abort.NO_DATA),
    ]


def test_late_answers_are_information(bench: Connection, feeder: Feeder) -> None:
    feeder.can(0x580 + 11, sdo.upload_response(STATUSWORD, bytes(2)))
    (event,) = bench.live.events()
    assert event.kind is EventKind.ORPHAN
    assert views.event_of_wire(event, {}).severity == "info"


def test_raw_values_survive_json(bench: Connection) -> None:
    entry = bench.target(PMM).entry(Address(0x3110, 1))
    text = bench.target(PMM).entry(Address(0x1008))
    assert views.raw_to_json(2**53 - 1) == 2**53 - 1
    assert views.raw_to_json(2**64 - 1) == "18446744073709551615"
    assert views.raw_to_json(b"\x0a\xff") == "0aff"
    assert views.raw_from_json(entry, "-5") == -5
    assert views.raw_from_json(text, "12") == "12"
    with pytest.raises(ValueTypeError):
        views.raw_from_json(entry, "0aff")


def test_an_object_that_nobody_described_shows_its_bytes(bench: Connection, feeder: Feeder) -> None:
    feeder.read(1, Address(0x2ABC, 3), encode_raw(DataType.UNSIGNED16, 0x1234))
    target = bench.target(PMM)
    cells = views.value_cells(target, bench.live.values(BUS, 1).values())
    assert cells["2ABC:03"].raw == "3412"
    assert views.value_cells(bench.target(PMC), bench.live.values(BUS, 1).values()) == {}


def test_events_name_the_device_by_its_slug(bench: Connection, feeder: Feeder) -> None:
    feeder.heartbeat(11, NmtState.BOOT_UP)
    feeder.heartbeat(77, NmtState.BOOT_UP)
    slugs = {(target.device.bus, target.node): target.slug for target in bench.targets}
    lines = [views.event_of_wire(event, slugs) for event in bench.live.events()]
    assert [(line.device, line.details.get("node")) for line in lines] == [(PMC, None), (None, 77)]


def test_what_a_person_did_bears_the_name_and_what_became_of_the_bus_bears_none() -> None:
    journal = Journal(lambda: 1, "Anna")
    journal.note(Kind.WRITTEN, "wtg-07/blade-1/pmm", address="3110:01")
    journal.by("Ben").note(Kind.STOP_SENT, None, count=3)
    journal.note(Kind.BUS_LOST, None, bus="can0")
    assert [views.event_of_journal(entry).person for entry in journal.latest()] == ["Anna", "Ben", None]


def test_the_3d_view_shows_what_is_known_and_how_well(bench: Connection, feeder: Feeder) -> None:
    assert (pose(axis(bench)).angle_deg, pose(axis(bench)).state) == (None, BladeState.UNKNOWN)
    feed_angle(feeder, 8123)
    assert (pose(axis(bench)).angle_deg, pose(axis(bench)).state) == (81.23, BladeState.IDLE)
    for status, state in ((0x0237, BladeState.ENABLED), (0x0217, BladeState.WARNING), (0x0218, BladeState.FAULT)):
        feeder.read(11, Address(0x6041), struct.pack("<H", status))
        assert pose(axis(bench)).state is state
    assert pose(axis(bench, 2 * SECOND_NS)).state is BladeState.STALE
