"""Rules and what they find, as the page gets them. Their texts are ``rule.<id>.title``, ``.why`` and ``.broken``."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.model.rules.rule import Finding, Rule
from app.service.rule_check import Judged
from app.web.models.compare import AddressText, Slug, Spec
from app.web.models.writes import RawIn

RuleSeverity = Literal["error", "warning", "note"]
RuleVerdict = Literal["broken", "not-checked"]


class RuleDoc(BaseModel):
    """One rule. ``objects``: the addresses that it looks at, by description id; ``section`` of the manual.

    ``stepwise``: it holds after every single write of a restore as well.
    """

    id: str
    section: str
    severity: RuleSeverity
    stepwise: bool
    objects: dict[str, list[str]]

    @classmethod
    def of(cls, rule: Rule) -> RuleDoc:
        """As the page gets it."""
        objects = {kind: list(addresses) for kind, addresses in rule.objects.items()}
        return cls(
            id=rule.id,
            section=rule.section,
            severity=rule.severity.value,
            stepwise=rule.stepwise,
            objects=objects,
        )


class RuleList(BaseModel):
    """All rules, in their order."""

    rules: list[RuleDoc]


class RulesCheckRequest(BaseModel):
    """What to judge: ``columns`` (as of a comparison, such as ``set:…``), else the connected turbine.

    ``station``: only this one of the turbine. ``pending`` are changes by device and address.
    """

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [{"station": "wtg-07/blade-2", "pending": {"wtg-07/blade-2/pmm": {"30FA:01": 610}}}]
        },
    )

    station: Slug | None = None
    columns: Annotated[list[Spec], Field(max_length=24)] = Field(default_factory=list)
    pending: Annotated[dict[Slug, Annotated[dict[AddressText, RawIn], Field(max_length=500)]], Field(max_length=24)] = (
        Field(default_factory=dict)
    )


class RulePlace(BaseModel):
    """One object of one device."""

    device: str
    address: str


class RuleFinding(BaseModel):
    """What one rule says. Not checked: the text is ``rule.not_checked``. ``details`` fill the text's placeholders.

    A detail ``at_default`` names the object to mend where it holds its default; its text is ``rule.at_default``.
    """

    rule: str
    severity: RuleSeverity
    verdict: RuleVerdict
    places: list[RulePlace]
    details: dict[str, int | float | str]

    @classmethod
    def of(cls, finding: Finding) -> RuleFinding:
        """As the page gets it."""
        return cls(
            rule=finding.rule_id,
            severity=finding.severity.value,
            verdict=finding.verdict.value,
            places=[RulePlace(device=one.slug, address=one.address.short) for one in finding.places],
            details=dict(finding.details),
        )


class StationFindings(BaseModel):
    """One station: the devices that were judged together, and the findings, the gravest first."""

    station: str
    devices: list[str]
    findings: list[RuleFinding]

    @classmethod
    def of(cls, judged: Judged) -> StationFindings:
        """As the page gets it."""
        return cls(
            station=judged.station,
            devices=list(judged.devices),
            findings=[RuleFinding.of(one) for one in judged.findings],
        )


class RulesChecked(BaseModel):
    """What the rules say of each station that was looked at."""

    stations: list[StationFindings]
