"""What is kept of an order with its restore, as JSON: enough to go on with it, and to tell of it years later."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from app.model.datatypes import Raw
from app.model.restore.plan import Plan, StepKind, Treatment
from app.model.rules.rule import Finding
from app.model.sets import ParameterSet
from app.service.connection import Connection
from app.service.gate import place_of
from app.service.restore.prepare import Prepared


def details_of(
    connection: Connection, prepared: Prepared, before: Mapping[str, str], nameplates: Mapping[str, str | None]
) -> dict[str, Any]:
    """The document. ``before``: ids of the records with the values before, ``nameplates`` as known, both by slug."""
    order, plan = prepared.order, prepared.plan
    buses = {bus.name: bus.connection for bus in connection.turbine.buses}
    devices = []
    for target in prepared.targets:
        slug, found = target.slug, prepared.found.sets[target.slug]
        given = order.given.get(slug)
        devices.append(
            {
                "slug": slug,
                "adapter": place_of(target.device, buses.get(target.device.bus, "")).adapter,
                "node": target.node,
                "description": [target.description.id, target.description.version],
                "identity": replace(found.identity, nameplate=nameplates.get(slug)).as_json(),
                "before": reference(found, before.get(slug, "")),
                "set": None if given is None else reference(given.parameters, given.record),
                "same_unit": prepared.same_unit.get(slug),
            }
        )
    return {
        "devices": devices,
        "restart": order.restart,
        "expert": order.expert,
        "confirm_s": order.confirm_s,
        "others_confirmed": order.others_confirmed,
        "plan_hash": prepared.hash,
        "modes": {slug: one.mode for slug, one in prepared.found.states.items() if one.mode},
        "saves": list(dict.fromkeys(step.device for step in plan.steps if step.kind is StepKind.SAVE)),
        "categories": _categories(plan),
        "network": order.network,
        "needs": {slug: [need.value for need in needs] for slug, needs in plan.needs.items()},
        "after_restart": list(plan.restarts),
        "skipped": _skipped(plan),
        "writes": [[row.place.slug, str(row.place.address)] for row in plan.rows if row.treatment is Treatment.WRITE],
        "findings": [_finding(one) for one in plan.findings],
    }


def _categories(plan: Plan) -> dict[str, list[str]]:
    """What is saved of each device, where that is not all of it."""
    found: dict[str, list[str]] = {}
    for step in plan.steps:
        if step.kind is StepKind.SAVE and step.category is not None:
            found.setdefault(step.device, []).append(step.category)
    return found


def reference(parameters: ParameterSet, record: str) -> dict[str, str]:
    """Which set that is, and where it comes from."""
    origin = parameters.origin
    return {
        "hash": parameters.hash,
        "record": record,
        "device": origin.device,
        "time": origin.time,
        "person": origin.person,
        "reason": origin.reason,
        "work_order": origin.work_order,
    }


def _skipped(plan: Plan) -> list[dict[str, Any]]:
    return [
        {
            "device": row.place.slug,
            "address": str(row.place.address),
            "why": row.why.value,
            "details": dict(row.details),
            "now": plain(row.now),
            "wanted": plain(row.wanted),
        }
        for row in plan.rows
        if row.why is not None
    ]


def _finding(finding: Finding) -> dict[str, Any]:
    return {
        "rule": finding.rule_id,
        "severity": finding.severity.value,
        "verdict": finding.verdict.value,
        "places": [[place.slug, str(place.address)] for place in finding.places],
        "details": dict(finding.details),
    }


def plain(raw: Raw | None) -> Any:
    """A raw value as JSON."""
    return {"hex": raw.hex()} if isinstance(raw, bytes) else raw
