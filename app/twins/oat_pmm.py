"""Twin of the OAT PMM, the supply and battery unit: its objects and what it decides (manual, chapter 4)."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntFlag
from typing import Final

from app.model.address import Address
from app.model.datatypes import Raw
from app.twins.canopen_device import MS, SECOND, Application, CanopenDevice, Power
from app.twins.manual_function import KEY, ManualFunction
from app.twins.object_store import RefusedAccessError
from app.twins.plant_power import PowerPlant
from app.twins.pmm_battery import BatteryTest, Charger
from app.twins.pmm_errors import PmmErrors
from app.twins.pmm_io import AlarmInputs, PmmInputs, PmmOutputs
from app.twins.pmm_temperature import PLACES, SENSOR_OPEN, SENSOR_SHORT, SensorState, TemperatureWatch
from app.twins.unit_link import AxisFlag, AxisReport, SupplyFlag, SupplyReport, UnitLink
from app.wire.nmt import NmtState
from app.wire.sdo import Abort

_SLOW_NS: Final = 100 * MS
"""Cycle of charger, temperatures and outputs."""
_KEEP_NS: Final = 60 * SECOND
"""How often remanent counters go to the file."""
_BOOSTER_START_NS: Final = 10 * SECOND
"""Table 17, bit 2."""
_MAINS_LOW_SHARE: Final = 0.8
_MAINS_HIGH_SHARE: Final = 1.15
"""Of the nominal mains; the thresholds of 3120h and 3110h are not printed."""
_CHOPPER_FULL_W: Final = 300.0
"""100 % of 30B1h (4.5.2.1)."""
_CHOPPER_MEAN_S: Final = 10.0
"""Time over which its utilisation is averaged (estimate)."""
_SUPPLY_MOST_MA: Final = 8000
_SUPPLY_LOW_MV: Final = 18000
_SUPPLY_HIGH_MV: Final = 28000
"""Table 15, bits 4 to 6."""
_ONLY_TYPE: Final = 0xA1
"""Battery type that the PMM supports (4.3.1.1)."""
_LEAST_TEST_MIN: Final = 60
_BATTERY_CODES: Final = frozenset(range(0x3280, 0x3290))
_REMANENT: Final = (0x3050, 0x3051, 0x3052)
LINK_BROKEN: Final = 0x3221
"""Table 6 gives it to the PMM only."""


class PmmControl(IntFlag):
    """Bits of the PMM controlword 3040h (table 17); each acts by its edge."""

    CHARGE = 1 << 0
    TEST = 1 << 1
    BOOST = 1 << 2
    RESET = 1 << 7


class OatPmm(Application):
    """The PMM on a device. ``tick`` moves it on. ``axis_moves`` tells whether the motor runs.

    ``feeds``: the devices that its supply feeds, itself among them; it switches them off when the time to power down
    is over, and on again with the mains.
    """

    def __init__(self, device: CanopenDevice, power: PowerPlant, axis_moves: Callable[[], bool]) -> None:
        device.application = self
        self.device = device
        self.power = power
        self.inputs = PmmInputs(lambda: device.line.now_ns)
        self.feeds: tuple[CanopenDevice, ...] = (device,)
        self.link: UnitLink[AxisReport] | None = None
        self._axis_moves = axis_moves
        self._store = device.store
        self.errors = PmmErrors(device.emergency)
        self.charger = Charger(self._store, power)
        self.test = BatteryTest(self._store, power)
        self._watches = tuple(TemperatureWatch(self._store, self.errors, place) for place in PLACES)
        self.outputs = PmmOutputs(self._store, self.errors)
        self.alarms = AlarmInputs(self._store, self.errors)
        self.manual = ManualFunction(self._store, self._operated, self.errors.reset)
        self._booted = self._slept = False
        self._controlword = 0
        self._boost_until_ns = 0
        self._failed_since_ns: int | None = None
        self._last_ns = self._slow_ns = self._keep_ns = 0
        self._chopper_mean_w = 0.0
        self._bind_values()
        self._bind_blocs()
        self._bind_commands()
        device.memory.keep_remanent(self._store.cell(index) for index in _REMANENT)

    # -- application of the mount -----------------------------------------------------

    def restarted(self, t_ns: int) -> None:
        """Power-on or restart; the battery stays as it is."""
        self._booted = self._slept = False
        self._controlword = 0
        self.manual.clear()
        if self.link is not None:
            self.link.stop()
        self._boost_until_ns = t_ns
        self._failed_since_ns = None
        self._chopper_mean_w = 0.0
        self.errors.clear()
        self.charger.clear()
        self.test.clear()
        self.power.commands.booster_target_v = None
        self.power.commands.chopper_on = False
        for watch in self._watches:
            watch.clear()
        self._last_ns = self._slow_ns = self._keep_ns = t_ns

    def booted(self, t_ns: int) -> None:
        """It works by itself from now on."""
        self._booted = True
        self.inputs.restart(t_ns)
        self._slow(t_ns)
        if self.link is not None:
            self.link.start(t_ns)

    def powered_off(self) -> None:
        """Nothing is controlled; outputs and safety relay have fallen off."""
        self._booted = False
        self.power.commands.booster_target_v = None
        self.power.commands.chopper_on = False
        self.power.commands.charge_a = 0.0
        if self.link is not None:
            self.link.stop()

    def communication_error(self, code: int) -> None:
        """8130h and its like."""
        self.errors.event(code)

    # -- safety chain, link to the PMC, supply of both units --------------------------------

    def join(self, peer: int) -> None:
        """Talk with the PMC on node ``peer``."""
        self.link = UnitLink(self.device, peer, self._report, AxisReport.from_bytes, self._link_changed)

    @property
    def axis(self) -> AxisReport | None:
        """What the PMC said last; None where it is not known."""
        return None if self.link is None else self.link.data

    @property
    def safety_relay(self) -> bool:
        """The contact in the safety chain (X13.11, X13.12; 30FEh/3 bit 16): open with an error, and without a supply.

        It opens too where the mains stays away for longer than 30E0h: the emergency mode begins.
        """
        return self.running and not self.errors.pending and self._hold_up_ms > 0

    @property
    def lets_axis_run(self) -> bool:
        """Level that it gives to X2.3 of its PMC: 0 executes the EFC. A PMM that does not run gives 0."""
        return self.running and not self.inputs.feathers

    @property
    def running(self) -> bool:
        """It is supplied and has booted."""
        return self._booted and self.device.power is not Power.OFF

    @property
    def _hold_up_ms(self) -> int:
        """30B2h; a 30E0h of 0 bridges nothing, and harms nobody while the mains is there."""
        if self._failed_since_ns is None:
            return max(1, self._store.number(0x30E0))
        return self._remaining_ms(self._store.number(0x30E0))

    def _report(self) -> SupplyReport:
        flags = SupplyFlag.FAULT if self.errors.pending else SupplyFlag.NONE
        if self._failed_since_ns is not None:
            flags |= SupplyFlag.MAINS_FAILED
        return SupplyReport(self.manual.word, flags)

    def _link_changed(self, broken: bool) -> None:
        self.errors.error(LINK_BROKEN, broken)

    def _shut_down(self) -> None:
        """30B3h is over: both units fall silent, what is left in the battery stays there."""
        self._slept = True
        for device in self.feeds:
            device.power_off()

    def _wake(self, t_ns: int) -> None:
        """The mains is back after a shut-down."""
        if self.power.mains_now_v >= self.power.constants.mains_v * _MAINS_LOW_SHARE:
            self._slept = False
            for device in self.feeds:
                device.power_on(t_ns)

    # -- time -----------------------------------------------------------------------------

    def tick(self, t_ns: int) -> None:
        """Watch voltages, decide on booster and chopper; every 100 ms on all else."""
        dt_s = (t_ns - self._last_ns) / SECOND
        self._last_ns = t_ns
        if self._slept:
            self._wake(t_ns)
        if not self._booted:
            return
        self._watch_mains(t_ns)
        if self._failed_since_ns is not None and self._remaining_ms(self._store.number(0x30E1) * 1000) == 0:
            self._shut_down()
            return
        self._control_booster(t_ns)
        self._control_chopper(dt_s)
        self._watch_voltages()
        if t_ns - self._slow_ns >= _SLOW_NS:
            self._slow(t_ns)
        if t_ns - self._keep_ns >= _KEEP_NS:
            self._keep_ns = t_ns
            self.device.memory.keep()
        self.device.poll(t_ns)

    def _slow(self, t_ns: int) -> None:
        dt_s = (t_ns - self._slow_ns) / SECOND
        self._slow_ns = t_ns
        moves = self._axis_moves()
        self.charger.step(dt_s)
        self.test.step(dt_s, moves)
        for place, watch in enumerate(self._watches):
            watch.step(self._temperature(place), self._sensor(place), dt_s)
        self.alarms.watch(self.inputs.settled)

    # -- mains, DC link, booster, chopper ----------------------------------------------------

    def _watch_mains(self, t_ns: int) -> None:
        """Both times run from the failure on; the mains brings them back to their full values.

        OPEN whether a poor mains is an error; it is a warning, since the unit goes on with its battery.
        """
        mains_v = self.power.mains_now_v
        nominal_v = self.power.constants.mains_v
        failed = mains_v < nominal_v * _MAINS_LOW_SHARE
        if not failed:
            self._failed_since_ns = None
        elif self._failed_since_ns is None:
            self._failed_since_ns = t_ns
        self.errors.warning(0x3120, failed)
        self.errors.warning(0x3110, mains_v > nominal_v * _MAINS_HIGH_SHARE)

    def _control_booster(self, t_ns: int) -> None:
        """By itself when the DC link sinks in a power failure, by command for 10 s, and for the test."""
        power, commands = self.power, self.power.commands
        commands.booster_limit_a = self._store.number(0x30FB, 3)
        failed = self._failed_since_ns is not None
        sunk = failed and power.dc_link_v < self._store.number(0x30FB, 8)
        stays = failed and commands.booster_target_v is not None
        if sunk or stays or t_ns < self._boost_until_ns or self.test.loads:
            commands.booster_target_v = float(self._store.number(0x30FB, 7))
        else:
            commands.booster_target_v = None

    def _control_chopper(self, dt_s: float) -> None:
        power = self.power
        voltage = power.dc_link_v
        if voltage >= self._store.number(0x30FC, 1):
            power.commands.chopper_on = True
        elif voltage < self._store.number(0x30FC, 2) and not self.test.loads:
            power.commands.chopper_on = False
        if self.test.loads:
            power.commands.chopper_on = True
        self._chopper_mean_w += (power.chopper_w - self._chopper_mean_w) * min(1.0, dt_s / _CHOPPER_MEAN_S)

    def _watch_voltages(self) -> None:
        power, errors = self.power, self.errors
        errors.error(0x3220, power.dc_link_v < self._store.number(0x30FA, 3))
        errors.error(0x3211, power.dc_link_v > self._store.number(0x30FA, 2))
        errors.error(0x2210, power.supply_a * 1000 > _SUPPLY_MOST_MA)
        errors.error(0x5112, power.supply_v * 1000 < _SUPPLY_LOW_MV)
        errors.error(0x5100, power.supply_v * 1000 > _SUPPLY_HIGH_MV)

    def _remaining_ms(self, most_ms: int) -> int:
        if self._failed_since_ns is None:
            return most_ms
        return max(0, most_ms - (self._last_ns - self._failed_since_ns) // MS)

    # -- temperatures, inputs, outputs ----------------------------------------------------------

    def _battery_tenths(self) -> int:
        """3010h: the coldest bloc where that is below 10 degrees, else the warmest."""
        temperatures = [bloc.temperature_c for bloc in self.power.blocs]
        chosen = min(temperatures) if min(temperatures) < 10.0 else max(temperatures)
        return round(chosen * 10)

    def _temperature(self, place: int) -> int:
        if place == 0:
            return self._battery_tenths()
        if place == 1:
            return round(self.power.heat_sink_c * 10)
        return self._sensor_tenths(place - 2)

    def _sensor(self, place: int) -> SensorState:
        return SensorState.FITTED if place < 2 else self.inputs.sensors[place - 2]

    def _sensor_tenths(self, number: int) -> int:
        state = self.inputs.sensors[number]
        if state is SensorState.SHORT_CIRCUIT:
            return SENSOR_SHORT
        if state is SensorState.INTERRUPTED:
            return SENSOR_OPEN
        return round(self.power.sensor_c(number) * 10)

    def _outputs(self) -> int:
        """30FEh/3: what is programmed, what the functions set, and from bit 16 on the unit's own."""
        functions = 0
        for watch in self._watches:
            functions |= watch.outputs
        axis = self.axis
        known = axis is not None and AxisFlag.POSITION_VALID in axis.flags
        own = self.outputs.own(self.safety_relay, self.running, self.device.state is NmtState.OPERATIONAL)
        return self.outputs.word(functions, axis.position_cdeg if axis is not None and known else None, own)

    def _operated(self) -> int:
        """Selector switch and key button as bits of table 8."""
        return (self.inputs.selector & 0x0F) | (KEY if self.inputs.key else 0)

    # -- status objects ---------------------------------------------------------------------------

    def _pmm_status(self) -> int:
        """3000h (table 11)."""
        errors, mains = self.errors, self.errors.warnings
        failed = self._failed_since_ns is not None
        return (
            (not errors.pending and not errors.warnings)
            | bool(errors.warnings) << 1
            | bool(errors.pending) << 2
            | bool(_BATTERY_CODES.intersection(errors.pending)) << 3
            | (failed and self._remaining_ms(self._store.number(0x30E1) * 1000) > 0) << 4
            | failed << 5
            | (0x3110 in mains) << 6
            | (0x3130 in mains) << 7
        )

    def _booster_status(self) -> int:
        """3002h (table 13)."""
        active = self.power.commands.booster_target_v is not None
        over_voltage = 0x3211 in self.errors.pending
        regulated = active and not self.power.booster_limited
        limited = active and self.power.booster_limited
        return (not over_voltage) | active << 1 | limited << 2 | regulated << 3 | over_voltage << 5

    def _chopper_status(self) -> int:
        """3003h (table 14)."""
        return 1 | self.power.commands.chopper_on << 1

    def _supply_status(self) -> int:
        """3004h (table 15); no external 24 V is fitted."""
        pending = self.errors.pending
        bits = [(2, self._supply_ma() > self._store.number(0x30C0))]
        bits += [(bit, code in pending) for bit, code in ((4, 0x2210), (5, 0x5112), (6, 0x5100))]
        status = sum(1 << bit for bit, on in bits if on)
        return status | (not status & 0x70)

    def _supply_ma(self) -> int:
        return round(self.power.supply_a * 1000)

    # -- objects -----------------------------------------------------------------------------------

    def _bind_values(self) -> None:
        power, charger, store = self.power, self.charger, self._store
        capacity = store.cell(0x3020, 2)
        nominal = store.cell(0x3020, 8)
        pulse = store.cell(0x30E2)
        sources: dict[int, Callable[[], Raw]] = {
            0x3000: self._pmm_status,
            0x3001: lambda: charger.status,
            0x3002: self._booster_status,
            0x3003: self._chopper_status,
            0x3004: self._supply_status,
            0x3005: lambda: self.test.status,
            0x3006: lambda: self._watches[0].status,
            0x3007: lambda: self._watches[1].status,
            0x3008: lambda: self._watches[2].status,
            0x3009: lambda: self._watches[3].status,
            0x3010: self._battery_tenths,
            0x3011: lambda: round(power.heat_sink_c * 10),
            0x3012: lambda: self._sensor_tenths(0),
            0x3013: lambda: self._sensor_tenths(1),
            0x3053: lambda: round(power.charge * capacity.number),
            0x3060: lambda: round(power.battery_v),
            0x3062: lambda: round(power.mains_now_v),
            0x3063: lambda: round(power.dc_link_v),
            0x3064: lambda: round(charger.output_v),
            0x3065: lambda: round(power.supply_v * 1000),
            0x3066: lambda: 0,
            0x3067: lambda: round(charger.off_load_v),
            0x3070: lambda: charger.battery_ma,
            0x3073: lambda: round(power.booster_a),
            0x3074: lambda: round(charger.output_ma),
            0x3075: self._supply_ma,
            0x3080: lambda: round(power.charge * 100),
            # Of a new cell's resistance to the measured one.
            0x3081: lambda: min(100, round(100 * nominal.number / max(power.battery_ohm * 1000, 1))),
            0x30A0: lambda: self.inputs.analog_read_mv,
            0x30B0: lambda: round(min(100.0, power.booster_a / max(power.commands.booster_limit_a, 1.0) * 100)),
            0x30B1: lambda: round(min(100.0, self._chopper_mean_w / _CHOPPER_FULL_W * 100)),
            0x30B2: lambda: self._remaining_ms(store.number(0x30E0)),
            0x30B3: lambda: -(-self._remaining_ms(store.number(0x30E1) * 1000) // 1000),
            0x30B4: lambda: round(power.battery_ohm * 1000),
            0x30FD: lambda: self.inputs.word(pulse.number),
            0x603F: lambda: self.errors.code,
        }
        for index, source in sources.items():
            store.at(Address(index)).source = source
        store.cell(0x30FE, 3).source = self._outputs

    def _bind_blocs(self) -> None:
        """301Fh and 3061h. OPEN what absent blocs show; 0 mV, and the temperature of a sensor that is not there."""
        power = self.power

        def temperature(place: int) -> Callable[[], Raw]:
            return lambda: round(power.blocs[place].temperature_c * 10) if self._has(place) else SENSOR_OPEN

        def voltage(place: int) -> Callable[[], Raw]:
            return lambda: round(power.bloc_v(place) * 1000) if self._has(place) else 0

        for place in range(8):
            self._store.cell(0x301F, place + 1).source = temperature(place)
            self._store.cell(0x3061, place + 1).source = voltage(place)

    def _has(self, place: int) -> bool:
        return place < len(self.power.blocs) and place < self._store.number(0x3020, 4)

    def _bind_commands(self) -> None:
        self._store.cell(0x3040).effect = self._on_controlword
        self._store.cell(0x30E3).guard = _check_test_cycle
        self._store.cell(0x3020, 1).guard = _check_battery_type

    def _on_controlword(self, raw: Raw) -> None:
        word = raw if isinstance(raw, int) else 0
        rising, falling = word & ~self._controlword, self._controlword & ~word
        self._controlword = word
        now_ns = self.device.line.now_ns
        if rising & PmmControl.RESET:
            self.errors.reset()
        if rising & PmmControl.CHARGE:
            self.charger.start()
        if rising & PmmControl.TEST:
            self.test.arm()
        elif falling & PmmControl.TEST:
            self.test.release(self._axis_moves())
        if rising & PmmControl.BOOST:
            self._boost_until_ns = now_ns + _BOOSTER_START_NS
        elif falling & PmmControl.BOOST:
            self._boost_until_ns = now_ns
        self._control_booster(now_ns)


def _check_test_cycle(raw: Raw) -> None:
    """30E3h: 0, or 60 minutes and more. OPEN refused or raised; refused, so that nobody is mistaken about it."""
    if isinstance(raw, int) and 0 < raw < _LEAST_TEST_MIN:
        raise RefusedAccessError(Abort.VALUE_TOO_LOW)


def _check_battery_type(raw: Raw) -> None:
    """3020h/1: lithium only. OPEN what others do; refused, for they would be charged by the wrong curve."""
    if raw != _ONLY_TYPE:
        raise RefusedAccessError(Abort.VALUE_RANGE)
