"""The angles of motor and shaft by the units that a device has, from values that were seen on the wire."""

from __future__ import annotations

import pytest

from app.model.address import Address
from app.model.description_file import load_builtin
from app.model.site import read_site
from app.service.devices import Target
from app.service.shaft_view import ShaftLine, shaft_lines
from app.service.views import STALE_NS
from app.wire.live import LiveState
from app.wire.records import Source, ValueSeen

PD4E, PMC = load_builtin("nanotec-pd4e"), load_builtin("oat-pmc")
NOW_NS = 10_000_000_000
TENTH_DEGREE, REVOLUTION, INCREMENT, STEP, MILLIMETRE = 0xFF410000, 0x00B40000, 0x00B50000, 0x00AC0000, 0xFD010000
SITE = """
schema = 1
[turbine.b.bus.lan]
connection = "modbus-tcp"
ranges = ["10.0.0.1"]
[turbine.b.station.s.device.servo]
description = "nanotec-pd4e"
node = 1
address = "10.0.0.1"
"""
UNIT, POSITION, VELOCITY, STATUS, ERROR = 0x60A8, 0x6064, 0x606C, 0x6041, 0x603F
SUBMODE = 0x3202


Seen = dict[tuple[int, int] | int, int]
"""Raw values by index and sub-index."""


def line(seen: Seen, age_ns: int = 0) -> ShaftLine:
    """The axis of the bench once these values were read."""
    (turbine,) = read_site(SITE, "site.toml")
    live = LiveState()
    live.set_description("lan", 1, PD4E)
    (device,) = turbine.devices
    target = Target(device, PD4E, live)
    for key, number in seen.items():
        address = Address(key) if isinstance(key, int) else Address(*key)
        size = target.entry(address).type.size or 0
        data = number.to_bytes(size, "little", signed=number < 0)
        live.apply(ValueSeen(NOW_NS, "lan", 1, address, data, Source.SDO_READ))
    (found,) = shaft_lines(turbine, {target.slug: target}, NOW_NS + age_ns)
    return found


GEAR: Seen = {(0x6091, 1): 10, (0x6091, 2): 1}


CASES: list[tuple[Seen, float | None, float | None]] = [
    ({UNIT: TENTH_DEGREE, POSITION: 455, **GEAR}, 45.5, 455.0),
    ({UNIT: TENTH_DEGREE, POSITION: -900, (0x6091, 1): 5, (0x6091, 2): 2}, -90.0, -225.0),
    ({UNIT: REVOLUTION, POSITION: 2, **GEAR}, 720.0, 7200.0),
    ({UNIT: MILLIMETRE, POSITION: 50, (0x6092, 1): 200, (0x6092, 2): 1, **GEAR}, 90.0, 900.0),
    ({UNIT: INCREMENT, POSITION: 1000, SUBMODE: 1, (0x608F, 1): 2000, (0x608F, 2): 1, **GEAR}, 18.0, 180.0),
    ({UNIT: INCREMENT, POSITION: 320_000, SUBMODE: 0, (0x608F, 1): 2000, (0x608F, 2): 1, **GEAR}, 36.0, 360.0),
    ({UNIT: TENTH_DEGREE, POSITION: 455}, 45.5, None),
    ({UNIT: STEP, POSITION: 3, **GEAR}, None, None),
    ({POSITION: 455, **GEAR}, None, None),
    ({UNIT: TENTH_DEGREE, **GEAR}, None, None),
]


@pytest.mark.parametrize(("seen", "shaft_deg", "motor_deg"), CASES)
def test_angles_follow_unit_gear_and_feed_and_are_not_guessed(
    seen: Seen, shaft_deg: float | None, motor_deg: float | None
) -> None:
    found = line(seen)
    assert found.shaft_deg == (None if shaft_deg is None else pytest.approx(shaft_deg))
    assert found.motor_deg == (None if motor_deg is None else pytest.approx(motor_deg))


def test_its_look_and_direction_are_those_of_blades() -> None:
    here: Seen = {UNIT: TENTH_DEGREE, POSITION: 1, **GEAR}
    assert line(here).look == "idle"
    assert line({}).look == "unknown"
    enabled = line({**here, STATUS: 0x0237, VELOCITY: -5})
    assert (enabled.look, enabled.turns) == ("enabled", -1)
    assert line({**here, STATUS: 0x0218, VELOCITY: 0}).look == "fault"
    assert line({**here, STATUS: 0x02B7, ERROR: 0x8612}).look == "warning"
    old = line({**here, STATUS: 0x0237, VELOCITY: 5}, age_ns=STALE_NS + 1)
    assert (old.look, old.turns) == ("stale", 0)
    assert old.shaft_deg == pytest.approx(0.1)


def test_blades_have_no_shaft() -> None:
    text = SITE.replace(
        "[turbine.b.station.s.device.servo]", "[turbine.b.station.s]\nblade = 1\n[turbine.b.station.s.device.servo]"
    )
    (turbine,) = read_site(text, "site.toml")
    (device,) = turbine.devices
    assert shaft_lines(turbine, {device.slug: Target(device, PD4E, LiveState())}, NOW_NS) == ()
