"""Everything that a description shows to people has a text in every language."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import app
from app.model.description import Description
from app.model.description_file import BUILTIN, load_builtin

LOCALES = Path(app.__file__).parent / "locales"


def keys_of(table: dict[str, Any], prefix: str = "") -> Iterator[str]:
    for key, value in table.items():
        if isinstance(value, dict):
            yield from keys_of(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}"


def catalogue(language: str) -> set[str]:
    return set(keys_of(tomllib.loads((LOCALES / f"{language}.toml").read_text(encoding="utf-8"))))


def shown(description: Description) -> Iterator[str]:
    yield from (f"group.{group}" for group in description.groups)
    for table in description.bit_tables.values():
        yield from (bit.text_key for bit in table.bits)
    for enumeration in description.enumerations.values():
        yield from (value.text_key for value in enumeration.values)
    for error in description.errors.values():
        yield error.text_key
        if error.reaction:
            yield f"reaction.{error.reaction}"
    yield from (entry.note for entry in description if entry.note is not None)


@pytest.mark.parametrize("language", ["en", "de"])
@pytest.mark.parametrize("device", BUILTIN)
def test_every_text_of_a_description_exists(device: str, language: str) -> None:
    assert set(shown(load_builtin(device))) - catalogue(language) == set()


@pytest.mark.parametrize("device", BUILTIN)
def test_every_object_name_has_a_german_one(device: str) -> None:
    german = catalogue("de")
    names = {name for entry in load_builtin(device) for name in (entry.name, entry.object_name)}
    numbered = {name for name in names if re.fullmatch(r"#\d+", name)}
    assert {name for name in names - numbered if f"name.{name}" not in german} == set()
