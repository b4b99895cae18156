"""Parameters of both axes that are more than values: modes, local operation, saving, inputs, and what is live."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

from app.model.address import Address
from app.model.datatypes import Raw
from app.model.description import Description
from app.twins.ed2.axis import Axis
from app.twins.ed2.channel import SAVE_NS, Channel
from app.twins.ed2.delivered import pkw
from app.twins.ed2.digital import Forced
from app.twins.ed2.kernel import Kernel
from app.twins.ed2.params import ControlMode, DeviceMode, raw_position
from app.twins.ed2.states import ADJUSTABLE, State, Status
from app.twins.object_store import Deferred, Guard, RefusedAccessError
from app.twins.state_file import Memory, StateFile
from app.wire.profibus.telegrams import (
    ACTUAL,
    CONTROL_MODE,
    DEVICE_MODE,
    DIGITAL_INPUTS,
    ERROR_CODE,
    STATUS_WORD,
    Signal,
)
from app.wire.sdo import Abort

DEVICE_MODE_AT: Final = (0, 39)
CONTROL_MODE_AT: Final = (0, 40)
LOCAL_AT: Final = (0, 41)
STORE_AT: Final = (0, 51)
AXES_AT: Final = (0, 53)
INPUTS_AT: Final = (12, 224)
OUTPUTS_AT: Final = (12, 225)
_LEAVABLE: Final = ADJUSTABLE | {State.FAULT, State.FAULT_HOLD}
"""Here local operation may begin and end: locally a fault cannot be reset over the bus, so it must be possible to leave
local operation with one (OPEN)."""


class Commands:
    """Both channels, and what their writes do."""

    def __init__(
        self, description: Description, kernel: Kernel, address: int, transducer: int, state: Path | None
    ) -> None:
        self._kernel = kernel
        self._signature = description.save[0].signature

        def file(name: str) -> Path | None:
            return None if state is None else state / f"ed2-{address}-{name}.json"

        forced = file("io")
        self._forced = None if forced is None else StateFile(forced, f"{description.id}/io")
        self._forced_saved: dict[Address, bytes] = {}
        self.problems: list[str] = []
        if self._forced is not None:
            loaded = self._forced.load()
            self._forced_saved = {} if loaded.memory is None else loaded.memory.saved
            self.problems += [] if loaded.problem is None else [loaded.problem]
        special = {pkw(*INPUTS_AT): self._read_input, pkw(*OUTPUTS_AT): self._read_output}
        first, second = (
            Channel(description, axis.number, transducer, file(f"axis-{axis.number}"), special, self._live(axis))
            for axis in kernel.axes
        )
        self.channels = (first, second)
        for channel, axis in zip(self.channels, kernel.axes, strict=True):
            self.problems += [] if channel.memory.problem is None else [channel.memory.problem]
            self._install(channel, axis)

    def recall(self) -> None:
        """Power-on: what was saved is in force."""
        for channel in self.channels:
            channel.recall()
        for forced, group in ((self._kernel.inputs, INPUTS_AT), (self._kernel.outputs, OUTPUTS_AT)):
            saved = self._forced_saved.items()
            forced.values = {at.minor: data[0] for at, data in saved if at.major == group[1]}
        leader, other = self.channels
        for at in (LOCAL_AT, AXES_AT):
            other.put(*at, leader.number(*at))  # power may have gone between the memories of both axes
        self._kernel.local = bool(leader.number(*LOCAL_AT))
        self._kernel.single = bool(leader.number(*AXES_AT))

    # -- live --------------------------------------------------------------------------------

    def _live(self, axis: Axis) -> Callable[[Signal], int]:
        tellers: dict[Signal, Callable[[], int]] = {
            STATUS_WORD: lambda: self._status(axis),
            ACTUAL: lambda: raw_position(axis.position),
            DEVICE_MODE: lambda: self._of(axis).number(*DEVICE_MODE_AT),
            CONTROL_MODE: lambda: self._of(axis).number(*CONTROL_MODE_AT),
            ERROR_CODE: lambda: self._error(axis),
            # OPEN which bit is which input; the lowest is taken for input 1, and 17 and 18 find no place.
            DIGITAL_INPUTS: lambda: self._kernel.levels & 0xFFFF,
        }
        return lambda signal: tellers[signal]()

    def _of(self, axis: Axis) -> Channel:
        return self.channels[axis.number - 1]

    def _error(self, axis: Axis) -> int:
        """The code of the axis; with synchronous axes that of the other one where only it has one."""
        if axis.errors.code or self._kernel.single:
            return axis.errors.code
        return next((other.errors.code for other in self._kernel.axes if other.errors.code), 0)

    def _status(self, axis: Axis) -> int:
        """Status word; bits 10, 11 and 13 as the control mode has them (4.8.3)."""
        mode = self._of(axis).number(*CONTROL_MODE_AT)
        bits = Status(axis.state.value)
        if self._kernel.local:
            bits |= Status.LOCAL
        if mode in (ControlMode.OPEN_LOOP, ControlMode.POSITION) and self._touches(axis):
            bits |= Status.LIMIT_TOUCHED
        if mode != ControlMode.OPEN_LOOP and axis.follows_badly:
            bits |= Status.CONTROL_ERROR
        if axis.reached:
            bits |= Status.TARGET_REACHED
        if mode == ControlMode.PROFILE and axis.motion.acknowledges:
            bits |= Status.ACKNOWLEDGE
        return int(bits)

    def _touches(self, axis: Axis) -> bool:
        """A limit switch is open, or the axis is outside of its limits of travel."""
        channel = self._of(axis)
        if any(axis.barred):
            return True
        low, high = channel.number(1, 100) * 0.1, channel.number(1, 101) * 0.1
        return bool(channel.number(1, 106)) and not low <= axis.position <= high

    # -- writes ------------------------------------------------------------------------------

    def _install(self, channel: Channel, axis: Axis) -> None:
        store = channel.store
        channel.show(0, 36, lambda: self._error(axis))
        channel.show(0, 38, lambda: self._status(axis))
        channel.show(12, 100, lambda: raw_position(axis.position))
        channel.show(12, 103, lambda: raw_position(axis.deviation))
        for at, effect in ((DEVICE_MODE_AT, self._device_mode), (CONTROL_MODE_AT, self._control_mode)):
            cell = store.cell(*at)
            cell.guard = self._only_in(ADJUSTABLE, axis)
            cell.effect = _with(effect, channel)
        for at, switch, states in (
            (LOCAL_AT, self._switch_local, _LEAVABLE),
            (AXES_AT, self._switch_axes, ADJUSTABLE),
        ):
            cell = store.cell(*at)
            cell.guard = self._only_in(states, None)
            cell.effect = _with(switch, channel)
        for at, forced in ((INPUTS_AT, self._kernel.inputs), (OUTPUTS_AT, self._kernel.outputs)):
            cell = store.cell(*at)
            cell.guard = _forcible(forced)
            cell.effect = _force(forced)
        save = store.cell(*STORE_AT)
        save.guard = self._check_save
        save.effect = self._save

    def _only_in(self, states: frozenset[State], axis: Axis | None) -> Guard:
        """Modes change in INIT and DISABLED only (4.2.2, 5.2); of both axes where they run as one, or for both."""

        def check(_raw: Raw) -> None:
            axes = self._kernel.axes if axis is None or not self._kernel.single else (axis,)
            if any(one.state not in states for one in axes):
                raise RefusedAccessError(Abort.DEVICE_STATE)

        return check

    def _device_mode(self, channel: Channel, raw: int) -> None:
        for one in self._together(channel):
            one.put(*DEVICE_MODE_AT, raw)

    def _control_mode(self, channel: Channel, raw: int) -> None:
        """The device mode goes with it (4.8.5)."""
        for one in self._together(channel):
            one.put(*CONTROL_MODE_AT, raw)
            if raw == ControlMode.OPEN_LOOP:
                one.put(*DEVICE_MODE_AT, DeviceMode.LOCAL)
            elif raw != ControlMode.POSITION:
                one.put(*DEVICE_MODE_AT, DeviceMode.BUS)

    def _together(self, channel: Channel) -> tuple[Channel, ...]:
        """Synchronous axes have one mode."""
        return (channel,) if self._kernel.single else self.channels

    def _switch_local(self, _: Channel, raw: int) -> None:
        """Local operation takes the setpoint with it (4.3). It is one switch of the device, whoever writes it."""
        for one in self.channels:
            one.put(*LOCAL_AT, raw)
            if raw:
                one.put(*DEVICE_MODE_AT, DeviceMode.LOCAL)
        self._kernel.local = bool(raw)

    def _switch_axes(self, channel: Channel, raw: int) -> None:
        """Single or synchronous: one switch of the device. As one, both axes have the modes of the one that is told."""
        for one in self.channels:
            one.put(*AXES_AT, raw)
            if not raw:
                for at in (DEVICE_MODE_AT, CONTROL_MODE_AT):
                    one.put(*at, channel.number(*at))
        self._kernel.single = bool(raw)

    # -- inputs and outputs ------------------------------------------------------------------

    def _read_input(self, raw: int) -> int:
        return self._kernel.inputs.answer(raw, self._kernel.levels)

    def _read_output(self, raw: int) -> int:
        return self._kernel.outputs.answer(raw, self._kernel.output_levels)

    # -- saving ------------------------------------------------------------------------------

    def _check_save(self, raw: Raw) -> None:
        if raw not in (0, self._signature):
            raise RefusedAccessError(Abort.VALUE_RANGE)

    def _save(self, raw: Raw) -> Deferred | None:
        """All parameters of both axes. OPEN when it is answered: here, once it is done."""
        if raw != self._signature:
            return None
        memory = self.channels[0].memory
        return Deferred(SAVE_NS if memory.slow_ns is None else memory.slow_ns, lambda _now_ns: self._store())

    def _store(self) -> None:
        for channel in self.channels:
            channel.memory.save(lambda _entry: True)
        self._forced_saved = {
            pkw(at[1], number): bytes((value,))
            for at, forced in ((INPUTS_AT, self._kernel.inputs), (OUTPUTS_AT, self._kernel.outputs))
            for number, value in forced.values.items()
        }
        if self._forced is not None:
            try:
                self._forced.store(Memory(dict(self._forced_saved)))
            except OSError as error:
                raise RefusedAccessError(Abort.HARDWARE) from error


def _with(effect: Callable[[Channel, int], None], channel: Channel) -> Callable[[Raw], None]:
    def act(raw: Raw) -> None:
        if isinstance(raw, int):
            effect(channel, raw)

    return act


def _forcible(forced: Forced) -> Guard:
    def check(raw: Raw) -> None:
        if isinstance(raw, int):
            forced.check(raw)

    return check


def _force(forced: Forced) -> Callable[[Raw], None]:
    def act(raw: Raw) -> None:
        if isinstance(raw, int):
            forced.write(raw)

    return act
