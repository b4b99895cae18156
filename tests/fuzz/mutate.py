"""Damage for files: of bytes, of lines, of JSON. Pure: the same chance and seeds give the same file.

What each way does is what happens to files, or what people do to them: cut transfers, flipped bits, editors, wrong
encodings, numbers of other makers, and content that is meant to exhaust its reader.
"""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable, Sequence
from typing import Any, Final

Seeds = Sequence[bytes]
Way = Callable[[random.Random, bytes], bytes]

NUMBERS: Final = (0, 1, 2, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, (1 << 63) - 1, 1 << 63,
                  (1 << 64) - 1)  # fmt: skip
TEXTS: Final = (
    "", "0", "-1", "-0", "00000000000000000001", "9" * 30, "-" + "9" * 400, "1e999", "1e-999", "NaN", "Infinity", "0x",
    "0x" + "F" * 40, "0b1", "08", "1_000", "٣", "²", "½", "1.5.6", "+", "$NODEID", "$NODEID+0xFFFFFFFFFF", "nan",
    "True", "\x00", "\ufeff", "\u2028", "Ä" * 50, "=" * 20, "[", "]", "]]", "[[", ";", "#", "//", "\\", '"', "'", "%s",
    "{}", "\t", "a" * 5000, "(1.0)", "(99999999999999.999999)", "#R9", "##1", "#" + "00" * 65, "18FFFFFFFFF", "800",
    "x" * 300,
)  # fmt: skip
_WORD: Final = re.compile(r"[A-Za-z0-9_.$+-]+")
_LINE: Final = re.compile(rb"(?<=\n)")
_MARKS: Final = (b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff", b"\xff", b"\xc0\x80", b"\xed\xa0\x80", b"\xf5\x80\x80\x80",
                 b"\0", b"\r", b"\n", b"\x85", b"\x0b", b"\x1a", b"\x1c")  # fmt: skip
DEEP: Final = 100_000
LARGEST: Final = 1 << 20


def spliced(chance: random.Random, data: bytes, other: bytes) -> bytes:
    """The beginning of one and the end of the other."""
    return data[: chance.randrange(len(data) + 1)] + other[chance.randrange(len(other) + 1) :]


# Bytes


def _span(chance: random.Random, data: bytes) -> tuple[int, int]:
    start = chance.randrange(len(data) + 1)
    return start, min(len(data), start + int(chance.paretovariate(0.7)))


def _flip(chance: random.Random, data: bytes) -> bytes:
    if not data:
        return data
    at = chance.randrange(len(data))
    return data[:at] + bytes([data[at] ^ 1 << chance.randrange(8)]) + data[at + 1 :]


def _cut_end(chance: random.Random, data: bytes) -> bytes:
    return data[: chance.randrange(len(data) + 1)]


def _drop(chance: random.Random, data: bytes) -> bytes:
    start, end = _span(chance, data)
    return data[:start] + data[end:]


def _repeat(chance: random.Random, data: bytes) -> bytes:
    start, end = _span(chance, data)
    return data[:end] + data[start:end] * chance.randrange(1, 9) + data[end:]


def _overwrite(chance: random.Random, data: bytes) -> bytes:
    start, end = _span(chance, data)
    fill = chance.choice((bytes(end - start), b"\xff" * (end - start), chance.randbytes(min(end - start, 4096))))
    return data[:start] + fill + data[end:]


def _integer(chance: random.Random, data: bytes) -> bytes:
    size = chance.choice((1, 2, 4, 8))
    at = chance.randrange(max(1, len(data) - size + 1))
    number = chance.choice((*NUMBERS, len(data), len(data) - at, chance.getrandbits(16)))
    return data[:at] + (number & (1 << 8 * size) - 1).to_bytes(size, "little") + data[at + size :]


def _insert(chance: random.Random, data: bytes) -> bytes:
    at = chance.randrange(len(data) + 1)
    more = chance.choice((*_MARKS, chance.randbytes(chance.randrange(1, 40))))
    return data[:at] + more + data[at:]


BYTE_WAYS: Final[tuple[Way, ...]] = (_flip, _cut_end, _drop, _repeat, _overwrite, _integer, _insert)


def bytes_changed(chance: random.Random, data: bytes) -> bytes:
    """A few changes of bytes, mostly one."""
    for _ in range(min(6, int(chance.paretovariate(1.0)))):
        data = chance.choice(BYTE_WAYS)(chance, data)[:LARGEST]
    return data


# Lines


def _lines(data: bytes) -> list[bytes]:
    return _LINE.split(data)


def _drop_lines(chance: random.Random, data: bytes) -> bytes:
    lines = _lines(data)
    start, end = _span(chance, bytes(len(lines)))
    return b"".join(lines[:start] + lines[end:])


def _repeat_lines(chance: random.Random, data: bytes) -> bytes:
    lines = _lines(data)
    start, end = _span(chance, bytes(len(lines)))
    return b"".join(lines[:end] + lines[start:end] * chance.randrange(1, 30) + lines[end:])


def _shuffle_lines(chance: random.Random, data: bytes) -> bytes:
    lines = _lines(data)
    first, second = chance.randrange(len(lines)), chance.randrange(len(lines))
    lines[first], lines[second] = lines[second], lines[first]
    return b"".join(lines)


def _join_lines(chance: random.Random, data: bytes) -> bytes:
    lines = _lines(data)
    at = chance.randrange(len(lines))
    lines[at] = lines[at].rstrip(b"\r\n")
    return b"".join(lines)


def _other_word(chance: random.Random, data: bytes) -> bytes:
    """Another word or number in place of one."""
    text = data.decode("utf-8", "surrogateescape")
    at = chance.randrange(len(text) + 1)
    match = _WORD.search(text, at) or _WORD.search(text)
    if match is None:
        return data
    word = chance.choice(
        (*TEXTS, str(chance.choice(NUMBERS)), hex(chance.choice(NUMBERS)), match[0] * 2, match[0][::-1])
    )
    return (text[: match.start()] + word + text[match.end() :]).encode("utf-8", "surrogateescape")


def _words_swapped(chance: random.Random, data: bytes) -> bytes:
    text = data.decode("utf-8", "surrogateescape")
    words = list(_WORD.finditer(text[:20_000]))
    if len(words) < 2:
        return data
    first, second = sorted(chance.sample(range(len(words)), 2))
    a, b = words[first], words[second]
    changed = text[: a.start()] + b[0] + text[a.end() : b.start()] + a[0] + text[b.end() :]
    return changed.encode("utf-8", "surrogateescape")


def _in_another_encoding(chance: random.Random, data: bytes) -> bytes:
    text = data.decode("utf-8", "replace")
    return text.encode(chance.choice(("utf-16", "utf-16-le", "utf-16-be", "utf-8-sig", "cp1252", "latin-1")), "replace")


def _other_line_ends(chance: random.Random, data: bytes) -> bytes:
    return data.replace(b"\r\n", b"\n").replace(b"\n", chance.choice((b"\r", b"\r\n", b"\n\n", b"\x85", b"", b"\n\r")))


def _endless_line(chance: random.Random, data: bytes) -> bytes:
    at = chance.randrange(len(data) + 1)
    return data[:at] + chance.choice((b"a", b"0", b"[", b" ", b"=", b"#", b"\0", b'"')) * DEEP + data[at:]


LINE_WAYS: Final[tuple[Way, ...]] = (
    _drop_lines, _repeat_lines, _shuffle_lines, _join_lines, _other_word, _other_word, _other_word, _words_swapped,
    _in_another_encoding, _other_line_ends,
)  # fmt: skip


def lines_changed(chance: random.Random, data: bytes) -> bytes:
    """A few changes of lines and words; at times an endless line."""
    if chance.random() < 0.005:
        return _endless_line(chance, data)
    for _ in range(min(8, int(chance.paretovariate(0.8)))):
        data = chance.choice(LINE_WAYS)(chance, data)[:LARGEST]
    return data


# JSON


def _paths(node: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    children = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    return [path, *(inner for key, child in children for inner in _paths(child, (*path, key)))]


def _strange(chance: random.Random) -> Any:
    number = chance.choice((*NUMBERS, -1, -(1 << 63), 1 << 80, 10**50, 0.5, -0.0, 1e308, float("nan"), float("inf")))
    text = chance.choice((*TEXTS, "\ud800", "2026-13-45T99:99:99Z"))
    nested: Any = chance.choice(([], {}, [[]], {"": {}}, ["a"] * 50, {"hex": "zz"}, {"hex": "0"}))
    return chance.choice((None, True, False, number, number, text, text, nested))


def _with(tree: Any, path: tuple[Any, ...], change: Callable[[Any, Any], None]) -> Any:
    """``tree``, which is changed at ``path``: ``change`` gets the parent and the key."""
    if not path:
        return tree
    parent = tree
    for key in path[:-1]:
        parent = parent[key]
    change(parent, path[-1])
    return tree


def json_changed(chance: random.Random, data: bytes) -> bytes:
    """Another value, a key less or more, an array in place of an object; at times nested without end."""
    try:
        tree = json.loads(data)
    except ValueError:
        return bytes_changed(chance, data)
    for _ in range(min(6, int(chance.paretovariate(1.0)))):
        path, strange = chance.choice(_paths(tree)), _strange(chance)
        if not path:
            tree = strange if chance.random() < 0.1 else tree
            continue
        way = chance.randrange(4)
        if way == 0:
            tree = _with(tree, path, lambda parent, key: parent.pop(key))
        elif way == 1 and isinstance(path[-1], str):
            name = chance.choice((*TEXTS, path[-1] + "x", path[-1].upper()))
            tree = _with(tree, path, lambda parent, key, name=name: parent.update({name: parent.pop(key)}))  # type: ignore[misc]
        else:
            tree = _with(tree, path, lambda parent, key, new=strange: parent.__setitem__(key, new))  # type: ignore[misc]
    text = json.dumps(tree, ensure_ascii=chance.random() < 0.5, indent=chance.choice((None, 1, 2)))
    return _json_text_changed(chance, text).encode("utf-8", "surrogatepass")[:LARGEST]


def _json_text_changed(chance: random.Random, text: str) -> str:
    """What no tree can be: equal keys, bombs."""
    drawn = chance.random()
    at = chance.randrange(len(text) + 1)
    if drawn < 0.005:
        return text[:at] + chance.choice(("[", '{"a":', "[[", '[{"":')) * DEEP + text[at:]
    if drawn < 0.01:
        return text[:at] + chance.choice(("9" * DEEP, '"' + "a" * DEEP + '"', "-" * DEEP, " " * DEEP)) + text[at:]
    keys = re.findall(r'"[^"]*":', text) if drawn < 0.1 else []
    if keys:
        twice = chance.choice(keys)
        return text.replace(twice, f"{twice} {chance.choice(('0', 'null', '[]'))}, {twice}", 1)
    return text
