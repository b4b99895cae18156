"""One station of the line, from the first probe to its process data; lives on the thread of the bus.

Nothing is sent to it but probes until it has answered one; then it is parametrised, and exchanges data with a
controlword of 0. Whenever it was gone, all of that begins anew.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from enum import Enum
from typing import Final

from app.drivers.profibus import DpSlave, Exchange, Plan, Step, plan_of_gsd
from app.drivers.profibus_config import DELIVERED_TELEGRAM, ProfibusStation
from app.drivers.profibus_image import ENABLING, Change, Image
from app.drivers.profibus_pkw import Failure, PkwChannel
from app.drivers.profibus_port import ProfibusPort
from app.drivers.profibus_probe import Probed, clear, leave, probe
from app.errors import DeviceError, ForeignMasterError, HubsideError, IdentityError, UsageError
from app.wire.profibus import pkw
from app.wire.profibus.control import Station as StationKind
from app.wire.profibus.diagnosis import NO_MASTER, Diagnosis, Status
from app.wire.profibus.pzd import Order
from app.wire.profibus.telegrams import (
    CONTROL_WORD,
    TELEGRAM_TYPES,
    Signal,
    TelegramType,
    assumed_modules,
    telegram_of,
)

_LOG: Final = logging.getLogger(__name__)
PROBE_S: Final = 0.3
"""Between two probes of a station that is not there."""
REFUSED_S: Final = 1.0
"""Between two looks at a station that we cannot run."""
IDLE_S: Final = 0.01
"""Between two exchanges where nobody waits for one."""
RETRY_S: Final = 0.005
"""The master waits before it asks again: look at it so often."""
GONE_AFTER: Final = 2
"""Exchanges without an answer, each of them repeated, after which a station is gone."""
START_S: Final = 3.0
"""A slave that was parametrised for so long and does not exchange is looked at from the beginning."""

_FAULTS: Final = Status.CONFIGURATION_FAULT | Status.PARAMETER_FAULT


class StationState(Enum):
    """Where a station is."""

    ABSENT = "absent"
    STARTING = "starting"
    EXCHANGING = "exchanging"


class Station:
    """The station of ``config``. ``on_state`` is told every change of ``state`` or ``problem``.

    ``fits`` raises UsageError where its telegram and those of the others take too long.
    """

    def __init__(
        self, config: ProfibusStation, bus: str,
        on_state: Callable[[Station], None], fits: Callable[[Station, TelegramType], None],
    ) -> None:  # fmt: skip
        self.config = config
        self.bus = bus
        self.state = StationState.ABSENT
        self.problem: HubsideError | None = None
        """Why it answers and is not run; None while there is no reason."""
        self.channel = PkwChannel()
        self.image = Image(TELEGRAM_TYPES[config.telegram or DELIVERED_TELEGRAM])
        self.probed: Probed | None = None
        self.starts = 0
        """How often it has begun to exchange data."""
        self.inputs = b""
        """Its process data of the latest exchange that was surely no repetition; empty while there is none."""
        self.inputs_s: float | None = None
        """When that was, on the line's clock."""
        self.looked_s: float | None = None
        """When it was probed last."""
        self._on_state = on_state
        self._fits = fits
        self._slave: DpSlave | None = None
        self._started_s = 0.0
        self._unanswered = 0
        self._next_s = 0.0

    @property
    def node(self) -> int:
        """Its address."""
        return self.config.node

    @property
    def telegram(self) -> TelegramType:
        """What it exchanges, or will."""
        return self.image.telegram

    @property
    def diagnosis(self) -> Diagnosis | None:
        """Its latest."""
        latest = None if self._slave is None else self._slave.diagnosis
        return latest or (None if self.probed is None else self.probed.diagnosis)

    def fill(self, order: Order, values: Mapping[Signal, int], starts: int) -> None:
        """The order of process data is proven, and ``values`` are what they have to begin with.

        Nothing where the station has begun anew since: what was found then says nothing of now.
        """
        if starts == self.starts and self.state is StationState.EXCHANGING:
            self.image.order = order
            self.image.values = {**values, **self.image.values}

    def let_go(self) -> None:
        """Where the axis may be enabled, send a controlword of 0 before anything else."""
        if self.image.controlword & ENABLING:
            _LOG.warning("station %d: its controlword is taken back, nobody minds it any more", self.node)
            self.image.put(Change({CONTROL_WORD: 0}, lambda _failure, _sent: None, urgent=True))

    # -- turns ------------------------------------------------------------------------------------

    def turn(self, port: ProfibusPort) -> float:
        """Do what is due; gives in how many seconds to come again. Raises LineError, ForeignMasterError."""
        now_s = port.line.now_s()
        self.channel.expire(now_s)
        if now_s >= self._next_s:
            wait_s = self._begin(port) if self._slave is None else self._exchange(self._slave, port)
            self._next_s = port.line.now_s() + wait_s
        elif self.state is StationState.EXCHANGING and (self.channel.waiting or self.image.busy):
            self._next_s = now_s  # somebody has come who waits for it
        return max(0.0, self._next_s - port.line.now_s())

    def lost(self) -> None:
        """The line is gone, and with it whatever was under way."""
        self._drop()
        self.channel.end_all(Failure.GONE)
        self._next_s = 0.0

    def leave(self, port: ProfibusPort) -> None:
        """Bring the axis to rest, then give the slave back. Raises LineError."""
        slave = self._slave
        if slave is None:
            return
        if slave.exchanging:
            self.image.forget(Failure.GONE)
            for _ in range(GONE_AFTER):
                if slave.turn(self._outputs(port)).fresh:
                    break
            clear(port)
        leave(port, self.node, slave.plan.ident)
        self._drop()

    # -- from absent to exchanging -------------------------------------------------------------------

    def _begin(self, port: ProfibusPort) -> float:
        self.probed, self.looked_s = probe(port, self.node), port.line.now_s()
        if self.probed is None:
            self._become(StationState.ABSENT, None)
            return PROBE_S
        try:
            plan = self._plan(self.probed, port.master)
        except ForeignMasterError:
            raise
        except HubsideError as problem:
            self._become(StationState.ABSENT, problem)
            return REFUSED_S
        self._slave = DpSlave(port, self.node, plan)
        self._started_s = port.line.now_s()
        self._unanswered = 0
        self._become(StationState.STARTING, None)
        return 0.0

    def _plan(self, probed: Probed, master: int) -> Plan:
        """How it is to be parametrised. Raises UsageError, IdentityError, ForeignMasterError."""
        if probed.kind is not StationKind.SLAVE:
            raise ForeignMasterError(bus=self.bus, reason_key="profibus.foreign.station", master=self.node)
        diagnosis = probed.diagnosis
        if diagnosis is None:
            raise UsageError(reason=f"station {self.node} tells no diagnosis: it is no slave of PROFIBUS-DP")
        if diagnosis.master not in (NO_MASTER, master):
            raise ForeignMasterError(bus=self.bus, reason_key="profibus.foreign.owner", master=diagnosis.master)
        plan = self._wanted(probed)
        if plan.ident != diagnosis.ident:
            raise IdentityError(node=self.node, expected=f"{plan.ident:04X}h", found=f"{diagnosis.ident:04X}h")
        telegram = telegram_of(plan.output_size, plan.input_size)
        if telegram is None or telegram.number != (self.config.telegram or telegram.number):
            lengths = f"{plan.output_size} and {plan.input_size} bytes"
            wanted = "any telegram" if self.config.telegram is None else f"telegram {self.config.telegram}"
            raise UsageError(reason=f"station {self.node} is configured for {lengths}, which are not those of {wanted}")
        self._fits(self, telegram)
        self.image.forget(Failure.GONE)
        self.image = Image(telegram)
        return plan

    def _wanted(self, probed: Probed) -> Plan:
        """By the device's own file, else as the slave says, else as usual makers would have it."""
        assert probed.diagnosis is not None  # the caller has looked
        if self.config.gsd is not None:
            return plan_of_gsd(self.config.gsd, self.config.modules)
        if probed.modules is not None and self.config.telegram is None:
            return Plan(probed.diagnosis.ident, probed.modules)
        return Plan(probed.diagnosis.ident, assumed_modules(self.telegram))

    # -- data ------------------------------------------------------------------------------------------

    def _outputs(self, port: ProfibusPort) -> bytes:
        head = self.channel.outputs(port.line.now_s()) if self.telegram.has_pkw else b""
        return head + self.image.outputs()

    def _exchange(self, slave: DpSlave, port: ProfibusPort) -> float:
        outputs = self._outputs(port) if slave.exchanging else b""
        came = slave.turn(outputs)
        now_s = port.line.now_s()
        if came.step in (Step.EXCHANGED, Step.STARTING):
            self._unanswered = 0
        if came.step is Step.EXCHANGED:
            self._take(outputs, came, now_s)
            return 0.0 if self._wanted_soon else IDLE_S
        if came.step is Step.UNANSWERED:
            self._unanswered += 1
        gone = came.step is Step.NOT_ACTIVE or self._unanswered >= GONE_AFTER
        if not slave.exchanging:  # it never was, or the library has given it up
            gone = gone or self.state is StationState.EXCHANGING or now_s - self._started_s > START_S
        if gone:
            refusal = self._refusal(slave)
            self._drop()
            self._become(StationState.ABSENT, refusal)
            return 0.0 if refusal is None else REFUSED_S
        return RETRY_S if came.step is Step.WAITING else 0.0

    def _refusal(self, slave: DpSlave) -> DeviceError | None:
        """Why it was parametrised and never exchanged anything, as it tells itself."""
        status = Status(0) if slave.diagnosis is None else slave.diagnosis.status
        if self.state is not StationState.STARTING or not status & _FAULTS:
            return None
        what = "configuration" if status & Status.CONFIGURATION_FAULT else "parameters"
        return DeviceError(node=self.node, reason_key=f"profibus.refused.{what}")

    @property
    def _wanted_soon(self) -> bool:
        return self.image.busy or (self.telegram.has_pkw and self.channel.busy)

    def _take(self, outputs: bytes, came: Exchange, now_s: float) -> None:
        if self.state is not StationState.EXCHANGING:
            self.starts += 1
            self._become(StationState.EXCHANGING, None)
        if not came.fresh:
            return
        head = pkw.SIZE if self.telegram.has_pkw else 0
        self.inputs, self.inputs_s = came.inputs[head:], now_s
        if head:
            self.channel.take(outputs[:head], came.inputs[:head])
        self.image.delivered()

    def _drop(self) -> None:
        self._slave, self.inputs, self.inputs_s = None, b"", None
        self.channel.gone()
        self.image.forget(Failure.GONE)
        self._become(StationState.ABSENT, None)

    def _become(self, state: StationState, problem: HubsideError | None) -> None:
        same = state is self.state and repr(problem) == repr(self.problem)  # each look makes a new one
        self.state, self.problem = state, problem
        if not same:
            self._on_state(self)
