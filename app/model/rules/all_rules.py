"""Every rule there is, in the order in which they are listed."""

from __future__ import annotations

from typing import Final

from app.model.rules import (
    axis,
    battery,
    charger,
    dc_link,
    encoder,
    hydraulics,
    mains,
    mirrors,
    monitoring,
    motor,
    outputs,
    temperatures,
)
from app.model.rules.rule import Rule

ALL: Final[tuple[Rule, ...]] = (
    *dc_link.RULES,
    *mains.RULES,
    *battery.RULES,
    *charger.RULES,
    *axis.RULES,
    *motor.RULES,
    *encoder.RULES,
    *monitoring.RULES,
    *temperatures.RULES,
    *outputs.RULES,
    *mirrors.RULES,
    *hydraulics.RULES,
)
