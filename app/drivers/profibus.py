"""One slave, run by the DP master of pyprofibus. The only module that knows that library, which is GPL.

Each slave has a master object of its own on the shared port: the library's queue for several slaves takes any short
acknowledge for that of each, and starves the line where one is absent. Its physical layer is ours: ``send`` returns
once the answer is there, or will not come, so that nothing of the library waits for the line.
"""

from __future__ import annotations

import logging
from collections import deque
from enum import Enum
from pathlib import Path
from typing import Any, Final, NamedTuple

from pyprofibus.dp import DpCfgDataElement, DpError
from pyprofibus.dp_master import DPM1, DpSlaveDesc, DpSlaveState
from pyprofibus.gsd.interp import GsdInterp
from pyprofibus.gsd.parser import GsdError
from pyprofibus.phy import CpPhy

from app.drivers.profibus_port import ProfibusPort
from app.errors import UsageError
from app.wire.profibus import dp
from app.wire.profibus.configuration import Module, decode_configuration
from app.wire.profibus.diagnosis import Diagnosis
from app.wire.profibus.fdl import ShortAck, Telegram, decode
from app.wire.profibus.fields import FormatError

_LOG: Final = logging.getLogger(__name__)
REPEATS: Final = 2
"""More attempts of a request that has no answer."""
STATUS_SIZE: Final = 6
DIAGNOSIS_SIZE: Final = 64
WATCHDOG_MS: Final = 1000
"""So long after our last telegram a slave falls back by itself; less is too near to one lost and repeated request."""
# The library would parametrise a slave anew after half that time, and so take its outputs from it without need.
DpSlaveState.stateTimeLimits[DpSlaveState.STATE_DX] = WATCHDOG_MS / 1000
_MOST_RUNS: Final = 5
_HEAD: Final = 9
"""Bytes that SD2 adds to its data."""


class Plan(NamedTuple):
    """How a slave is parametrised: its ident number, configuration, data of the maker, and bytes each way."""

    ident: int
    modules: tuple[Module, ...]
    user_data: bytes = b""

    @property
    def output_size(self) -> int:
        """Bytes from master to slave."""
        return sum(module.output_size for module in self.modules)

    @property
    def input_size(self) -> int:
        """Bytes from slave to master."""
        return sum(module.input_size for module in self.modules)


class Step(Enum):
    """What came of one turn of a slave."""

    WAITING = "waiting"
    """Nothing was sent: it is not time to ask again yet."""
    STARTING = "starting"
    EXCHANGED = "exchanged"
    UNANSWERED = "unanswered"
    NOT_ACTIVE = "not_active"
    """It has no parameters any more (RS): it was restarted, or its watchdog ran out."""


class Exchange(NamedTuple):
    """One turn. ``fresh``: the slave has surely taken these outputs, and the inputs are of now.

    Where an exchange had no answer at all, the next one bears the same frame count bit: a slave that had taken the
    one before takes it for a repetition, gives the inputs of then, and never looks at its outputs.
    """

    step: Step
    inputs: bytes = b""
    fresh: bool = False


class _Phy(CpPhy):  # type: ignore[misc]  # the library has no types
    """Our port as the library's physical layer."""

    def __init__(self, port: ProfibusPort, input_size: int) -> None:
        super().__init__()
        self.setConfig(baudrate=port.baud)
        self.port = port
        self.diagnosis: Diagnosis | None = None
        self.asked = 0
        self.answered = 0
        self._input_size = input_size
        self._replies: deque[bytearray] = deque()

    def send(self, telegram: Any, srd: bool, maxReplyLen: int = -1) -> None:  # noqa: N803 - the library's name
        request = decode(bytes(telegram.getRawData()))
        assert isinstance(request, Telegram)  # a master of one slave sends no token
        self._replies.clear()
        if not srd:
            self.port.tell(request)
            return
        self.asked += 1
        service = dp.decode_request(request)
        size = DIAGNOSIS_SIZE if isinstance(service, dp.SlaveDiag) else STATUS_SIZE
        size = self._input_size + _HEAD if isinstance(service, dp.DataExchange) else size
        reply = self.port.ask(request, size, lambda answer: self._makes_sense(service, answer), REPEATS)
        if reply is not None:
            self.answered += 1
            self._replies.append(bytearray(reply.data))

    @property
    def has_reply(self) -> bool:
        """The library has not taken it yet."""
        return bool(self._replies)

    def poll(self, timeout: float = 0.0) -> bytearray | None:
        return self._replies.popleft() if self._replies else None

    def _makes_sense(self, service: dp.Service, answer: Telegram | ShortAck) -> bool:
        if isinstance(answer, ShortAck) and not isinstance(service, dp.SetPrm | dp.ChkCfg):
            return False  # one byte without a check sum: what ought to have data has none in it
        try:
            told = dp.decode_answer(service, answer)
        except FormatError as error:
            _LOG.debug("no answer: %s", error)
            return False
        if isinstance(told, dp.DiagnosisAnswer):
            self.diagnosis = told.diagnosis
        return not isinstance(told, dp.Inputs) or len(told.data) == self._input_size


class _Master(DPM1):  # type: ignore[misc]  # the library has no types
    """The library's master, whose complaints go to the log: standard output belongs to the command line."""

    def _DpMaster__errorMsg(self, text: str) -> None:  # noqa: N802 - as the library mangles it
        _LOG.info("%s", text)


class DpSlave:
    """The slave at ``node`` as ``plan`` has it, from Set_Prm to Data_Exchange. Raises LineError, ForeignMasterError."""

    def __init__(self, port: ProfibusPort, node: int, plan: Plan) -> None:
        self.node = node
        self.plan = plan
        self._phy = _Phy(port, plan.input_size)
        self._master = _Master(self._phy, port.master)
        self._slave = _description(node, plan)
        self._master.addSlave(self._slave)
        self._master.initialize()
        self._uncertain = False

    @property
    def exchanging(self) -> bool:
        """It has been parametrised and configured, and exchanges data."""
        return bool(self._slave.isConnected())

    @property
    def diagnosis(self) -> Diagnosis | None:
        """Its latest."""
        return self._phy.diagnosis

    def turn(self, outputs: bytes) -> Exchange:
        """Go one step on: ask once, and take the answer. ``outputs`` go out where it exchanges."""
        phy, exchanging = self._phy, self.exchanging
        asked, answered = phy.asked, phy.answered
        if exchanging:
            self._slave.setMasterOutData(bytearray(outputs))
        try:
            inputs = self._run()
        except DpError as error:
            _LOG.info("slave %d: %s", self.node, error)
            return Exchange(Step.NOT_ACTIVE)
        if phy.asked == asked:
            return Exchange(Step.WAITING)
        if phy.answered == answered:
            self._uncertain = self._uncertain or exchanging
            return Exchange(Step.UNANSWERED)
        if not exchanging or inputs is None:
            return Exchange(Step.STARTING)
        fresh, self._uncertain = not self._uncertain, False
        return Exchange(Step.EXCHANGED, bytes(inputs), fresh)

    def _run(self) -> bytearray | None:
        """Have the library ask once and take the answer, each of which is a run of its own.

        A run may also only note that a time is over, so runs are not counted in pairs: an answer that is left for the
        next turn would leave all later ones late by one.
        """
        inputs, asked = None, self._phy.asked
        for number in range(_MOST_RUNS):
            self._master.run()
            inputs = self._slave.getMasterInData() or inputs  # the next run would lose them
            idle = self._phy.asked == asked and number > 0
            if idle or (self._phy.asked > asked and not self._phy.has_reply):
                break
        return inputs


def _description(node: int, plan: Plan) -> Any:
    slave = DpSlaveDesc()
    slave.name = f"slave {node}"
    slave.slaveAddr = node
    slave.identNumber = plan.ident
    slave.inputSize = plan.output_size  # the library looks from the slave's side
    slave.outputSize = plan.input_size
    slave.setPrmTelegram.da = slave.chkCfgTelegram.da = node
    slave.setPrmTelegram.identNumber = plan.ident
    identifiers = [module.encode() for module in plan.modules]
    slave.setCfgDataElements([DpCfgDataElement(one[0], one[1:]) for one in identifiers])
    slave.setUserPrmData(plan.user_data)
    slave.setWatchdog(WATCHDOG_MS)
    return slave


def plan_of_gsd(path: Path, names: tuple[str, ...]) -> Plan:
    """The plan by the device's own file. Raises UsageError, also where a module is not named exactly as in the file.

    The library would take the module that looks most like it: "Telegram 103" became "Telegram 102".
    """
    try:
        gsd = GsdInterp.fromFile(str(path))
        known = [module.name for module in gsd.getField("Module", [])]
        for name in names:
            if known.count(name) != 1:
                there = ", ".join(f"'{one}'" for one in known)
                raise UsageError(reason=f"{path.name} has no module '{name}'; there are: {there}")
        gsd.clearConfiguredModules()
        for name in names:
            gsd.setConfiguredModule(name)
        data = b"".join(bytes(element.getDU()) for element in gsd.getCfgDataElements())
        return Plan(int(gsd.getIdentNumber()), decode_configuration(data), bytes(gsd.getUserPrmData()))
    except (GsdError, FormatError, OSError) as error:
        raise UsageError(reason=f"{path} is no usable GSD file: {error}") from error
