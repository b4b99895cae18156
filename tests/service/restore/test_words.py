"""Every state, cause, refusal and check of a restore has words in both languages."""

from __future__ import annotations

import pytest

from app.model.texts import load_texts
from app.service.restore.order import Cause, Objection
from app.service.restore.record import CHECKS
from app.store.restore_rows import RestoreState

KEYS = (
    *(state.text_key for state in RestoreState),
    *(cause.text_key for cause in Cause),
    *(objection.text_key for objection in Objection),
    *(f"restore.check.{check.value}" for check in CHECKS),
)


@pytest.mark.parametrize("language", ["en", "de"])
def test_nothing_is_without_words(language: str) -> None:
    own = load_texts(language)._texts
    assert [key for key in KEYS if key not in own] == []
