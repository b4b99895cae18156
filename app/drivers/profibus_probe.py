"""Who stands at an address: asked before anything is parametrised, and again whenever a station was gone."""

from __future__ import annotations

from typing import Final, NamedTuple

from app.drivers.profibus_port import ProfibusPort
from app.wire.profibus import dp
from app.wire.profibus.configuration import Module
from app.wire.profibus.control import Reply, Station
from app.wire.profibus.diagnosis import Diagnosis
from app.wire.profibus.fdl import BROADCAST, ShortAck, Telegram
from app.wire.profibus.fields import FormatError

_REPEATS: Final = 1
_STATUS_SIZE: Final = 6
_SIZE: Final = 64


class Probed(NamedTuple):
    """What a station says. ``diagnosis`` None: it does not tell one; ``modules`` None: nor how it is configured."""

    kind: Station
    diagnosis: Diagnosis | None = None
    modules: tuple[Module, ...] | None = None


def is_there(port: ProfibusPort, node: int) -> Station | None:
    """The kind of station at ``node``; None where nobody answers."""
    told = _ask(port, node, dp.FdlStatus(), _STATUS_SIZE)
    return told.station if isinstance(told, dp.StatusAnswer) else None


def probe(port: ProfibusPort, node: int) -> Probed | None:
    """What stands at ``node``: FDL status, diagnosis, and the configuration where it tells it. None: nobody."""
    kind = is_there(port, node)
    if kind is None or kind is not Station.SLAVE:
        return None if kind is None else Probed(kind)
    diagnosis = _ask(port, node, dp.SlaveDiag(), _SIZE)
    if not isinstance(diagnosis, dp.DiagnosisAnswer):
        return Probed(kind)
    configuration = _ask(port, node, dp.GetCfg(), _SIZE)
    modules = configuration.modules if isinstance(configuration, dp.ConfigurationAnswer) else None
    return Probed(kind, diagnosis.diagnosis, modules)


def leave(port: ProfibusPort, node: int, ident: int) -> None:
    """Give the slave back: it waits for parameters, of whichever master."""
    _ask(port, node, dp.SetPrm(ident, lock=False, unlock=True, min_tsdr=0), _STATUS_SIZE)


def clear(port: ProfibusPort) -> None:
    """Tell all slaves that outputs are not in force any more."""
    port.tell(dp.encode_request(dp.GlobalControl(dp.Command.CLEAR), port.master, BROADCAST))


def _ask(port: ProfibusPort, node: int, service: dp.Service, size: int) -> dp.ServiceAnswer | None:
    """Each of these begins to count anew (FCB without FCV), so none is taken for a repetition."""
    counted = not isinstance(service, dp.FdlStatus)
    request = dp.encode_request(service, port.master, node, fcb=counted)
    reply = port.ask(request, size, lambda answer: _told(service, answer) is not None, _REPEATS)
    return None if reply is None else _told(service, reply.telegram)


def _told(service: dp.Service, answer: Telegram | ShortAck) -> dp.ServiceAnswer | None:
    if isinstance(service, dp.GetCfg) and not isinstance(answer, ShortAck) and not answer.data:
        return dp.Refused(Reply.NO_DATA)  # it is not configured yet
    try:
        return dp.decode_answer(service, answer)
    except FormatError:
        return None
