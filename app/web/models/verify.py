"""Types of the comparison of a description with its device."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel

from app.service.verify import Finding, Verified

DeviationName = Literal["missing", "extra", "subs", "size", "not_ready", "mapping"]


class VerifyFinding(BaseModel):
    """One difference. ``expected`` and ``found`` count sub-indices, bytes or bits, or are a value; null is nothing."""

    address: str
    deviation: DeviationName
    expected: int | None
    found: int | None

    @classmethod
    def of(cls, finding: Finding) -> VerifyFinding:
        """As the page gets it."""
        return cls(
            address=finding.address.short,
            deviation=finding.deviation.value,
            expected=finding.expected,
            found=finding.found,
        )


class VerifyDone(BaseModel):
    """``objects``: how many the description has. No finding: the device is as it is described."""

    t_ns: int
    objects: int
    findings: list[VerifyFinding]

    @classmethod
    def of(cls, done: Verified) -> VerifyDone:
        """As the page gets it."""
        return cls(t_ns=done.t_ns, objects=done.objects, findings=[VerifyFinding.of(one) for one in done.findings])
