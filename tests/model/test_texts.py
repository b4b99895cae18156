"""The catalogue: both languages complete, the same placeholders, and no error or event without words."""

from __future__ import annotations

import re
import string
from collections.abc import Iterator
from pathlib import Path

import pytest

from app import errors
from app.errors import HubsideError
from app.model.texts import LANGUAGES, load_texts
from app.service.journal import Kind
from app.wire.events import EventKind

APP = Path(__file__).resolve().parents[2] / "app"
_SAID = re.compile(r"""\.(?:say|progress|texts)\(\s*"([a-z_.]+)\"""")


def all_errors(kind: type[HubsideError] = HubsideError) -> Iterator[type[HubsideError]]:
    yield kind
    for child in kind.__subclasses__():
        yield from all_errors(child)


def placeholders(text: str) -> set[str]:
    return {name for _, name, _, _ in string.Formatter().parse(text) if name}


def test_every_key_stands_in_every_language() -> None:
    english, german = (set(load_texts(language)._texts) for language in LANGUAGES)
    own = {key for key in german if not key.startswith("name.")}
    assert english - german == set(), "no German text"
    assert own - english == set(), "no English text"


def test_placeholders_are_the_same_in_every_language() -> None:
    english, german = (load_texts(language) for language in LANGUAGES)
    for key in english._texts:
        assert placeholders(english._texts[key]) == placeholders(german._texts[key]), key


@pytest.mark.parametrize("kind", tuple(all_errors()), ids=lambda kind: kind.__name__)
def test_every_error_has_words_and_its_exit_code(kind: type[HubsideError]) -> None:
    assert f"error.{kind.code}" in load_texts("en").flat
    assert kind.__name__ in (errors.__doc__ or "") or kind.__module__ != "app.errors"
    assert kind.exit_code in (1, 2, 3, 4, 5, 6)


@pytest.mark.parametrize("key", [*(f"journal.{k.value}" for k in Kind), *(k.text_key for k in EventKind)])
def test_every_event_has_words(key: str) -> None:
    assert key in load_texts("de").flat


def test_what_the_command_line_says_is_in_the_catalogue() -> None:
    found = {key for path in (APP / "cli").glob("*.py") for key in _SAID.findall(path.read_text(encoding="utf-8"))}
    assert len(found) > 10
    assert found - set(load_texts("en").flat) == set()


def test_a_missing_detail_is_a_dash_and_a_missing_key_is_seen() -> None:
    texts = load_texts("en")
    assert "–" in texts("error.limit", address="1")
    assert texts("no.such.key") == "no.such.key"
    assert load_texts("fr")("error.usage", reason="x") == "x", "other languages get English"


def test_a_detail_that_is_a_key_is_told_in_words() -> None:
    texts = load_texts("de")
    told = texts("journal.fault_set", fault_key="fault.node_gone.name", target="wtg-07/blade-2/pmc")
    assert told == "Fehler eingebracht: Knoten weg, wtg-07/blade-2/pmc"
