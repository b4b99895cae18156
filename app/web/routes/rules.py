"""The rules of stations, and what they say of the connected turbine with what is pending, or of sets. Reads only."""

from __future__ import annotations

from fastapi import APIRouter

from app.model.rules.all_rules import ALL
from app.model.station import DeviceValues
from app.service.compare.ground import ground_of
from app.service.compare.sources import Columns
from app.service.rule_check import check_live, judge
from app.web.deps import BenchOf
from app.web.models.rules import RuleDoc, RuleList, RulesChecked, RulesCheckRequest, StationFindings

router = APIRouter()


@router.get("/rules")
async def rules() -> RuleList:
    """All rules."""
    return RuleList(rules=[RuleDoc.of(rule) for rule in ALL])


@router.post("/rules/check")
async def check_rules(bench: BenchOf, request: RulesCheckRequest) -> RulesChecked:
    """Judge stations. A column or a device that is not there is named by the problem."""
    columns = Columns(ground_of(bench))
    pending = columns.read_pending(request.pending)
    if request.columns:
        shown = [(await columns.resolve(spec, pending)).column for spec in request.columns]
        found = judge(DeviceValues(one.slug, one.description, one.values) for one in shown)
    else:
        found = check_live(bench.require().targets, pending, request.station)
    return RulesChecked(stations=[StationFindings.of(one) for one in found])
