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
from app.twins.pmm_battery import BatteryAlarms, Charger, Gauge, battery_sources, bind_blocs
from app.twins.pmm_battery_test import BatteryTest
from app.twins.pmm_errors import PmmErrors
from app.twins.pmm_io import AlarmInputs, PmmInputs, PmmOutputs
from app.twins.pmm_supply import PmmSupply
from app.twins.pmm_temperature import PmmTemperatures
from app.twins.unit_link import AxisFlag, AxisReport, SupplyFlag, SupplyReport, UnitLink
from app.wire.nmt import NmtState
from app.wire.sdo import Abort

_SLOW_NS: Final = 100 * MS
"""Cycle of charger, temperatures and outputs."""
_POLL_NS: Final = 20 * MS
"""How often changed values are looked for that a PDO tells by itself."""
_KEEP_NS: Final = 60 * SECOND
"""How often remanent counters go to the file."""
_ONLY_TYPE: Final = 0xA1
"""Battery type that the PMM supports (4.3.1.1)."""
_REMANENT: Final = (0x3050, 0x3051, 0x3052)
_EEPROM_FAILED: Final = 0x5530
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
        self.gauge = Gauge(self._store, power)
        self.charger = Charger(self._store, power, self.errors, self.gauge)
        self.test = BatteryTest(self._store, power, self.gauge)
        self._battery_alarms = BatteryAlarms(self._store, power, self.errors)
        self.temperatures = PmmTemperatures(self._store, power, self.errors, self.inputs.sensors, self._motor_tenths_c)
        self.outputs = PmmOutputs(self._store, self.errors)
        self.alarms = AlarmInputs(self._store, self.errors)
        self.manual = ManualFunction(self._store, self._operated, self.errors.reset)
        self._booted = self._slept = False
        self._controlword = 0
        self.supply = PmmSupply(self._store, power, self.errors, lambda: self.test.loads)
        self._slow_ns = self._keep_ns = self._polled_ns = 0
        self._bind_values()
        bind_blocs(self._store, power)
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
        self.supply.end(t_ns)
        self.errors.clear()
        self.charger.clear()
        self.test.clear()
        self._battery_alarms.clear()
        self.temperatures.clear()
        self._slow_ns = self._keep_ns = self._polled_ns = t_ns

    def booted(self, t_ns: int) -> None:
        """It works by itself from now on."""
        self._booted = True
        self.inputs.restart(t_ns)
        self.supply.begin(t_ns)
        self.gauge.clear()
        self._slow(t_ns)
        if self.link is not None:
            self.link.start(t_ns)

    def powered_off(self) -> None:
        """Nothing is controlled; outputs and safety relay have fallen off."""
        self._booted = False
        self.supply.end(self.device.line.now_ns)
        self.charger.clear()
        self.temperatures.drive(0)
        if self.link is not None:
            self.link.stop()

    def communication_error(self, code: int) -> None:
        """8130h and its like."""
        self.errors.event(code)

    def memory_failed(self, t_ns: int) -> None:
        """The EEPROM could not be written (table 6)."""
        self.errors.event(_EEPROM_FAILED)

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
        if not self.running or self.errors.pending:
            return False
        return not self.supply.failed or self.supply.hold_up_ms > 0

    @property
    def lets_axis_run(self) -> bool:
        """Level that it gives to X2.3 of its PMC: 0 executes the EFC. A PMM that does not run gives 0."""
        return self.running and not self.inputs.feathers

    @property
    def running(self) -> bool:
        """It is supplied and has booted."""
        return self._booted and self.device.power is not Power.OFF

    def _motor_tenths_c(self) -> int | None:
        """Motor temperature in 0.1 degrees, as the PMC says it."""
        return None if self.axis is None else self.axis.motor_tenths_c

    def _report(self) -> SupplyReport:
        flags = SupplyFlag.FAULT if self.errors.pending else SupplyFlag.NONE
        if self.supply.failed:
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
        if self.supply.mains_back:
            self._slept = False
            for device in self.feeds:
                device.power_on(t_ns)

    # -- time -----------------------------------------------------------------------------

    def tick(self, t_ns: int) -> None:
        """Watch voltages, decide on booster and chopper; every 100 ms on all else."""
        if self._slept:
            self._wake(t_ns)
        if not self._booted:
            return
        self.supply.tick(t_ns)
        if self.supply.failed and self.supply.power_down_ms == 0:
            self._shut_down()
            return
        if t_ns - self._slow_ns >= _SLOW_NS:
            self._slow(t_ns)
        if t_ns - self._keep_ns >= _KEEP_NS:
            self._keep_ns = t_ns
            self.device.memory.keep()
        if t_ns - self._polled_ns >= _POLL_NS:
            self._polled_ns = t_ns
            self.device.poll(t_ns)

    def _slow(self, t_ns: int) -> None:
        dt_s = (t_ns - self._slow_ns) / SECOND
        self._slow_ns = t_ns
        moves = self._axis_moves()
        self.gauge.step(dt_s)
        self.charger.step(dt_s)
        self.test.step(dt_s, moves)
        self._battery_alarms.step(dt_s)
        self.temperatures.step(dt_s)
        self.alarms.watch(self.inputs.settled)
        self.temperatures.drive(self._outputs())

    # -- inputs, outputs ------------------------------------------------------------------------

    def _outputs(self) -> int:
        """30FEh/3: what is programmed, what the functions set, and from bit 16 on the unit's own."""
        axis = self.axis
        known = axis is not None and AxisFlag.POSITION_VALID in axis.flags
        own = self.outputs.own(self.safety_relay, self.running, self.device.state is NmtState.OPERATIONAL)
        return self.outputs.word(
            self.temperatures.outputs, axis.position_cdeg if axis is not None and known else None, own
        )

    def _operated(self) -> int:
        """Selector switch and key button as bits of table 8."""
        return (self.inputs.selector & 0x0F) | (KEY if self.inputs.key else 0)

    # -- status objects ---------------------------------------------------------------------------

    def _pmm_status(self) -> int:
        """3000h (table 11)."""
        errors = self.errors
        return (
            (not errors.pending and not errors.warnings)
            | bool(errors.warnings) << 1
            | bool(errors.pending) << 2
            | self._battery_alarms.pending << 3
            | self.supply.mains_bits
        )

    # -- objects -----------------------------------------------------------------------------------

    def _bind_values(self) -> None:
        store = self._store
        pulse = store.cell(0x30E2)
        sources: dict[int, Callable[[], Raw]] = {
            0x3000: self._pmm_status,
            0x3005: lambda: self.test.status,
            0x30A0: lambda: self.inputs.analog_read_mv,
            0x30FD: lambda: self.inputs.word(pulse.number),
            0x603F: lambda: self.errors.code,
            **battery_sources(self.gauge, self.charger, self.power),
            **self.supply.sources(),
            **self.temperatures.sources(),
        }
        for index, source in sources.items():
            store.at(Address(index)).source = source
        store.cell(0x30FE, 3).source = self._outputs

    def _bind_commands(self) -> None:
        self._store.cell(0x3040).effect = self._on_controlword
        self._store.cell(0x3020, 1).guard = _check_battery_type

    def _on_controlword(self, raw: Raw) -> None:
        word = raw if isinstance(raw, int) else 0
        rising, falling = word & ~self._controlword, self._controlword & ~word
        self._controlword = word
        if rising & PmmControl.RESET:
            self.errors.reset()
        if rising & PmmControl.CHARGE:
            self.charger.start()
        if rising & PmmControl.TEST:
            self.test.arm()
        elif falling & PmmControl.TEST:
            self.test.release(self._axis_moves())
        if (rising | falling) & PmmControl.BOOST:
            self.supply.boost(bool(rising & PmmControl.BOOST))


def _check_battery_type(raw: Raw) -> None:
    """3020h/1: lithium only. OPEN what others do; refused, for they would be charged by the wrong curve."""
    if raw != _ONLY_TYPE:
        raise RefusedAccessError(Abort.VALUE_RANGE)
