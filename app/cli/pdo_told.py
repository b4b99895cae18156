"""How ``hubside pdo`` tells what it has found and done: tables for people, one document for machines."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

from app.cli.output import Output
from app.model.address import Address
from app.model.pdo.findings import Finding, is_stop_path
from app.model.pdo.load import Basis, PdoLoad
from app.model.pdo.objects import MAX_DUMMY_INDEX
from app.model.pdo.setup import EVENT_TYPES, LAST_SYNC_TYPE, Direction, Mapped, PdoId, PdoSetup, PdoSetups
from app.model.pdo.writes import PdoWrite
from app.service.connection import Connection
from app.service.devices import Target
from app.service.jobs import Job
from app.service.pdo.desk import Preview
from app.service.pdo.look import Cost, is_operational

_DASH: Final = "–"
_NO_RATE: Final = (Basis.OFF, Basis.EMPTY, Basis.SENDER, Basis.REMOTE, Basis.NO_SYNC)
"""Nothing is sent, or nobody knows how often."""


def tell_setups(output: Output, connection: Connection, target: Target, setups: PdoSetups, cost: Cost) -> None:
    """Every PDO with what it carries, and the load of its bus."""
    bitrate = connection.buses[target.device.bus].bitrate
    operational = is_operational(target)
    if output.as_json:
        pdos = [_setup_document(target, setup, cost.now[target.slug, pdo]) for pdo, setup in setups.items()]
        found = {
            "device": target.slug,
            "operational": operational,
            "bitrate": bitrate,
            "bus_load": round(cost.bus_now, 5),
            "pdo_load": round(cost.pdos_now, 5),
            "pdos": pdos,
        }
        output.result(found, "")
        return
    head = ("PDO", "COB-ID", "STATE", "TYPE", "INHIBIT", "EVENT", "RATE", "LOAD", "OBJECT", "NAME", "BITS")
    rows = [row for pdo, setup in setups.items() for row in _rows(output, target, setup, cost.now[target.slug, pdo])]
    output.table(head, rows)
    output.say("cli.pdo_load", now=_percent(cost.bus_now), pdos=_percent(cost.pdos_now), bitrate=f"{bitrate / 1000:g}")
    if operational is False:
        output.say("page.pdo.not_operational")
    stop = [str(pdo) for pdo, setup in setups.items() if is_stop_path(setup)]
    if stop:
        output.say("cli.pdo_stop_path", pdos=", ".join(stop))


def _rows(output: Output, target: Target, setup: PdoSetup, load: PdoLoad) -> list[tuple[str, ...]]:
    """One row an object; the first one tells of the PDO as a whole."""
    parameters = setup.parameters
    whole = (
        str(setup.id),
        f"{parameters.can_id:X}h",
        output.texts("page.pdo.enabled_short" if setup.enabled else "page.pdo.disabled"),
        _type_text(output, setup),
        f"{parameters.inhibit_100us / 10:g} ms" if parameters.inhibit_100us else _DASH,
        f"{parameters.event_ms} ms" if parameters.event_ms else _DASH,
        _rate(load),
        _DASH if load.basis in _NO_RATE else _percent(load.share),
    )
    blank = ("",) * len(whole)
    if not setup.mapped:
        return [(*whole, _DASH, output.texts("page.pdo.empty"), "")]
    return [
        (*(blank if number else whole), one.address.short, _name(output, target, one), str(one.bits))
        for number, one in enumerate(setup.mapped)
    ]


def _rate(load: PdoLoad) -> str:
    """Frames a second; what was neither measured nor follows from the SYNC is marked."""
    if load.basis in _NO_RATE:
        return _DASH
    return f"{'' if load.basis.certain else '≈ '}{load.per_second:.4g}/s"


def _name(output: Output, target: Target, one: Mapped) -> str:
    if one.address.major <= MAX_DUMMY_INDEX:
        return output.texts("page.pdo.filler", bits=one.bits)
    entry = target.description.entries.get(one.address)
    return _DASH if entry is None else output.texts.name(entry.title)


def _type_text(output: Output, setup: PdoSetup) -> str:
    kind, receives = setup.parameters.transmission_type, setup.id.direction is Direction.RECEIVE
    names = {254: "event_maker", 255: "event_profile"}
    if kind in EVENT_TYPES:
        return output.texts(f"page.pdo.type.{'rpdo_' if receives else ''}{names[kind]}")
    if kind <= LAST_SYNC_TYPE:
        name = "rpdo_sync" if receives else {0: "sync_change", 1: "sync"}.get(kind, "sync_nth")
    else:
        name = "other" if receives else {252: "remote_sync", 253: "remote"}.get(kind, "other")
    return output.texts(f"page.pdo.type.{name}", type=kind)


# -- a change ---------------------------------------------------------------------------


def tell_preview(output: Output, target: Target, found: Preview, as_result: bool) -> None:
    """What a change would do. ``as_result`` false: it is about to be done, and machines are told its end alone."""
    if output.as_json:
        if as_result:
            output.result(_preview_document(target, found), "")
        return
    for one in found.findings:
        severity = output.texts(f"page.pdo.severity.{one.severity.value}")
        output.line(f"{severity}: {_place(one)}: {_words(output, one)}")
    if found.writes:
        rows = [_write_row(output, number, write) for number, write in enumerate(found.writes, start=1)]
        output.table(("", "PDO", "STEP", "OBJECT", "NOW", "NEW"), rows)
    else:
        output.line(output.texts("page.pdo.unchanged"))
    _tell_costs(output, found.cost)


def _place(finding: Finding) -> str:
    return str(finding.pdo) if finding.entry is None else f"{finding.pdo}/{finding.entry}"


def _words(output: Output, finding: Finding) -> str:
    return output.texts(f"page.pdo.finding.{finding.code.value}", **finding.details)


def _write_row(output: Output, number: int, write: PdoWrite) -> tuple[str, ...]:
    step = output.texts(f"page.pdo.step.{write.step.value}")
    was = _DASH if write.was is None else _raw(write.address, write.was)
    return (str(number), str(write.pdo), step, str(write.address), was, _raw(write.address, write.raw))


def _raw(address: Address, raw: int) -> str:
    """COB-IDs and mapped objects as they stand on the wire, everything else as a number."""
    is_mapping = address.major & 0x0200
    wide = address.minor != 0 if is_mapping else address.minor == 1
    return f"{raw:08X}h" if wide else str(raw)


def _tell_costs(output: Output, cost: Cost) -> None:
    changed = [key for key in cost.after if cost.after[key] != cost.now.get(key)]
    for device, pdo in changed:
        now, after = cost.now[device, pdo], cost.after[device, pdo]
        output.line(
            output.texts(
                "cli.pdo_cost",
                pdo=str(pdo),
                now=_percent(now.share),
                after=_percent(after.share),
                rate=f"{after.per_second:.4g}",
                basis_key=f"page.pdo.basis.{after.basis.value}",
            )
        )
    output.line(output.texts("page.pdo.load_pdos", now=_percent(cost.pdos_now), after=_percent(cost.pdos_after)))
    output.line(output.texts("page.pdo.load_after", now=_percent(cost.bus_now), after=_percent(cost.bus_after)))


def tell_done(output: Output, target: Target, job: Job, undone: bool) -> None:
    """It has come to its end."""
    addresses = [row.address for row in job.rows]
    text = output.texts("cli.pdo_undone" if undone else "cli.pdo_set", device=target.slug, count=len(addresses))
    output.result({"device": target.slug, "written": addresses, "undone": undone}, text)
    saved = [target.entry(address).saved for address in target.description.entries if 0x1400 <= address.major < 0x1C00]
    if not output.as_json:
        output.say("page.pdo.kept" if saved and all(saved) else "page.pdo.after_restart")


# -- for machines -----------------------------------------------------------------------


def _setup_document(target: Target, setup: PdoSetup, load: PdoLoad) -> dict[str, Any]:
    parameters = setup.parameters
    return {
        "pdo": str(setup.id),
        "enabled": setup.enabled,
        "cob_id": parameters.cob_id,
        "can_id": parameters.can_id,
        "extended": parameters.extended,
        "remote": parameters.rtr_allowed,
        "type": parameters.transmission_type,
        "inhibit_ms": parameters.inhibit_100us / 10,
        "event_ms": parameters.event_ms,
        "sync_start": parameters.sync_start,
        "stop_path": is_stop_path(setup),
        "mapped": [{"object": str(one.address), "name": _title(target, one), "bits": one.bits} for one in setup.mapped],
        "load": _load_document(load),
    }


def _title(target: Target, one: Mapped) -> str | None:
    entry = target.description.entries.get(one.address)
    return None if entry is None else entry.title


def _load_document(load: PdoLoad) -> dict[str, Any]:
    return {
        "per_second": load.per_second,
        "bits": load.bits,
        "share": round(load.share, 6),
        "basis": load.basis.value,
        "certain": load.basis.certain,
    }


def _preview_document(target: Target, found: Preview) -> dict[str, Any]:
    cost = found.cost
    return {
        "device": target.slug,
        "findings": [
            {
                "severity": one.severity.value,
                "code": one.code.value,
                "pdo": str(one.pdo),
                "entry": one.entry,
                "details": dict(one.details),
            }
            for one in found.findings
        ],
        "writes": [
            {
                "pdo": str(one.pdo),
                "step": one.step.value,
                "address": str(one.address),
                "was": one.was,
                "raw": one.raw,
            }
            for one in found.writes
        ],
        "load": {
            "bus_now": round(cost.bus_now, 5),
            "bus_after": round(cost.bus_after, 5),
            "pdos_now": round(cost.pdos_now, 5),
            "pdos_after": round(cost.pdos_after, 5),
            "changed": list(_changed_loads(cost)),
        },
    }


def _changed_loads(cost: Cost) -> Iterable[dict[str, Any]]:
    key: tuple[str, PdoId]
    for key, after in cost.after.items():
        now = cost.now[key]
        if now != after:
            yield {"pdo": str(key[1]), "now": _load_document(now), "after": _load_document(after)}


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"
