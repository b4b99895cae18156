"""Every rule there is, in the order in which they are listed."""

from __future__ import annotations

from typing import Final

from app.model.rules import dc_link
from app.model.rules.rule import Rule

ALL: Final[tuple[Rule, ...]] = (*dc_link.RULES,)
