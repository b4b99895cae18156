"""Parts of the twin on their own: hydraulics, sensors, the joystick's curve, magnets, forced inputs, states."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.twins.ed2.delivered import ANALOG, INCREMENTAL, SSI_BINARY, SSI_GRAY
from app.twins.ed2.digital import Forced
from app.twins.ed2.hydraulics import Bench, Cylinder, Drive
from app.twins.ed2.params import Output
from app.twins.ed2.states import FAULTY, Reaction, State, States
from app.twins.ed2.transducers import Reading, Scaling, Transducer, Trouble, from_gray
from app.twins.ed2.valve_output import drive_of, joystick_percent
from app.twins.object_store import RefusedAccessError

BENCH = Bench()
SSI = Scaling(2, -5_000, 5_000)
MA = Scaling(3, 0, 500_000_000)


def speed(drive: Drive, *, bar: float = 160.0, load_n: float = 0.0, start_mm: float = 250.0, ms: int = 300) -> float:
    cylinder = Cylinder(BENCH, start_mm)
    for _ in range(ms):
        cylinder.step(drive, bar, load_n)
    return cylinder.velocity_mm_s


# -- hydraulics ----------------------------------------------------------------------------


def test_speed_follows_areas_supply_and_load_by_their_roots() -> None:
    full = Drive(a_ma=700.0, dither_ma=100.0)
    back = Drive(b_ma=700.0, dither_ma=100.0)
    free = speed(full)
    assert free == pytest.approx(BENCH.speed_mm_s, rel=0.01)
    assert -speed(back) == pytest.approx(free * (BENCH.rod_side_mm2 / BENCH.piston_mm2) ** 0.5, rel=0.01)
    assert speed(full, bar=40.0) == pytest.approx(free / 2, rel=0.01)
    stall_n = 160.0 * BENCH.piston_mm2 * 0.1
    assert speed(full, load_n=0.75 * stall_n) == pytest.approx(free / 2, rel=0.01)
    assert speed(full, load_n=1.1 * stall_n) == 0.0
    assert speed(back, load_n=10_000.0) < speed(back)


def test_below_the_dead_band_nothing_moves_and_at_the_end_it_stops() -> None:
    assert speed(Drive(a_ma=150.0, dither_ma=100.0)) == 0.0
    assert 0.0 < speed(Drive(a_ma=170.0, dither_ma=100.0)) < 10.0
    cylinder = Cylinder(BENCH, 490.0)
    for _ in range(1_000):
        cylinder.step(Drive(a_ma=700.0, dither_ma=100.0), 160.0, 0.0)
    assert (cylinder.position_mm, cylinder.velocity_mm_s) == (BENCH.stroke_mm, 0.0)
    assert cylinder.limits == (False, True)


def test_without_dither_the_spool_sticks() -> None:
    assert speed(Drive(a_ma=185.0)) == 0.0
    assert speed(Drive(a_ma=185.0, dither_ma=100.0)) > 5.0
    assert speed(Drive(a_ma=185.0, dither_ma=100.0, dither_hz=250.0)) < speed(Drive(a_ma=185.0, dither_ma=100.0))


def test_without_current_it_comes_to_rest_and_sleeps() -> None:
    cylinder = Cylinder(BENCH, 250.0)
    for drive in (Drive(a_ma=700.0, dither_ma=100.0), Drive()):
        for _ in range(400):
            cylinder.step(drive, 160.0, 5_000.0)
    assert cylinder.asleep


# -- sensors -------------------------------------------------------------------------------


@given(st.integers(0, (1 << 25) - 1))
def test_gray_code_and_back(number: int) -> None:
    assert from_gray(number ^ number >> 1) == number


@pytest.mark.parametrize(("kind", "scaling"), [(SSI_BINARY, SSI), (SSI_GRAY, SSI), (ANALOG, MA)])
def test_a_sound_sensor_tells_the_place(kind: int, scaling: Scaling) -> None:
    for place in (0.0, 0.005, 123.455, 500.0):
        reading = Transducer(kind).read(place, scaling)
        assert reading.trouble is None
        assert reading.position_mm == pytest.approx(place, abs=0.003)


def test_an_incremental_sensor_tells_the_way_since_power_on() -> None:
    sensor = Transducer(INCREMENTAL)
    sensor.power_on(200.0)
    scaling = Scaling(0, 0, 5_000)
    assert [sensor.read(place, scaling).position_mm for place in (200.0, 210.0, 195.0)] == [0.0, 10.0, -5.0]
    sensor.wire.broken = True
    assert sensor.read(199.0, scaling) == Reading(0.0), "no error: it just counts no more"


@pytest.mark.parametrize(("kind", "scaling"), [(SSI_BINARY, SSI), (SSI_GRAY, SSI), (ANALOG, MA)])
def test_a_broken_wire_is_told_and_the_last_place_kept(kind: int, scaling: Scaling) -> None:
    sensor = Transducer(kind)
    sensor.read(100.0, scaling)
    sensor.wire.broken = True
    reading = sensor.read(101.0, scaling)
    assert reading.trouble is Trouble.WIRE
    assert reading.position_mm == pytest.approx(100.0, abs=0.003)
    sensor.wire.broken = False
    assert sensor.read(102.0, scaling).trouble is None


def test_what_is_beyond_the_range_of_a_sensor() -> None:
    sensor = Transducer(SSI_GRAY)
    sensor.wire.slip_mm = -60.0
    assert sensor.read(0.0, SSI).trouble is Trouble.RANGE
    sensor = Transducer(ANALOG)
    sensor.wire.slip_mm = 60.0
    assert sensor.read(500.0, MA).trouble is Trouble.RANGE


def test_a_signal_that_does_not_fit_the_sensor_gives_wrong_places() -> None:
    assert Transducer(SSI_GRAY).read(250.0, SSI._replace(signal=1)).position_mm == pytest.approx(100.0, abs=0.01)
    assert Transducer(SSI_GRAY).read(250.0, SSI._replace(signal=0)).position_mm < 0.0
    assert Transducer(ANALOG).read(250.0, MA._replace(signal=2)).position_mm == pytest.approx(300.0)


# -- output --------------------------------------------------------------------------------


def output(**changed: object) -> Output:
    values: dict[str, object] = {
        "least_ma": (150.0, 160.0),
        "most_ma": (700.0, 800.0),
        "dither_ma": 100.0,
        "dither_hz": 100.0,
        "inverted": False,
        "interface": False,
        "offset": 0.0,
        "gain": 100.0,
    }
    return Output(**{**values, **changed})  # type: ignore[arg-type]


def test_per_cent_become_current_between_imin_and_imax() -> None:
    assert drive_of(0.0, output(), BENCH) == Drive(0.0, 0.0, 100.0, 100.0)
    assert drive_of(100.0, output(), BENCH).a_ma == 700.0
    assert drive_of(50.0, output(), BENCH).a_ma == 425.0
    assert drive_of(-100.0, output(), BENCH).b_ma == 800.0
    assert drive_of(0.1, output(), BENCH).a_ma == pytest.approx(150.5, abs=0.1)
    assert drive_of(-100.0, output(inverted=True), BENCH).a_ma == 700.0


def test_the_curve_of_the_joystick_rises_from_end_to_end() -> None:
    assert [joystick_percent(one) for one in (0.0, 50.0, 100.0)] == [-100.0, 0.0, 100.0]
    assert joystick_percent(65.0) == pytest.approx(20.0), "the knee"
    course = [joystick_percent(one) for one in range(101)]
    assert all(low < high for low, high in pairwise(course))


@given(st.integers(0, 0xFFFF))
def test_forcing_takes_what_exists_and_nothing_else(raw: int) -> None:
    forced = Forced(18)
    number, value = raw >> 8, raw & 0xFF
    if not (1 <= number <= 18 and value <= 2):
        with pytest.raises(RefusedAccessError):
            forced.check(raw)
        return
    forced.check(raw)
    forced.write(raw)
    for levels in (0, (1 << 18) - 1):
        wanted = levels >> (number - 1) & 1 if value == 2 else value
        assert forced.answer(number << 8, levels) == number << 8 | wanted


# -- states --------------------------------------------------------------------------------


@given(st.lists(st.tuples(st.integers(0, 0xF), st.booleans(), st.booleans(), st.booleans(), st.integers(0, 20))))
def test_whatever_comes_the_machine_keeps_its_rules(steps: list[tuple[int, bool, bool, bool, int]]) -> None:
    states = States()
    states.booted()
    for word, at_rest, may_run, gone, chance in steps:
        before = states.state
        if chance < 2:
            states.fail(list(Reaction)[chance])
            assert states.state in FAULTY
            before = states.state
        states.step(word, at_rest=at_rest, may_run=may_run, causes_gone=gone)
        now = states.state
        if now in (State.HOLD, State.DEVICE_MODE_ACTIVE) and before not in FAULTY:
            assert may_run
        if now is State.DEVICE_MODE_ACTIVE:
            assert word & 0x4
            assert before in (State.HOLD, State.DEVICE_MODE_ACTIVE)
        if before in FAULTY and now not in FAULTY:
            assert gone
            assert word & 0x8


def test_every_state_has_its_own_bits() -> None:
    assert len({one.value for one in State}) == len(State) == 8
