"""The plan of a restore as the command line tells it."""

from __future__ import annotations

from collections import Counter
from typing import Any

from app.cli.output import Output
from app.model.datatypes import Raw
from app.model.restore.plan import PlanRow, Step, StepKind, Treatment
from app.model.saving import text_key
from app.model.values import quantity_of, show
from app.service.restore.details import plain
from app.service.restore.prepare import Prepared


def tell_plan(prepared: Prepared, output: Output) -> None:
    """For people: rows that are written, how many others are not and why, and every reason against it."""
    plan = prepared.plan
    writes = [row for row in plan.rows if row.treatment is Treatment.WRITE]
    parts = any(step.category is not None for step in plan.steps)
    head = ("DEVICE", "ADDRESS", "NAME", "NOW", "WANTED", "UNIT", *(("CATEGORY",) if parts else ()))
    output.table(head, [(*_row(prepared, row, output), *_part(prepared, row, output, parts)) for row in writes])
    counts = Counter(row.why for row in plan.rows if row.why is not None and row.wanted is not None)
    output.say(
        "cli.restore_plan",
        station=prepared.order.station,
        writes=len(writes),
        equal=sum(row.treatment is Treatment.EQUAL for row in plan.rows),
        skipped=sum(counts.values()),
    )
    for why, count in counts.items():
        output.say("cli.restore_skipped", count=count, why_key=f"restore.why.{why.value}")
    saves = [_save(step, output) for step in plan.steps if step.kind is StepKind.SAVE]
    restarts = [step.device for step in plan.steps if step.kind is StepKind.RESTART]
    output.say("cli.restore_then", saves=", ".join(saves) or "–", restarts=", ".join(restarts) or "–")
    if plan.new_address:
        output.say("cli.restore_new_address", addresses=", ".join(place.address.short for place in plan.new_address))
    for refusal in prepared.refusals:
        text = output.texts(refusal.objection.text_key, **refusal.details)
        output.say("cli.restore_refusal", device=refusal.device or prepared.order.station, text=text)


def plan_dict(prepared: Prepared) -> dict[str, Any]:
    """The same for machines."""
    rows = [row for row in prepared.plan.rows if row.treatment is not Treatment.EQUAL]
    return {
        "station": prepared.order.station,
        "plan": prepared.hash,
        "rows": [
            {
                "device": row.place.slug,
                "address": row.place.address.short,
                "treatment": row.treatment.value,
                "why": None if row.why is None else row.why.value,
                "now": plain(row.now),
                "wanted": plain(row.wanted),
            }
            for row in rows
        ],
        "steps": [
            {
                "kind": step.kind.value,
                "device": step.device,
                "address": step.place and step.place.address.short,
                **({} if step.category is None else {"category": step.category}),
            }
            for step in prepared.plan.steps
        ],
        "refusals": [refusal.as_detail() for refusal in prepared.refusals],
    }


def _save(step: Step, output: Output) -> str:
    """What is saved, as ``turbine/station/device (Tuning)``."""
    return step.device if step.category is None else f"{step.device} ({output.texts(text_key(step.category))})"


def _part(prepared: Prepared, row: PlanRow, output: Output, wanted: bool) -> tuple[str, ...]:
    """The category that saves the object, where there are some."""
    device = prepared.found.station.device(row.place.slug)
    if not wanted or device is None:
        return ()
    category = device.description.entry(row.place.address).save_category
    return ("–" if category is None else output.texts(text_key(category)),)


def _row(prepared: Prepared, row: PlanRow, output: Output) -> tuple[str, ...]:
    device = prepared.found.station.device(row.place.slug)
    assert device is not None  # the plan was made of this station
    entry, lookup = device.description.entry(row.place.address), device.values.get

    def shown(raw: Raw | None) -> str:
        return "–" if raw is None else show(entry, raw, lookup)

    short = row.place.slug.rpartition("/")[2]
    name, unit = output.texts.name(entry.title), quantity_of(entry, lookup).unit
    return short, row.place.address.short, name, shown(row.now), shown(row.wanted), unit
