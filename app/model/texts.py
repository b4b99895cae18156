"""The catalogue of texts for people: one TOML file a language, keys with dots, placeholders in braces."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

from app.errors import HubsideError, ModbusExceptionError, PkwRefusedError, SdoAbortError

LANGUAGES: Final = ("en", "de")


class Texts:
    """Texts of one language, with English behind it and the key itself behind that."""

    def __init__(self, texts: Mapping[str, str], fallback: Mapping[str, str]) -> None:
        self._texts = texts
        self._fallback = fallback

    def __call__(self, key: str, /, **details: Any) -> str:
        """The text of ``key`` with its placeholders filled; a placeholder without a detail becomes a dash.

        A detail ``reason_key`` is the key of a text, which fills ``{reason}``; a detail ``seen_keys`` holds several,
        which fill ``{seen}``. Placeholders of such a text are filled likewise, its own name by the plain detail.
        """
        plain = {name: str(value) for name, value in details.items() if value is not None}
        keys = {name: found for one, value in details.items() for name, found in _keys(one, value)}
        words = {name: self._joined(found, plain) for name, found in keys.items()}
        words = {
            name: self._joined(found, plain | {other: text for other, text in words.items() if other != name})
            for name, found in keys.items()
        }
        return self._find(key).format_map(_Dashes(plain | words))

    def _joined(self, keys: Iterable[str], details: Mapping[str, str]) -> str:
        return ", ".join(self._find(key).format_map(_Dashes(details)) for key in keys)

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


def _keys(name: str, value: Any) -> Iterator[tuple[str, tuple[str, ...]]]:
    """The placeholder that a detail fills by texts, and their keys."""
    if name.endswith("_key"):
        yield name.removesuffix("_key"), (str(value),)
    elif name.endswith("_keys") and isinstance(value, list | tuple) and value:
        yield name.removesuffix("_keys"), tuple(str(one) for one in value)


class _Dashes(dict[str, str]):
    def __missing__(self, key: str) -> str:
        return "–"


def error_text(texts: Texts, error: HubsideError) -> str:
    """The operator's text of an error; codes of devices are given in words, the number behind."""
    details = dict(error.details)
    if isinstance(error, ModbusExceptionError):
        details["reason"] = texts(str(details.get("text_key_reason", "modbus.exception.unknown")))
    if isinstance(error, PkwRefusedError):
        words = texts(str(details.get("text_key_reason", "profibus.pkw.unknown")))
        details["reason"] = f"{words} (code {details.get('pkw_code')})"
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
