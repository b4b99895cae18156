"""docs/rules.md is what the rules and their texts say."""

from __future__ import annotations

from pathlib import Path

from app.model.rules.all_rules import ALL
from app.model.rules.listing import to_markdown
from app.model.texts import load_texts

PAGE = Path(__file__).resolve().parent.parent / "docs" / "rules.md"


def test_the_page_of_the_rules_is_up_to_date() -> None:
    assert PAGE.read_text(encoding="utf-8") == to_markdown(ALL, load_texts("en")), "run 'make generate'"


def test_every_rule_has_its_chapter_and_the_table_leads_there() -> None:
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    for rule in ALL:
        assert f"## {rule.id}" in lines
        assert any(f"(#{rule.id.replace('.', '')})" in line for line in lines)
