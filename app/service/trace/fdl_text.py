"""What a PROFIBUS telegram says beside its parameters and signals: texts of its service, for the page."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final, NamedTuple

from app.wire.profibus import dp
from app.wire.profibus.configuration import Module
from app.wire.profibus.diagnosis import NO_MASTER, Diagnosis
from app.wire.profibus.pkw import AskKind, PkwAnswer, PkwRequest, ReplyKind, error_text_key
from app.wire.trace.fdl_told import FdlTold

_KEY: Final = "trace.fdl"


class FdlNote(NamedTuple):
    """A text key with what fills its placeholders; a detail named ``x_key`` is itself a text key."""

    key: str
    details: Mapping[str, Any]


def fdl_notes(told: FdlTold, same: bool) -> Iterator[FdlNote]:
    """What a telegram says; ``same``: its data are those of the one before."""
    yield from _service(told)
    yield from _job(told.pkw)
    if same:
        yield FdlNote(f"{_KEY}.same", {})
    elif told.process_data and not told.signals:
        yield FdlNote(f"{_KEY}.process_data", {"bytes": told.process_data.hex(" ").upper()})


def _service(told: FdlTold) -> Iterable[FdlNote]:
    match told.answer if told.answer is not None else told.service:
        case dp.SetPrm() as parameters:
            return _parameters(parameters)
        case dp.ChkCfg(modules) | dp.ConfigurationAnswer(modules):
            return (_modules(modules),)
        case dp.DiagnosisAnswer(diagnosis):
            return _diagnosis(diagnosis)
        case dp.StatusAnswer(station):
            return (FdlNote(f"{_KEY}.station_{station.name.lower()}", {}),)
        case dp.GlobalControl() as control:
            return _control(control)
        case dp.Refused(reply):
            return (FdlNote(f"{_KEY}.refused", {"reason_key": reply.text_key}),)
        case dp.Inputs(diagnosis=True):
            return (FdlNote(f"{_KEY}.diagnosis_waits", {}),)
        case dp.Done():
            return (FdlNote(f"{_KEY}.taken", {}),)
        case dp.Other(_, dsap, ssap, _) if told.answer is None:
            return (FdlNote(f"{_KEY}.other", {"dsap": _sap(dsap), "ssap": _sap(ssap)}),)
    return ()


def _sap(sap: int | None) -> str:
    return "–" if sap is None else str(sap)


def _parameters(service: dp.SetPrm) -> Iterator[FdlNote]:
    yield FdlNote(f"{_KEY}.{'unlock' if service.unlock else 'lock'}", {"ident": f"{service.ident:04X}h"})
    if service.watchdog_ms is not None:
        yield FdlNote(f"{_KEY}.watchdog", {"ms": service.watchdog_ms})
    elif not service.unlock:
        yield FdlNote(f"{_KEY}.no_watchdog", {})


def _modules(modules: tuple[Module, ...]) -> FdlNote:
    outputs, inputs = sum(one.output_size for one in modules), sum(one.input_size for one in modules)
    return FdlNote(f"{_KEY}.modules", {"count": len(modules), "outputs": outputs, "inputs": inputs})


def _diagnosis(diagnosis: Diagnosis) -> Iterator[FdlNote]:
    for key in diagnosis.status.text_keys:
        yield FdlNote(key, {})
    details = {"ident": f"{diagnosis.ident:04X}h", "master": diagnosis.master}
    yield FdlNote(f"{_KEY}.{'no_owner' if diagnosis.master == NO_MASTER else 'owner'}", details)
    if diagnosis.extended:
        yield FdlNote(f"{_KEY}.extended", {"bytes": diagnosis.extended.hex(" ").upper()})


def _control(control: dp.GlobalControl) -> Iterator[FdlNote]:
    names = [str(bit.name).lower() for bit in dp.Command if control.command & bit] or ["operate"]
    for name in names:
        yield FdlNote(f"{_KEY}.command_{name}", {})
    if control.groups:
        yield FdlNote(f"{_KEY}.groups", {"groups": f"{control.groups:02X}h"})


def _job(job: PkwRequest | PkwAnswer | None) -> Iterator[FdlNote]:
    if isinstance(job, PkwRequest):
        yield FdlNote(f"{_KEY}.{'pkw_read' if job.kind is AskKind.READ else 'pkw_write'}", {"task": int(job.kind)})
    elif isinstance(job, PkwAnswer) and job.kind is ReplyKind.REFUSED:
        details = {"code": job.value, "reason_key": error_text_key(job.value)}
        yield FdlNote(f"{_KEY}.pkw_refused", details)
    elif isinstance(job, PkwAnswer):
        yield FdlNote(f"{_KEY}.pkw_done", {"answer": int(job.kind)})
