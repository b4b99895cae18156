"""The first look reads everything, and what the screens show before the rest."""

from __future__ import annotations

import pytest

from app.model.description_file import load_builtin
from app.service.as_found import in_order
from app.service.backup import readable
from app.service.polling import usual_list


@pytest.mark.parametrize("name", ["oat-pmm", "oat-pmc"])
def test_all_is_read_and_what_the_screens_show_comes_first(name: str) -> None:
    description = load_builtin(name)
    order, shown = in_order(description), usual_list(description)
    assert sorted(order) == sorted(readable(description))
    first = order[: len(shown)]
    assert set(first) <= shown.keys()
    assert len(first) > 10
