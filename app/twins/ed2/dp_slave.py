"""A slave of DP-V0: it waits for parameters, then for its configuration, and then exchanges data (IEC 61158 type 3).

The manual of the ED2 names the states and no more (3.5). What is not told there is as the standard has it for simple
slaves. One master owns it from Set_Prm on; to others it gives its diagnosis and its configuration, and nothing else.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Final, NamedTuple, Protocol

from app.wire.profibus import dp
from app.wire.profibus.configuration import Module, decode_configuration
from app.wire.profibus.control import Ask, Reply, Request, Station
from app.wire.profibus.diagnosis import NO_MASTER, Diagnosis, Status
from app.wire.profibus.dp import MASTER_SAP, Command, GlobalControl, Sap, ServiceAnswer, SetPrm
from app.wire.profibus.fdl import BROADCAST, Telegram
from app.wire.profibus.fields import FormatError

_MS: Final = 1_000_000
QUIET_NS: Final = 5_000 * _MS
"""Without a telegram for so long the slave looks for the baud rate once more (assumed)."""
LEAST_TSDR: Final = 11
"""Bit times between a request and its answer, at least."""


class DpState(Enum):
    """State of the slave, by the names of the manual (3.5)."""

    WAIT_PRM = "Wait_Prm"
    WAIT_CFG = "Wait_Cfg"
    DATA_EXCHANGE = "Data_Exchange"


class WatchdogState(Enum):
    """What is watched, by the names of the manual (3.5)."""

    BAUD_SEARCH = "Baud_Search"
    BAUD_CONTROL = "Baud_Control"
    DP_CONTROL = "DP_Control"


class Application(Protocol):
    """What the slave belongs to."""

    def configure(self, modules: tuple[Module, ...]) -> tuple[int, int] | None:
        """Take a configuration; gives the lengths of outputs and inputs, bytes. None refuses it."""

    def receive(self, outputs: bytes) -> None:
        """Outputs of the master, as they come into force."""

    def clear(self) -> None:
        """No outputs are in force any more: the master has cleared them, gone away or fallen silent."""

    def transmit(self) -> bytes:
        """The inputs of this moment."""


class _Counted(NamedTuple):
    """The latest request that counts, and what was answered."""

    master: int
    fcb: bool
    answer: bytes


class DpSlave:
    """The slave at ``address``. Times are handed in, ns, and never go back.

    ``modules`` is what it is configured for as delivered: Get_Cfg tells it until a master has told another.
    """

    def __init__(self, address: int, ident: int, application: Application, modules: tuple[Module, ...]) -> None:
        self.address = address
        self.ident = ident
        self.powered = True
        self._application = application
        self._modules = self._delivered = modules
        self._restart()

    def _restart(self) -> None:
        self.state = DpState.WAIT_PRM
        self.master = NO_MASTER
        self.min_tsdr = LEAST_TSDR
        """Bit times, as the latest Set_Prm has it."""
        self._faults = Status(0)
        self._watchdog_ns: int | None = None
        self._heard_ns: int | None = None
        """When the latest telegram of the owner came."""
        self._any_ns: int | None = None
        self._counted: _Counted | None = None
        self._sizes = (0, 0)
        self._modules = self._delivered
        self._groups = 0
        self._may_sync = self._may_freeze = False
        self._outputs: bytes | None = None
        """What came last; with sync it is not in force yet."""
        self._sync = self._cleared = False
        self._frozen: bytes | None = None

    # -- power and time ----------------------------------------------------------------------

    def power_off(self) -> None:
        """The slave is gone from the line."""
        self.powered = False
        self._application.clear()

    def power_on(self) -> None:
        """It knows nothing of what was before."""
        self.powered = True
        self._restart()

    def run_until(self, t_ns: int) -> None:
        """Let the watchdog look."""
        due_ns = self.due_ns()
        if due_ns is not None and t_ns >= due_ns:
            self._leave()
        if self._any_ns is not None and t_ns - self._any_ns >= QUIET_NS:
            self._any_ns = None

    def due_ns(self) -> int | None:
        """When the watchdog will bite, None where it does not run."""
        if self.state is DpState.WAIT_PRM or self._watchdog_ns is None or self._heard_ns is None:
            return None
        return self._heard_ns + self._watchdog_ns

    @property
    def watchdog(self) -> WatchdogState:
        """What PASO would show as its state."""
        if self.state is not DpState.WAIT_PRM and self._watchdog_ns is not None:
            return WatchdogState.DP_CONTROL
        return WatchdogState.BAUD_SEARCH if self._any_ns is None else WatchdogState.BAUD_CONTROL

    # -- telegrams ---------------------------------------------------------------------------

    def hear(self, t_ns: int, telegram: Telegram) -> bytes | None:
        """What the slave answers to a telegram that ended at ``t_ns``; None where it says nothing."""
        if not self.powered:
            return None
        self.run_until(t_ns)
        self._any_ns = t_ns
        control = telegram.control
        if not isinstance(control, Request) or telegram.destination not in (self.address, BROADCAST):
            return None
        if telegram.source == self.master:
            self._heard_ns = t_ns
        if not control.ask.answered:
            self._told(telegram)
            return None
        if telegram.destination == BROADCAST:
            return None
        if control.ask in (Ask.FDL_STATUS, Ask.IDENT, Ask.LSAS_STATUS):
            return self._identity(telegram, control.ask)
        return self._counting(t_ns, telegram, control)

    def _counting(self, t_ns: int, telegram: Telegram, control: Request) -> bytes:
        """Answer a request, or give the former answer once more where the frame count bit says that it is the same."""
        counted = self._counted
        if control.fcv and counted is not None and counted[:2] == (telegram.source, control.fcb):
            return counted.answer
        answer = dp.encode_answer(self._serve(t_ns, telegram), telegram).encode()
        counts = control.fcv or control.fcb
        self._counted = _Counted(telegram.source, control.fcb, answer) if counts else None
        return answer

    def _identity(self, telegram: Telegram, ask: Ask) -> bytes:
        answer: ServiceAnswer = dp.StatusAnswer(Station.SLAVE)
        if ask is not Ask.FDL_STATUS:
            answer = dp.Refused(Reply.NO_SERVICE)
        return dp.encode_answer(answer, telegram).encode()

    def _serve(self, t_ns: int, telegram: Telegram) -> ServiceAnswer:
        if telegram.dsap is None and telegram.ssap is None:
            return self._exchange(telegram)
        if telegram.ssap != MASTER_SAP:
            return dp.Refused(Reply.NO_SERVICE)
        serve: dict[int, Callable[[], ServiceAnswer]] = {
            Sap.DIAGNOSIS: lambda: dp.DiagnosisAnswer(self.diagnosis()),
            Sap.GET_CONFIGURATION: lambda: dp.ConfigurationAnswer(self._modules),
            Sap.SET_PARAMETERS: lambda: self._set_prm(t_ns, telegram),
            Sap.CHECK_CONFIGURATION: lambda: self._chk_cfg(telegram),
            Sap.READ_INPUTS: lambda: self._read_back(self._application.transmit),
            Sap.READ_OUTPUTS: lambda: self._read_back(lambda: self._outputs or b""),
        }
        found = serve.get(telegram.dsap) if telegram.dsap is not None else None
        return dp.Refused(Reply.NO_SERVICE) if found is None else found()

    def diagnosis(self) -> Diagnosis:
        """What Slave_Diag gives. No extended diagnosis: the manual knows of none."""
        status = Status.ALWAYS | self._faults
        if self.state is DpState.WAIT_PRM:
            status |= Status.PARAMETERS_REQUIRED
        if self.state is not DpState.DATA_EXCHANGE:
            status |= Status.NOT_READY
        if self._watchdog_ns is not None:
            status |= Status.WATCHDOG
        if self._frozen is not None:
            status |= Status.FREEZE
        if self._sync:
            status |= Status.SYNC
        return Diagnosis(status, self.master, self.ident)

    def _read_back(self, read: Callable[[], bytes]) -> ServiceAnswer:
        if self.state is not DpState.DATA_EXCHANGE:
            return dp.Refused(Reply.NO_SERVICE)
        return dp.OtherAnswer(Reply.DATA_LOW, read())

    # -- parameters and configuration --------------------------------------------------------

    def _set_prm(self, t_ns: int, telegram: Telegram) -> ServiceAnswer:
        """Set_Prm is taken with SC whatever it says; the diagnosis tells what became of it."""
        if self.master not in (NO_MASTER, telegram.source):
            return dp.Done()
        try:
            service = dp.decode_request(telegram)
        except FormatError:
            service = None
        if not isinstance(service, SetPrm) or service.ident != self.ident or service.user_data:
            self._leave(Status.PARAMETER_FAULT)
        elif service.unlock:
            self._leave()
        elif service.lock:
            self._own(t_ns, telegram.source, service)
        elif service.min_tsdr:
            self.min_tsdr = max(service.min_tsdr, LEAST_TSDR)
        return dp.Done()

    def _own(self, t_ns: int, master: int, service: SetPrm) -> None:
        self._leave()
        self.master, self.state = master, DpState.WAIT_CFG
        self._heard_ns = t_ns
        self._watchdog_ns = None if service.watchdog_ms is None else service.watchdog_ms * _MS
        self.min_tsdr = max(service.min_tsdr or self.min_tsdr, LEAST_TSDR)
        self._groups, self._may_sync, self._may_freeze = service.groups, service.sync, service.freeze

    def _chk_cfg(self, telegram: Telegram) -> ServiceAnswer:
        if self.state is DpState.WAIT_PRM or telegram.source != self.master:
            return dp.Refused(Reply.NO_SERVICE)
        try:
            modules = decode_configuration(telegram.data)
        except FormatError:
            modules = ()
        sizes = self._application.configure(modules) if modules else None
        if sizes is None:
            self._leave(Status.CONFIGURATION_FAULT)
        else:
            self._application.clear()
            self._sizes, self._modules = sizes, modules
            self.state = DpState.DATA_EXCHANGE
        return dp.Done()

    def _leave(self, fault: Status = Status(0)) -> None:  # noqa: B008 - a flag, it cannot change
        """Back to where the slave waits for parameters, owned by nobody."""
        self.state, self.master = DpState.WAIT_PRM, NO_MASTER
        self._faults = fault
        self._watchdog_ns = self._heard_ns = None
        self._sync = self._cleared = False
        self._frozen = self._outputs = None
        self._sizes = (0, 0)
        self._application.clear()

    # -- data --------------------------------------------------------------------------------

    def _exchange(self, telegram: Telegram) -> ServiceAnswer:
        if self.state is not DpState.DATA_EXCHANGE or telegram.source != self.master:
            return dp.Refused(Reply.NO_SERVICE)
        if len(telegram.data) != self._sizes[0]:
            self._leave(Status.CONFIGURATION_FAULT)
            return dp.Refused(Reply.NO_SERVICE)
        self._outputs = telegram.data
        if not self._sync and not self._cleared:
            self._application.receive(telegram.data)
        return dp.Inputs(self._application.transmit() if self._frozen is None else self._frozen)

    def _told(self, telegram: Telegram) -> None:
        """Global_Control of the owner, to all or to one of the slave's groups."""
        try:
            service = dp.decode_request(telegram)
        except FormatError:
            return
        if not isinstance(service, GlobalControl) or self.state is not DpState.DATA_EXCHANGE:
            return
        if telegram.source != self.master or (service.groups and not service.groups & self._groups):
            return
        self._cleared = bool(service.command & Command.CLEAR)
        if self._cleared:
            self._application.clear()
        self._synchronise(service.command)

    def _synchronise(self, command: Command) -> None:
        """Sync and freeze: to take what is held is part of the command; undoing wins where both are asked for."""
        if self._may_sync and command & (Command.SYNC | Command.UNSYNC):
            self._sync = not command & Command.UNSYNC
            if self._outputs is not None and not self._cleared:
                self._application.receive(self._outputs)
        if self._may_freeze and command & (Command.FREEZE | Command.UNFREEZE):
            self._frozen = None if command & Command.UNFREEZE else self._application.transmit()
