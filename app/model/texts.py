"""The catalogue of texts for people: one TOML file a language, keys with dots, placeholders in braces."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

from app.errors import HubsideError, ModbusExceptionError, SdoAbortError

LANGUAGES: Final = ("en", "de")


class Texts:
    """Texts of one language, with English behind it and the key itself behind that."""

    def __init__(self, texts: Mapping[str, str], fallback: Mapping[str, str]) -> None:
        self._texts = texts
        self._fallback = fallback

    def __call__(self, key: str, /, **details: Any) -> str:
        """The text of ``key`` with its placeholders filled; a placeholder without a detail becomes a dash.

        A detail ``reason_key`` is the key of a text, which fills ``{reason}``, and whose own placeholders are filled
        likewise.
        """
        filled = _Dashes((name, str(value)) for name, value in details.items())
        words = {
            name.removesuffix("_key"): self._find(str(key)).format_map(filled)
            for name, key in details.items()
            if name.endswith("_key")
        }
        return self._find(key).format_map(_Dashes(words | filled))

    def _find(self, key: str) -> str:
        return self._texts.get(key) or self._fallback.get(key) or key

    def has(self, key: str) -> bool:
        """True where there is a text of ``key``, be it English."""
        return key in self._texts or key in self._fallback

    def name(self, english: str) -> str:
        """Translation of an object's name; the description's own name where there is none."""
        return self._texts.get(f"name.{english}", english)

    @property
    def flat(self) -> Mapping[str, str]:
        """All keys with their texts, English where this language has none."""
        return {**self._fallback, **self._texts}


class _Dashes(dict[str, str]):
    def __missing__(self, key: str) -> str:
        return "–"


def error_text(texts: Texts, error: HubsideError) -> str:
    """The operator's text of an error; abort and exception codes are given in words, the number behind."""
    details = dict(error.details)
    if isinstance(error, ModbusExceptionError):
        details["reason"] = texts(str(details.get("text_key_reason", "modbus.exception.unknown")))
    if isinstance(error, SdoAbortError):
        words = texts(str(details.get("text_key_reason", "abort.unknown")))
        details["reason"] = f"{words} (abort code {error.abort_code:08X}h)"
    return texts(error.text_key, **details)


@cache
def load_texts(language: str) -> Texts:
    """The catalogue of ``en`` or ``de``; any other language gives English."""
    english = _flat("en")
    return Texts(english if language not in LANGUAGES else _flat(language), english)


@cache
def _flat(language: str) -> dict[str, str]:
    path = Path(__file__).resolve().parent.parent / "locales" / f"{language}.toml"
    return dict(_walk(tomllib.loads(path.read_text(encoding="utf-8")), ""))


def _walk(table: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, str]]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _walk(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", str(value)
