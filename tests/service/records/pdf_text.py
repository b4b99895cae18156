"""The text of a PDF as Typst writes them: glyphs of its content streams, read through the fonts' own tables."""

from __future__ import annotations

import re
import zlib

_OBJECT = re.compile(rb"(?:^|\n)(\d+) 0 obj\n(.*?)(?=\nendobj)", re.S)
_FONTS = re.compile(rb"/Font<<([^>]*)>>")
_RESOURCES = re.compile(rb"/Resources (\d+) 0 R")
_CONTENTS = re.compile(rb"/Contents (\d+) 0 R")
_NAMED = re.compile(rb"/(f\d+) (\d+) 0 R")
_GLYPH = re.compile(rb"<([0-9A-F]{4})> <([0-9A-F]+)>")
_FONT = re.compile(rb"/(f\d+) [\d.]+ Tf")
_ACTUAL = re.compile(rb"/ActualText<([0-9A-F]+)>>>BDC.*?EMC", re.S)
_ESCAPED = {b"n": b"\n", b"r": b"\r", b"t": b"\t", b"b": b"\b", b"f": b"\f"}


def pdf_text(data: bytes) -> str:
    """All that is printed, pieces parted by line ends. Each page has its own names of fonts."""
    objects = {int(match[1]): match[2] for match in _OBJECT.finditer(data)}
    told = []
    for one in objects.values():
        resources, contents = _RESOURCES.search(one), _CONTENTS.search(one)
        if resources and contents:
            fonts = _fonts(objects, objects[int(resources[1])])
            if fonts:
                told.append(_lines(_unpacked(objects[int(contents[1])]), fonts))
    return "\n".join(told)


def _fonts(objects: dict[int, bytes], resources: bytes) -> dict[bytes, dict[int, str]]:
    fonts: dict[bytes, dict[int, str]] = {}
    for name, number in _NAMED.findall(b" ".join(_FONTS.findall(resources))):
        unicode = re.search(rb"/ToUnicode (\d+) 0 R", objects[int(number)])
        assert unicode is not None
        table = _unpacked(objects[int(unicode[1])])
        fonts[name] = {
            int(code, 16): bytes.fromhex(text.decode()).decode("utf-16-be") for code, text in _GLYPH.findall(table)
        }
    return fonts


def _lines(stream: bytes, fonts: dict[bytes, dict[int, str]]) -> str:
    text, at = "", 0
    font = fonts[next(iter(fonts))]
    while at < len(stream):
        if match := _FONT.match(stream, at):
            font, at = fonts[match[1]], match.end()
        elif match := _ACTUAL.match(stream, at):  # what stands there, where glyphs alone do not tell
            text, at = text + bytes.fromhex(match[1].decode()).decode("utf-16"), match.end()
        elif stream[at] == ord("("):
            end = _closing(stream, at)
            codes = _literal(stream[at + 1 : end])
            text += "".join(font.get(int.from_bytes(codes[n : n + 2]), "?") for n in range(0, len(codes), 2))
            at = end + 1
        else:
            text, at = text + "\n" * stream.startswith(b"TJ", at), at + 1
    return text


def _closing(stream: bytes, at: int) -> int:
    """Where the string that begins at ``at`` ends: parentheses in it are escaped, or come in pairs."""
    depth = 0
    while True:
        depth += {ord("("): 1, ord(")"): -1}.get(stream[at], 0)
        if depth == 0:
            return at
        at += 2 if stream[at] == ord("\\") else 1


def _literal(escaped: bytes) -> bytes:
    """A string of PDF without its escapes (ISO 32000-1, 7.3.4.2)."""

    def plain(match: re.Match[bytes]) -> bytes:
        code = match[1]
        return bytes([int(code, 8)]) if code.isdigit() else _ESCAPED.get(code, code)

    return re.sub(rb"\\([0-7]{1,3}|.)", plain, escaped, flags=re.S)


def _unpacked(content: bytes) -> bytes:
    return zlib.decompressobj().decompress(content[content.index(b"stream\n") + 7 :])
