"""What is told of hydraulic cylinders, from values that were seen on the wire."""

from __future__ import annotations

import pytest

from app.model.address import parse_address
from app.model.description_file import load_builtin
from app.model.site import read_site
from app.scene import linkage
from app.scene.hub import BladeState
from app.service.cylinder_view import CylindersLine, cylinder_lines
from app.service.devices import Target
from app.service.polling import Rate, usual_list
from app.service.scene_feed import actuator_pose
from app.service.views import STALE_NS
from app.wire.live import LiveState
from app.wire.records import SlaveSeen, SlaveState, Source, ValueSeen

ED2 = load_builtin("wandfluh-ed2")
NOW_NS = 10_000_000_000
SITE = """
schema = 1
[turbine.b.bus.dp0]
connection = "profibus:/dev/null"
[turbine.b.station.s.device.hydraulics]
description = "wandfluh-ed2"
node = 6
"""
MORE = """
[turbine.b.station.s.device.second]
description = "wandfluh-ed2"
node = 7
"""
POSITION, SETPOINT, STATUS, ERROR, UNIT = "12/100", "12/21", "0/38", "0/36", "1/84"
MODE, SOURCE, TOGETHER, LIMITED, LOW, HIGH = "0/40", "0/39", "0/53", "1/106", "1/100", "1/101"
ACTIVE, HOLD, DISABLED, FAULT, WARNS = 0x0F, 0x0B, 0x09, 0x01, 0x2F
Seen = dict[str, int]
HERE: Seen = {UNIT: 1, POSITION: 250_000, STATUS: ACTIVE, ERROR: 0, TOGETHER: 0}


def line(seen: Seen, age_ns: int = 0, *, more: Seen | None = None, gone: bool = False) -> CylindersLine:
    """The station once these values were read of its first device, and ``more`` of its second."""
    (turbine,) = read_site(SITE + (MORE if more is not None else ""), "site.toml")
    live = LiveState()
    targets = {device.slug: Target(device, ED2, live) for device in turbine.devices}
    for device, values in zip(turbine.devices, (seen, more or {}), strict=False):
        live.set_description("dp0", device.node, ED2)
        for key, number in values.items():
            size = ED2.entry(parse_address(key)).type.size or 0
            data = number.to_bytes(size, "little", signed=number < 0)
            live.apply(ValueSeen(NOW_NS, "dp0", device.node, parse_address(key), data, Source.SDO_READ))
        if gone:
            live.apply(SlaveSeen(NOW_NS, "dp0", device.node, SlaveState.ABSENT))
    (found,) = cylinder_lines(turbine, targets, NOW_NS + age_ns)
    return found


def test_the_rod_is_where_it_was_seen_and_the_blade_where_the_linkage_has_it() -> None:
    first, second = line(HERE).cylinders
    assert (first.position, first.unit, first.extension, first.look) == (250.0, "mm", 0.5, "enabled")
    assert first.state == "dsp408_state.device_mode_active"
    assert line(HERE).angle_deg == pytest.approx(40.10)
    assert (second.position, second.extension, second.look) == (None, None, "unknown")
    assert line(HERE).deviation is None


@pytest.mark.parametrize(
    ("unit", "raw", "number", "name", "extension"),
    [
        (1, 500_000, 500.0, "mm", 1.0),
        (1, 505_000, 505.0, "mm", 1.0),  # a little beyond its end
        (1, 750_000, 750.0, "mm", 0.75),  # of 1000 mm: longer than the usual one
        (1, -250_000, -250.0, "mm", 0.25),  # of -500 to 500 mm
        (2, 5_000, 5.0, "in", 0.25),
        (3, 40_102, 40.102, "°", 0.5),
        (3, 120_000, 120.0, "°", 1.0),
        (None, 125_000, 125.0, "", 0.25),  # nobody has told the unit: a telegram without parameters
    ],
)
def test_lengths_and_angles_become_shares_of_a_stroke(
    unit: int | None, raw: int, number: float, name: str, extension: float
) -> None:
    seen = {POSITION: raw} if unit is None else {POSITION: raw, UNIT: unit}
    first = line(seen).cylinders[0]
    assert (first.position, first.unit) == (number, name)
    assert first.extension == pytest.approx(extension, abs=2e-5)


def test_limits_count_while_they_are_on() -> None:
    limits = {LOW: 500, HIGH: 4500}
    first = line({**HERE, **limits, LIMITED: 1}).cylinders[0]
    assert (first.limits, first.limits_at) == ((50.0, 450.0), (0.1, 0.9))
    assert line({**HERE, **limits, LIMITED: 0}).cylinders[0].limits is None
    assert line({**HERE, **limits}).cylinders[0].limits is None


@pytest.mark.parametrize(
    ("seen", "shown"),
    [
        ({}, 300.0),  # mode and source not known
        ({MODE: 9, SOURCE: 1}, 300.0),
        ({MODE: -1, SOURCE: 1}, 300.0),
        ({MODE: -2, SOURCE: 1}, None),  # by hand
        ({MODE: 9, SOURCE: 2}, None),  # local
        ({STATUS: HOLD}, None),
        ({STATUS: FAULT}, None),
    ],
)
def test_a_setpoint_is_shown_while_the_axis_follows_it(seen: Seen, shown: float | None) -> None:
    first = line({**HERE, SETPOINT: 300_000, **seen}).cylinders[0]
    assert first.setpoint == shown
    assert first.setpoint_at == (None if shown is None else 0.6)


def test_looks_say_whose_fault_it_is() -> None:
    def looks(more: Seen) -> list[str]:
        return [one.look for one in line({**HERE, **more}).cylinders]

    assert looks({STATUS: DISABLED}) == ["idle", "unknown"]
    assert looks({STATUS: WARNS}) == ["warning", "unknown"]
    assert looks({STATUS: FAULT, ERROR: 0x5232}) == ["fault", "unknown"]
    assert looks({STATUS: FAULT, ERROR: 0x5236}) == ["warning", "fault"], "the first stands for the second's sake"
    assert looks({STATUS: FAULT, ERROR: 0x5100}) == ["fault", "fault"], "the supply concerns both"
    first, second = line({**HERE, STATUS: FAULT, ERROR: 0x5236}).cylinders
    assert (first.fault_code, first.fault_text_key) == (0, None)
    assert (second.fault_code, second.fault_text_key) == (0x5236, "error_code.ed2_transducer_wire_2")


def test_what_is_old_or_gone_is_not_shown_as_the_present() -> None:
    old = line({**HERE, SETPOINT: 300_000}, age_ns=STALE_NS + 1)
    assert (old.look, old.cylinders[0].look, old.cylinders[0].setpoint) == ("stale", "stale", None)
    assert old.cylinders[0].position == 250.0
    assert line(HERE, gone=True).cylinders[0].look == "stale"
    gone = line({**HERE, STATUS: FAULT, ERROR: 0x5236}, gone=True)
    assert gone.cylinders[1].look == "unknown"
    assert line({}).look == "unknown"
    assert line({}).angle_deg is None


def test_two_devices_of_a_station_tell_of_a_cylinder_each_and_how_far_they_are_apart() -> None:
    both = line(HERE, more={**HERE, POSITION: 249_250})
    assert [one.position for one in both.cylinders] == [250.0, 249.25]
    assert both.deviation == 0.75
    mean = (linkage.angle_deg(0.5) + linkage.angle_deg(0.4985)) / 2
    assert both.angle_deg == pytest.approx(mean, abs=0.005)
    assert line(HERE, STALE_NS + 1, more=HERE).deviation is None
    assert line({**HERE, UNIT: 2, POSITION: 250}, more=HERE).deviation is None, "of two units"


@pytest.mark.parametrize(("raw", "together"), [(0, True), (1, False), (None, None)])
def test_whether_both_move_as_one_is_told_by_the_device(raw: int | None, together: bool | None) -> None:
    seen = {key: number for key, number in HERE.items() if key != TOGETHER}
    found = line(seen if raw is None else {**seen, TOGETHER: raw})
    assert found.synchronous is together
    pose = actuator_pose(found)
    assert pose.coupled is (together is True)
    assert (pose.cylinders[0].extension, pose.cylinders[0].state) == (0.5, BladeState.ENABLED)


def test_all_that_a_picture_needs_is_polled() -> None:
    rates = usual_list(ED2)
    assert {address.short for address, rate in rates.items() if rate is Rate.FAST} == {POSITION, STATUS}
    slow = {address.short for address, rate in rates.items() if rate is Rate.SLOW}
    assert slow >= {SETPOINT, ERROR, UNIT, MODE, SOURCE, TOGETHER, LIMITED, LOW, HIGH}
