"""Services of DP-V0 between a master of class 1 and a slave, and the telegrams that carry them.

An answer of Data_Exchange names no service, and SC not even its sender: ``decode_answer`` is told the request.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Final

from app.wire.profibus.configuration import Module, decode_configuration, encode_configuration
from app.wire.profibus.control import Answer, Ask, Reply, Request, Station
from app.wire.profibus.diagnosis import Diagnosis, decode_diagnosis
from app.wire.profibus.fdl import BROADCAST, AnyTelegram, ShortAck, Telegram, Token
from app.wire.profibus.fields import FormatError, checked
from app.wire.records import Fault

MASTER_SAP: Final = 62
MAX_USER_DATA: Final = 237
MAX_EXCHANGE: Final = 244
WATCHDOG_STEP_MS: Final = 10
_EXCHANGES: Final = frozenset({Ask.SRD_LOW, Ask.SRD_HIGH, Ask.SDA_LOW, Ask.SDA_HIGH})


class Sap(IntEnum):
    """Access points of a slave."""

    SET_ADDRESS = 55
    READ_INPUTS = 56
    READ_OUTPUTS = 57
    GLOBAL_CONTROL = 58
    GET_CONFIGURATION = 59
    DIAGNOSIS = 60
    SET_PARAMETERS = 61
    CHECK_CONFIGURATION = 62


@dataclass(frozen=True, slots=True)
class FdlStatus:
    """Asks whether there is a station, and of which kind."""


@dataclass(frozen=True, slots=True)
class SlaveDiag:
    """Asks for the diagnosis."""


@dataclass(frozen=True, slots=True)
class GetCfg:
    """Asks for the configuration."""


@dataclass(frozen=True, slots=True)
class SetPrm:
    """Parameters of the bus: who owns the slave, its watchdog, and data of the maker.

    ``watchdog`` are the two factors, None where it is off; their product times 10 ms is the time. ``min_tsdr`` is in
    bit times, 0 leaves it.
    """

    ident: int
    lock: bool = True
    unlock: bool = False
    watchdog: tuple[int, int] | None = None
    min_tsdr: int = 11
    groups: int = 0
    sync: bool = False
    freeze: bool = False
    user_data: bytes = b""

    @property
    def watchdog_ms(self) -> int | None:
        """The watchdog's time in ms, None where it is off."""
        return None if self.watchdog is None else WATCHDOG_STEP_MS * self.watchdog[0] * self.watchdog[1]

    def encode(self) -> bytes:
        """The data. Raises ValueError where a field is out of range."""
        flags = 0x80 * self.lock | 0x40 * self.unlock | 0x20 * self.sync | 0x10 * self.freeze
        factors = (0, 0) if self.watchdog is None else self.watchdog
        for factor in self.watchdog or ():
            checked(factor, 1, 255, "watchdog factor")
        checked(len(self.user_data), 0, MAX_USER_DATA, "length of the maker's data")
        head = (flags | 0x08 * (self.watchdog is not None), *factors, checked(self.min_tsdr, 0, 255, "min TSDR"))
        ident = checked(self.ident, 0, 0xFFFF, "ident number").to_bytes(2, "big")
        return bytes(head) + ident + bytes((checked(self.groups, 0, 255, "groups"),)) + self.user_data


@dataclass(frozen=True, slots=True)
class ChkCfg:
    """The configuration that the master means to exchange."""

    modules: tuple[Module, ...]


@dataclass(frozen=True, slots=True)
class DataExchange:
    """Outputs to the slave; it answers with its inputs."""

    outputs: bytes = b""


class Command(IntFlag):
    """What Global_Control tells."""

    CLEAR = 0x02
    UNFREEZE = 0x04
    FREEZE = 0x08
    UNSYNC = 0x10
    SYNC = 0x20


OPERATE: Final = Command(0)


@dataclass(frozen=True, slots=True)
class GlobalControl:
    """A command to all slaves of ``groups`` (0: all), without an answer. ``OPERATE`` ends a clear."""

    command: Command = OPERATE
    groups: int = 0


@dataclass(frozen=True, slots=True)
class Other:
    """A request of a service that is none of these; ``data`` as they are."""

    ask: Ask
    dsap: int | None
    ssap: int | None
    data: bytes


Service = FdlStatus | SlaveDiag | GetCfg | SetPrm | ChkCfg | DataExchange | GlobalControl | Other

_OF_SAP: Final = {
    SlaveDiag: Sap.DIAGNOSIS,
    GetCfg: Sap.GET_CONFIGURATION,
    SetPrm: Sap.SET_PARAMETERS,
    ChkCfg: Sap.CHECK_CONFIGURATION,
    GlobalControl: Sap.GLOBAL_CONTROL,
}


def encode_request(service: Service, master: int, slave: int, fcb: bool = False, fcv: bool = False) -> Telegram:
    """The telegram of a service. ``fcb`` and ``fcv`` count requests that are answered. Raises ValueError."""
    if isinstance(service, FdlStatus):
        return Telegram(slave, master, Request(Ask.FDL_STATUS))
    if isinstance(service, Other):
        return Telegram(slave, master, Request(service.ask, fcb, fcv), service.data, service.dsap, service.ssap)
    if isinstance(service, DataExchange):
        checked(len(service.outputs), 0, MAX_EXCHANGE, "length of outputs")
        return Telegram(slave, master, Request(Ask.SRD_HIGH, fcb, fcv), service.outputs)
    if isinstance(service, GlobalControl):
        groups = checked(service.groups, 0, 255, "groups")
        data = bytes((checked(int(service.command), 0, 0x3E, "command"), groups))
        return Telegram(slave, master, Request(Ask.SDN_HIGH), data, Sap.GLOBAL_CONTROL, MASTER_SAP)
    data = b""
    if isinstance(service, SetPrm):
        data = service.encode()
    elif isinstance(service, ChkCfg):
        data = encode_configuration(service.modules)
    return Telegram(slave, master, Request(Ask.SRD_HIGH, fcb, fcv), data, _OF_SAP[type(service)], MASTER_SAP)


def decode_request(telegram: Telegram) -> Service:
    """What a master asks for. Raises FormatError, with an offset in the telegram's bytes."""
    control, data, base = telegram.control, telegram.data, telegram.data_offset
    if not isinstance(control, Request):
        raise FormatError(Fault.FIELD, telegram.control_offset, "an answer is no request")
    other = Other(control.ask, telegram.dsap, telegram.ssap, data)
    if telegram.dsap is None and telegram.ssap is None:
        if control.ask is Ask.FDL_STATUS and not data:
            return FdlStatus()
        return DataExchange(data) if control.ask in (Ask.SRD_LOW, Ask.SRD_HIGH) else other
    if telegram.ssap != MASTER_SAP:
        return other
    if telegram.dsap == Sap.GLOBAL_CONTROL:
        return other if control.ask.answered else _global_control(data, base)
    if control.ask not in _EXCHANGES:
        return other
    if telegram.dsap == Sap.SET_PARAMETERS:
        return _set_prm(data, base)
    if telegram.dsap == Sap.CHECK_CONFIGURATION:
        return ChkCfg(decode_configuration(data, base))
    if telegram.dsap in (Sap.DIAGNOSIS, Sap.GET_CONFIGURATION):
        if data:
            raise FormatError(Fault.LENGTH, base, f"{len(data)} bytes too many")
        return SlaveDiag() if telegram.dsap == Sap.DIAGNOSIS else GetCfg()
    return other


def _set_prm(data: bytes, base: int) -> SetPrm:
    if len(data) < 7:
        raise FormatError(Fault.LENGTH, base + len(data), "Set_Prm has 7 bytes at least")
    if data[0] & 0x07:
        raise FormatError(Fault.FIELD, base, f"station status {data[0]:02X}h has reserved bits set")
    watchdog = (data[1], data[2]) if data[0] & 0x08 else None
    if watchdog is not None and 0 in watchdog:
        raise FormatError(Fault.FIELD, base + 1, "a watchdog factor is 0")
    flags = [bool(data[0] & bit) for bit in (0x80, 0x40, 0x20, 0x10)]
    ident = int.from_bytes(data[4:6], "big")
    return SetPrm(ident, flags[0], flags[1], watchdog, data[3], data[6], flags[2], flags[3], data[7:])


def _global_control(data: bytes, base: int) -> GlobalControl:
    if len(data) != 2:
        raise FormatError(Fault.LENGTH, base + min(len(data), 2), "Global_Control has 2 bytes")
    if data[0] & 0xC1:
        raise FormatError(Fault.FIELD, base, f"command {data[0]:02X}h has reserved bits set")
    return GlobalControl(Command(data[0]), data[1])


# -- answers ------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class StatusAnswer:
    """There is a station of this kind."""

    station: Station


@dataclass(frozen=True, slots=True)
class DiagnosisAnswer:
    """The diagnosis of a slave."""

    diagnosis: Diagnosis


@dataclass(frozen=True, slots=True)
class ConfigurationAnswer:
    """The configuration that a slave has."""

    modules: tuple[Module, ...]


@dataclass(frozen=True, slots=True)
class Inputs:
    """The inputs of a slave; ``diagnosis`` where it has one to tell."""

    data: bytes = b""
    diagnosis: bool = False


@dataclass(frozen=True, slots=True)
class Done:
    """Taken, nothing to tell."""


@dataclass(frozen=True, slots=True)
class Refused:
    """Not taken, and why."""

    reply: Reply


@dataclass(frozen=True, slots=True)
class OtherAnswer:
    """The answer to a service that is none of these."""

    reply: Reply
    data: bytes


ServiceAnswer = StatusAnswer | DiagnosisAnswer | ConfigurationAnswer | Inputs | Done | Refused | OtherAnswer

_REFUSALS: Final = frozenset({Reply.USER_ERROR, Reply.NO_RESOURCE, Reply.NO_SERVICE})
_WITH_DATA: Final = frozenset({Reply.DATA_LOW, Reply.DATA_HIGH})


def encode_answer(answer: ServiceAnswer, request: Telegram) -> Telegram | ShortAck:
    """The telegram with which the station of ``request`` answers it. Raises ValueError."""
    if isinstance(answer, Done) or answer == Inputs():
        return ShortAck()
    data, reply, station = b"", Reply.DATA_LOW, Station.SLAVE
    if isinstance(answer, StatusAnswer):
        reply, station = Reply.OK, answer.station
    elif isinstance(answer, Refused):
        reply = answer.reply
    elif isinstance(answer, OtherAnswer):
        reply, data = answer.reply, answer.data
    elif isinstance(answer, Inputs):
        reply, data = Reply.DATA_HIGH if answer.diagnosis else Reply.DATA_LOW, answer.data
    elif isinstance(answer, DiagnosisAnswer):
        data = answer.diagnosis.encode()
    else:
        data = encode_configuration(answer.modules)
    control, saps = Answer(reply, station), (request.ssap, request.dsap)
    return Telegram(request.source, request.destination, control, data, *(saps if data else (None, None)))


def belongs(request: Telegram, answer: AnyTelegram) -> bool:
    """True where ``answer`` can be that of ``request``: SC can be anybody's, a token nobody's."""
    if isinstance(answer, ShortAck):
        return True
    if isinstance(answer, Token) or request.destination == BROADCAST:
        return False
    saps = (answer.dsap, answer.ssap)
    return (
        isinstance(answer.control, Answer)
        and (answer.destination, answer.source) == (request.source, request.destination)
        and saps in ((request.ssap, request.dsap), (None, None))
    )


def decode_answer(request: Service, answer: Telegram | ShortAck) -> ServiceAnswer:
    """What the station says to ``request``. Raises FormatError, with an offset in the answer's bytes."""
    if isinstance(answer, ShortAck):
        if isinstance(request, DataExchange):
            return Inputs()
        if isinstance(request, SetPrm | ChkCfg | Other):
            return Done()
        raise FormatError(Fault.LENGTH, 0, "a bare acknowledge answers no question")
    control, data, base = answer.control, answer.data, answer.data_offset
    if not isinstance(control, Answer):
        raise FormatError(Fault.FIELD, answer.control_offset, "a request is no answer")
    if control.reply in _REFUSALS:
        return Refused(control.reply)
    if isinstance(request, FdlStatus):
        if control.reply is not Reply.OK or data:
            raise FormatError(Fault.FIELD, base, "an FDL status is OK, without data")
        return StatusAnswer(control.station)
    if isinstance(request, Other | GlobalControl):
        return OtherAnswer(control.reply, data)
    if control.reply not in _WITH_DATA:
        return _without_data(request, control.reply, data, base)
    if isinstance(request, SlaveDiag):
        return DiagnosisAnswer(decode_diagnosis(data, base))
    if isinstance(request, GetCfg):
        return ConfigurationAnswer(decode_configuration(data, base))
    if isinstance(request, DataExchange):
        return Inputs(data, control.reply is Reply.DATA_HIGH)
    raise FormatError(Fault.FIELD, base, "an answer with data to a request that asks for none")


def _without_data(request: Service, reply: Reply, data: bytes, base: int) -> ServiceAnswer:
    if data or reply not in (Reply.OK, Reply.NO_DATA):
        raise FormatError(Fault.FIELD, base, f"{reply.name} does not carry {len(data)} bytes")
    if isinstance(request, SetPrm | ChkCfg):
        return Done()
    if isinstance(request, DataExchange):
        return Inputs()
    raise FormatError(Fault.LENGTH, base, "the answer has no data")
