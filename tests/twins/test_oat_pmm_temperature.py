"""Supervisors and controllers of temperatures, over the wire, and what they switch (rules H)."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from app.twins.pmm_temperature import SensorState
from tests.twins.harness import MS, SECOND
from tests.twins.oat_rig import PMM, BladeRig

LOW, FAN, HEATER, COOLER, WARNING, ERROR, SHORT, OPEN = (1 << bit for bit in range(8))
"""Bits of 3006h to 3009h."""
PLACES = (
    ("3110", "3006", "3010", 0x4410, 0x4420, 500, 550, 0),
    ("3111", "3007", "3011", 0x4210, 0x4220, 750, 800, -200),
    ("3112", "3008", "3012", 0x4110, 0x4120, 450, 500, -200),
    ("3113", "3009", "3013", 0x4111, 0x4121, 450, 500, -200),
)
"""Supervisor, status, value, codes above and below, and the delivered limits."""
CONTROLLERS = (("3201", "3006", 0), ("3202", "3008", 2), ("3203", "3009", 3))

Get = Callable[[str], int]


@pytest.fixture
def rig() -> BladeRig:
    return BladeRig()


@pytest.fixture
def get(rig: BladeRig) -> Get:
    return lambda where: rig.get(where, PMM)


def heat(rig: BladeRig, place: int, tenths_c: float) -> None:
    """Bring a measuring place to a temperature, and let the unit look."""
    power = rig.blade.power
    if place == 0:
        power.thermal.box_c = tenths_c / 10 - 2.0  # blocs are a little warmer than their air
        for bloc in power.blocs:
            bloc.temperature_c = tenths_c / 10
    elif place == 1:
        power.heat_sink_c = tenths_c / 10
    else:
        power.thermal.places_c[place - 2] = tenths_c / 10
    rig.master.run(120 * MS)


@pytest.mark.rule("H1")
@pytest.mark.parametrize("place", range(4))
def test_delivered_limits(get: Get, place: int) -> None:
    supervisor, *_, warning, error, low = PLACES[place]
    assert [get(f"{supervisor}:0{sub}") for sub in (1, 2, 3)] == [warning, error, low]


@pytest.mark.rule("H1")
@pytest.mark.rule("H2")
@pytest.mark.rule("B3")
@pytest.mark.parametrize("place", range(4))
def test_supervisors_act_at_their_limits(rig: BladeRig, get: Get, place: int) -> None:
    """Reached is from the limit on, undercut is below it; only the error sends a message."""
    _, status, value, high, below, warning, error, low = PLACES[place]
    supervised = LOW | WARNING | ERROR
    for controller, *_ in CONTROLLERS:
        for sub in (4, 5, 6):
            rig.put(f"{controller}:0{sub}", 0, PMM)  # no moving air: the temperature stays where it is put

    def look(tenths_c: float) -> tuple[int, int, int]:
        heat(rig, place, tenths_c)
        return get(value), get(status) & supervised, get("603F")

    assert look(warning - 4)[1:] == (0, 0)
    assert look(warning - 0.2) == (warning, WARNING, high)
    assert look(error - 4)[1:] == (WARNING, high)
    assert rig.errors(PMM) == []
    assert look(error - 0.2) == (error, WARNING | ERROR, high)
    assert rig.errors(PMM) == [high]
    assert look(warning - 10)[1:] == (0, high)
    rig.put("3040", 0x80, PMM)
    assert look(low + 0.2) == (low, 0, 0)
    assert look(low - 4)[1:] == (LOW, below)
    assert get("3000") == 2
    assert rig.errors(PMM) == [high]


@pytest.mark.rule("H3")
def test_the_heat_sink_has_no_fan_heater_or_cooler(rig: BladeRig, get: Get) -> None:
    for controller in ("3201", "3202", "3203"):
        for sub in (4, 5, 6):
            rig.put(f"{controller}:0{sub}", 0x0300, PMM)
    for tenths_c in (-300, 300, 900):
        heat(rig, 1, tenths_c)
        assert get("3007") & (FAN | HEATER | COOLER) == 0


@pytest.mark.rule("H3")
@pytest.mark.rule("H4")
@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize(
    ("state", "shown", "bit"), [(SensorState.SHORT_CIRCUIT, -32768, SHORT), (SensorState.INTERRUPTED, 32767, OPEN)]
)
def test_a_sensor_that_does_not_measure(
    rig: BladeRig, get: Get, number: int, state: SensorState, shown: int, bit: int
) -> None:
    """It shows in value and status, raises nothing, and switches nothing on."""
    rig.put(f"320{number + 2}:07", 0, PMM)
    heat(rig, number + 2, 480)
    assert get("603F") != 0
    rig.pmm.inputs.sensors[number] = state
    rig.master.run(250 * MS)
    assert (get(f"301{number + 2}"), get(f"300{number + 8}")) == (shown, bit)
    assert (get("603F"), get("3000")) == (0, 1)
    rig.pmm.inputs.sensors[number] = SensorState.FITTED
    heat(rig, number + 2, 250)
    assert (get(f"301{number + 2}"), get(f"300{number + 8}")) == (250, 0)


@pytest.mark.rule("H5")
@pytest.mark.rule("H6")
@pytest.mark.parametrize(("controller", "status", "place"), CONTROLLERS)
def test_controllers_switch_with_hysteresis(rig: BladeRig, get: Get, controller: str, status: str, place: int) -> None:
    """Delivered: heater below 0.0 until 5.0 degrees, cooler above 45.0 until 40.0; the fan with both, and 120 s on."""
    assert [get(f"{controller}:0{sub}") for sub in (1, 2, 3, 7)] == [0, 450, 50, 120]
    rig.put(f"{controller}:07", 0, PMM)

    def look(tenths_c: float) -> int:
        heat(rig, place, tenths_c)
        return get(status) & (FAN | HEATER | COOLER)

    assert look(1) == 0
    assert look(-4) == HEATER | FAN
    assert look(47) == HEATER | FAN
    assert look(53) == 0
    assert look(447) == 0
    assert look(454) == COOLER | FAN
    assert look(403) == COOLER | FAN
    assert look(396) == 0


@pytest.mark.rule("H5")
@pytest.mark.rule("H6")
def test_the_fan_runs_on_for_its_delay(rig: BladeRig, get: Get) -> None:
    heat(rig, 3, -10)
    assert get("3009") == HEATER | FAN
    heat(rig, 3, 200)
    began_ns = rig.line.now_ns
    assert get("3009") == FAN
    rig.master.until(lambda: get("3009") == 0, 200 * SECOND, 100 * MS)
    assert (rig.line.now_ns - began_ns) / SECOND == pytest.approx(120, abs=0.5)
    rig.put("3203:07", 3, PMM)
    heat(rig, 3, -10)
    heat(rig, 3, 200)
    rig.master.run(2 * SECOND)
    assert get("3009") == FAN
    rig.master.run(2 * SECOND)
    assert get("3009") == 0


@pytest.mark.rule("H7")
def test_delivered_masks(rig: BladeRig, get: Get) -> None:
    masks = {controller: [get(f"{controller}:0{sub}") for sub in (4, 5, 6)] for controller, *_ in CONTROLLERS}
    assert masks == {"3201": [0x40, 0, 0x10], "3202": [0, 0, 0], "3203": [0x80, 0, 0x20]}
    for place, outputs in ((0, 0x0050), (2, 0x0000), (3, 0x00A0)):
        heat(rig, place, -10)
        assert get("30FE:03") & 0x03FF == outputs
        heat(rig, place, 200)
        rig.restart(PMM)
        assert get("30FE:03") & 0x03FF == 0


@pytest.mark.rule("H7")
@pytest.mark.rule("H5")
def test_other_masks_lead_to_other_outputs(rig: BladeRig, get: Get) -> None:
    for sub, mask in ((4, 0x0101), (5, 0x0202), (6, 0x0004)):
        rig.put(f"3202:0{sub}", mask, PMM)
    heat(rig, 2, -10)
    assert get("30FE:03") & 0x03FF == 0x0105
    heat(rig, 2, 449)
    heat(rig, 2, 460)
    assert get("30FE:03") & 0x03FF == 0x0206


def air_c(rig: BladeRig, place: int) -> float:
    """What heaters and coolers act on: the air in the battery box, or the place of a sensor."""
    thermal = rig.blade.power.thermal
    return thermal.box_c if place == 0 else thermal.places_c[place - 2]


@pytest.mark.rule("H5")
@pytest.mark.parametrize(("controller", "status", "place"), [CONTROLLERS[0], CONTROLLERS[2]])
def test_a_heater_heats_by_its_output(rig: BladeRig, get: Get, controller: str, status: str, place: int) -> None:
    """It warms the place until the temperature has risen by the hysteresis. Without an output nothing gets warm."""
    rig.blade.power.ambient_c = 2.0
    heat(rig, place, 43)
    rig.put(f"{controller}:03", 3, PMM)
    rig.put(f"{controller}:01", 45, PMM)
    rig.master.run(250 * MS)
    assert get(status) & HEATER
    rig.master.until(lambda: not get(status) & HEATER, 3000 * SECOND, SECOND)
    assert get(PLACES[place][2]) >= 47
    rig.put(f"{controller}:04", 0, PMM)
    rig.put(f"{controller}:01", 300, PMM)
    rig.master.run(250 * MS)
    began_c = air_c(rig, place)
    rig.master.run(10 * SECOND)
    assert get(status) & HEATER
    assert air_c(rig, place) < began_c


@pytest.mark.rule("H5")
@pytest.mark.parametrize(("controller", "status", "place"), CONTROLLERS)
def test_a_cooler_cools_by_its_output(rig: BladeRig, get: Get, controller: str, status: str, place: int) -> None:
    rig.put(f"{controller}:05", 0x0100, PMM)
    rig.put(f"{controller}:06", 0x0200, PMM)
    rig.put(f"{controller}:03", 3, PMM)
    rig.blade.power.ambient_c = 44.5
    heat(rig, place, 452)
    rig.master.run(250 * MS)
    assert get(status) & COOLER
    rig.master.until(lambda: not get(status) & COOLER, 3000 * SECOND, 2 * SECOND)
    assert get(PLACES[place][2]) <= 448


@pytest.mark.rule("H8")
def test_delivered_motor_fan(get: Get) -> None:
    assert [get(f"3204:0{sub}") for sub in (1, 2, 3)] == [800, 50, 0]


@pytest.mark.rule("H8")
def test_the_motor_fan_follows_the_temperature_that_the_pmc_tells(rig: BladeRig, get: Get) -> None:
    power = rig.blade.power

    def look(tenths_c: int) -> int:
        power.motor_c = tenths_c / 10
        rig.master.run(500 * MS)
        assert rig.get("6410:09") == pytest.approx(tenths_c, abs=3)
        return get("30FE:03") & 0x03FF

    assert look(900) == 0
    rig.put("3204:03", 0x0102, PMM)
    assert look(700) == 0
    assert look(795) == 0
    assert look(806) == 0x0102
    assert power.thermal.motor_fan
    assert look(760) == 0x0102
    assert look(745) == 0
    assert look(795) == 0
    assert not power.thermal.motor_fan


@pytest.mark.rule("H8")
def test_the_motor_temperature_comes_over_the_bus(rig: BladeRig, get: Get) -> None:
    """A PMC that is stopped tells nothing any more: the fan stays as it was."""
    rig.put("3204:03", 0x0100, PMM)
    rig.blade.power.motor_c = 90.0
    rig.master.run(500 * MS)
    assert get("30FE:03") & 0x0100
    rig.pmc.device.power_off()
    rig.blade.power.motor_c = 40.0
    rig.master.run(500 * MS)
    assert get("30FE:03") & 0x0100
    assert rig.get("3204:03", PMM) == 0x0100
