"""Cause and first aid of every error code of our devices: complete, true to the descriptions, and safe to follow."""

from __future__ import annotations

import re
import string
from collections.abc import Iterator

import pytest

from app.model.description import Description, ErrorCode
from app.model.description_file import BUILTIN, load_builtin
from app.model.od_export import description_dict
from app.model.texts import LANGUAGES, load_texts

DEVICES = ("oat-pmm", "oat-pmc", "nanotec-pd4e", "wandfluh-ed2")
_OBJECT = re.compile(r"\b(?:[0-9A-F]{4}h|[0-9A-F]{4}:[0-9A-F]{2})\b")
_HANDS_ON = re.compile(
    r"\b(check|measure|tighten|unplug|clean|replace|exchange)\b[^;:.]*"
    r"\b(X\d+|cables?|clamps?|plugs?|fuses?|brush(es)?|resistors?|fans?|heaters?|wires?|pinion|brake)\b",
    re.IGNORECASE,
)
_SAFE = {
    "en": (r"switch(ed)? off|\boff\b", r"secured?\b", r"\bdead\b|discharged"),
    "de": (r"abgeschalt|abschalten", r"sichern|gesichert", r"spannungsfrei|entladen"),
}


def errors_of(device: str) -> list[ErrorCode]:
    return [error for error in load_builtin(device).errors.values() if error.name != "no_error"]


CASES = [
    pytest.param(device, error, id=f"{device} {error.code:04X}") for device in DEVICES for error in errors_of(device)
]


def told(language: str, key: str, error: ErrorCode) -> str:
    return load_texts(language)(key, number=error.number)


def steps(language: str, error: ErrorCode) -> list[str]:
    return told(language, error.first_aid_key, error).split("\n")


def test_there_are_all_codes() -> None:
    assert [len(errors_of(device)) for device in DEVICES] == [50, 25, 15, 22], "3220h of the PMM comes from 4.2.2.2"


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize(("device", "error"), CASES)
def test_every_error_has_one_sentence_of_cause_and_two_to_four_steps(
    device: str, error: ErrorCode, language: str
) -> None:
    own = load_texts(language)._texts
    assert own.get(error.cause_key), f"no cause of {device} {error.code:04X}"
    assert own.get(error.first_aid_key), f"no first aid for {device} {error.code:04X}"
    assert 2 <= len(steps(language, error)) <= 4
    for sentence in (told(language, error.cause_key, error), *steps(language, error)):
        assert sentence == sentence.strip()
        assert sentence.endswith((".", "?")), sentence
        assert ". " not in sentence, f"more than one sentence: {sentence}"
        assert "–" not in sentence, f"a placeholder is not filled: {sentence}"


@pytest.mark.parametrize(("device", "error"), CASES)
def test_objects_exist_and_are_the_same_in_both_languages(device: str, error: ErrorCode) -> None:
    found = {
        language: [
            sorted(_OBJECT.findall(text)) for text in (told(language, error.cause_key, error), *steps(language, error))
        ]
        for language in LANGUAGES
    }
    assert found["en"] == found["de"]
    known = {address.short for one in DEVICES for address in load_builtin(one).entries}
    assert {name.removesuffix("h") for names in found["en"] for name in names} <= known


@pytest.mark.parametrize(("device", "error"), CASES)
def test_hands_go_in_only_after_it_is_off_secured_and_discharged(device: str, error: ErrorCode) -> None:
    english = steps("en", error)
    for at, step in enumerate(english):
        if not _HANDS_ON.search(step):
            continue
        for language in LANGUAGES:
            so_far = " ".join(steps(language, error)[: at + 1])
            for needed in _SAFE[language]:
                assert re.search(needed, so_far), f"{language}: {step}"


def test_the_search_for_hands_on_steps_finds_some() -> None:
    found = {
        error.name
        for device in DEVICES
        for error in errors_of(device)
        if any(map(_HANDS_ON.search, steps("en", error)))
    }
    assert len(found) > 25
    assert {"motor_short_circuit", "mains_phase_error", "fault_input_1", "can_bus_off"} <= found


@pytest.mark.parametrize("language", LANGUAGES)
def test_nobody_is_asked_to_defeat_a_protection(language: str) -> None:
    bridged = re.compile(r"\bbridge\b|überbrück|jumper|disable the|deaktivier", re.IGNORECASE)
    found = [
        step
        for device in DEVICES
        for error in errors_of(device)
        for step in steps(language, error)
        if bridged.search(step)
    ]
    assert found, "the fault inputs say it"
    assert all(re.search(r"never bridge|nie überbrücken", step) for step in found)


def test_a_family_shares_its_texts_and_names_the_member() -> None:
    pmm = load_builtin("oat-pmm")
    third, eighth = pmm.errors[0x3283], pmm.errors[0xFFF8]
    assert (third.cause_key, third.number) == ("error_cause.battery_bloc_low", 3)
    assert "3061:03" in told("en", third.cause_key, third)
    assert "3300:08" in told("de", eighth.first_aid_key, eighth)


def test_units_that_mean_something_else_by_a_name_have_their_own_texts() -> None:
    pmm, pmc = (load_builtin(device).errors for device in DEVICES[:2])
    for code, of_pmm, of_pmc in (
        (0x3220, "30FA:03", "6510:04"),
        (0x4210, "3111:02", "6510:02"),
        (0x6010, "PMM", "PMC"),
    ):
        assert of_pmm in told("en", pmm[code].cause_key, pmm[code])
        assert of_pmc in told("en", pmc[code].cause_key, pmc[code])


@pytest.mark.parametrize(("device", "code", "limit"), [
    ("oat-pmm", 0x2210, "8 A"),
    ("oat-pmm", 0x5112, "18 V"),
    ("oat-pmm", 0x5100, "28 V"),
    ("oat-pmm", 0x3120, "no threshold"),
    ("oat-pmm", 0x3280, "no threshold"),
    ("oat-pmc", 0x2310, "no threshold"),
    ("oat-pmc", 0x8611, "6066h"),
    ("oat-pmc", 0x8620, "6865h"),
])  # fmt: skip
def test_the_limit_is_that_of_the_manual_or_it_says_that_there_is_none(device: str, code: int, limit: str) -> None:
    error = load_builtin(device).errors[code]
    assert limit in told("en", error.cause_key, error)


def test_no_text_is_left_over() -> None:
    used = {key for device in BUILTIN for error in load_builtin(device).errors.values() for key in keys_of(error)}
    there = {key for key in load_texts("en")._texts if key.startswith(("error_cause.", "first_aid."))}
    assert there <= used


def keys_of(error: ErrorCode) -> Iterator[str]:
    yield error.cause_key
    yield error.first_aid_key


def test_only_the_number_is_filled_in() -> None:
    for device in DEVICES:
        for error in errors_of(device):
            for key in keys_of(error):
                names = {name for _, name, _, _ in string.Formatter().parse(load_texts("en")._texts[key]) if name}
                assert names <= ({"number"} if error.number is not None else set()), key


@pytest.mark.parametrize("device", DEVICES)
def test_the_document_names_the_texts(device: str) -> None:
    description: Description = load_builtin(device)
    for error in description_dict(description)["errors"]:
        told_of = description.errors[error["code"]]
        if error["name"] == "no_error":
            assert (error["cause_key"], error["first_aid_key"], error["number"]) == (None, None, None)
        else:
            assert (error["cause_key"], error["first_aid_key"]) == (told_of.cause_key, told_of.first_aid_key)
            assert error["number"] == told_of.number
