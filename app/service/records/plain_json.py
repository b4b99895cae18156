"""Frozen dataclasses to plain JSON and back, by their own types: nothing is left out, nothing is let in besides."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from types import NoneType, UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

T = TypeVar("T")


class RecordShapeError(ValueError):
    """JSON that is no record, or of another shape. Its text is the reason."""


def canonical(data: Any) -> str:
    """Canonical JSON: keys sorted, no blanks, non-ASCII as it is."""
    return json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def parsed(text: str) -> Any:
    """Read JSON. Raises RecordShapeError; NaN, infinities and a key twice are refused too."""
    try:
        return json.loads(text, parse_constant=_no_constant, object_pairs_hook=_no_double)
    except RecordShapeError:
        raise
    except (ValueError, RecursionError) as error:
        raise RecordShapeError(f"no valid JSON: {error}") from error


def to_plain(item: Any) -> Any:
    """What JSON carries of ``item``: dataclasses become objects, enums their values, bytes ``{"hex": …}``.

    A real number that JSON has no word for becomes ``{"real": "nan"}``.
    """
    if item is None or (isinstance(item, bool | int | str) and not isinstance(item, Enum)):
        return item
    if is_dataclass(item):
        return {one.name: to_plain(getattr(item, one.name)) for one in fields(item)}
    if isinstance(item, Enum):
        return item.value
    if isinstance(item, bytes):
        return {"hex": item.hex()}
    if isinstance(item, float):
        return item if math.isfinite(item) else {"real": repr(item)}
    if isinstance(item, Mapping):
        return {str(key): to_plain(one) for key, one in item.items()}
    if isinstance(item, tuple | list):
        return [to_plain(one) for one in item]
    raise TypeError(f"{type(item).__name__} has no place in a record")


def from_plain(kind: type[T], data: Any) -> T:
    """The dataclass ``kind`` of what ``to_plain`` gave. Raises RecordShapeError, which names the part."""
    item: T = _read(kind, data, kind.__name__)
    return item


def _read(kind: Any, data: Any, where: str) -> Any:
    if isinstance(kind, type) and is_dataclass(kind):
        return _read_dataclass(kind, data, where)
    origin = get_origin(kind)
    if origin is tuple:
        if not isinstance(data, list):
            raise RecordShapeError(f"{where} is no list")
        return tuple(_read(get_args(kind)[0], one, f"{where}[{n}]") for n, one in enumerate(data))
    if origin is not None and isinstance(origin, type) and issubclass(origin, Mapping):
        if not isinstance(data, dict):
            raise RecordShapeError(f"{where} is no object")
        return {key: _read(get_args(kind)[1], one, f"{where}.{key}") for key, one in data.items()}
    if origin in (Union, UnionType):
        return _read_one_of(get_args(kind), data, where)
    if isinstance(kind, type) and issubclass(kind, Enum):
        try:
            return kind(data)
        except ValueError as error:
            raise RecordShapeError(f"{where}: {data!r} is none of {[one.value for one in kind]}") from error
    return _read_simple(kind, data, where)


def _read_dataclass(kind: Any, data: Any, where: str) -> Any:
    types = _types(kind)
    if not isinstance(data, dict):
        raise RecordShapeError(f"{where} is no object")
    if set(data) != set(types):
        wrong = sorted(set(data) ^ set(types))
        raise RecordShapeError(f"{where} lacks or has besides: {', '.join(map(str, wrong))}")
    return kind(**{name: _read(types[name], data[name], f"{where}.{name}") for name in types})


def _read_one_of(kinds: tuple[Any, ...], data: Any, where: str) -> Any:
    if data is None and NoneType in kinds:
        return None
    for kind in kinds:
        if kind is NoneType:
            continue
        try:
            return _read(kind, data, where)
        except RecordShapeError:
            if len([one for one in kinds if one is not NoneType]) == 1:
                raise
    raise RecordShapeError(f"{where}: {data!r} is of another type")


def _read_simple(kind: Any, data: Any, where: str) -> Any:
    if kind is bytes or (kind is float and isinstance(data, dict)):
        return _packed(kind, data, where)
    if type(data) is kind:
        return data
    raise RecordShapeError(f"{where}: {data!r} is no {getattr(kind, '__name__', kind)}")


def _packed(kind: Any, data: Any, where: str) -> Any:
    word: str = "hex" if kind is bytes else "real"
    unpack: Callable[[str], Any] = bytes.fromhex if kind is bytes else float
    if not isinstance(data, dict) or set(data) != {word} or not isinstance(data[word], str):
        raise RecordShapeError(f"{where}: {data!r} is no {kind.__name__}")
    try:
        return unpack(data[word])
    except ValueError as error:
        raise RecordShapeError(f"{where}: {error}") from error


@cache
def _types(kind: type) -> dict[str, Any]:
    hints = get_type_hints(kind)
    return {one.name: hints[one.name] for one in fields(kind)}


def _no_constant(word: str) -> Any:
    raise RecordShapeError(f"{word} is no number")


def _no_double(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    content = dict(pairs)
    if len(content) != len(pairs):
        raise RecordShapeError("a key stands there twice")
    return content
