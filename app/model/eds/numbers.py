"""Numbers, texts and bytes as an EDS writes them (CiA 306, 4.2): to raw values of the data types.

All functions raise ValueError where a text cannot be read as what it should be.
"""

from __future__ import annotations

import math
import re
import struct
from dataclasses import dataclass
from typing import Final

from app.model.datatypes import DataType, Raw, encode_raw

_LONGEST_NUMBER: Final = 64
_HEX: Final = re.compile(r"([-+]?)(?:0[xX]([0-9A-Fa-f]+)|([0-9][0-9A-Fa-f]*)[hH])", re.ASCII)
_DECIMAL: Final = re.compile(r"[-+]?[0-9]+", re.ASCII)
_OCTAL: Final = re.compile(r"[-+]?0[0-7]+", re.ASCII)
_WHOLE: Final = re.compile(r"([-+]?[0-9]+)\.0*", re.ASCII)
_FLOAT: Final = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]{1,4})?", re.ASCII)
_COMMENT: Final = re.compile(r"(?:^|\s)[;#]")
_NODE_ID: Final = re.compile(r"\$NODE_?ID", re.IGNORECASE | re.ASCII)
_WORDS: Final = {"true": 1, "false": 0, "yes": 1, "no": 0}
_FLOAT_BITS: Final = {DataType.REAL32: (">I", ">f", 32), DataType.REAL64: (">Q", ">d", 64)}


@dataclass(frozen=True, slots=True)
class Parsed:
    """A raw value; where ``node_id``, the node's number is added to it.

    ``oddities`` are the names of the warnings about the way it was written.
    """

    raw: Raw
    node_id: bool = False
    oddities: tuple[str, ...] = ()


def parse_int(text: str) -> int:
    """An integer: decimal, ``0x`` hexadecimal, octal with a leading zero, also ``10h``; a comment behind is cut.

    ``08`` is no octal number and taken as decimal.
    """
    text = bare(text)
    if len(text) > _LONGEST_NUMBER:
        raise ValueError("too many digits")
    if match := _HEX.fullmatch(text):
        number = int(match[2] or match[3], 16)
        return -number if match[1] == "-" else number
    if _OCTAL.fullmatch(text):
        return int(text, 8)
    if _DECIMAL.fullmatch(text):
        return int(text)
    raise ValueError(f"'{text}' is no number")


def is_doubtful_octal(text: str) -> bool:
    """True for ``010``: 8 by the rule, but often meant as 10."""
    text = bare(text)
    return bool(_OCTAL.fullmatch(text)) and int(text, 8) != int(text)


def parse_value(text: str, data_type: DataType) -> Parsed:
    """The raw value of type ``data_type`` that ``text`` says; it always fits the type."""
    parsed = _parse(text, data_type)
    try:
        encode_raw(data_type, parsed.raw)
    except (struct.error, OverflowError) as error:
        raise ValueError(str(error)) from error
    return parsed


def _parse(text: str, data_type: DataType) -> Parsed:
    if data_type.is_integer:
        return _parse_integer(text, data_type)
    if data_type in _FLOAT_BITS:
        return Parsed(_parse_float(text, data_type))
    if data_type in (DataType.VISIBLE_STRING, DataType.UNICODE_STRING):
        return Parsed(_parse_text(text))
    data = _parse_bytes(text)
    if data_type.size is not None and len(data) != data_type.size:
        raise ValueError(f"{data_type.name} has {data_type.size} bytes, not {len(data)}")
    return Parsed(data)


def _parse_integer(text: str, data_type: DataType) -> Parsed:
    text = bare(text)
    oddities: list[str] = []
    rest, found = _NODE_ID.subn("", text, count=1)
    if found:
        if not _in_order(text):
            oddities.append("node_id_order")
        rest = rest.replace(" ", "").strip("+") or "0"
    elif data_type is DataType.BOOLEAN and text.lower() in _WORDS:
        return Parsed(_WORDS[text.lower()])
    if is_doubtful_octal(rest):
        oddities.append("octal")
    if match := _WHOLE.fullmatch(rest):
        oddities.append("fraction")
        rest = match[1]
    number = parse_int(rest)
    folded = _fold(number, data_type)
    if number < 0 and folded >= 0:
        oddities.append("negative")
    return Parsed(folded, bool(found), tuple(oddities))


def _in_order(text: str) -> bool:
    """True where ``$NODEID`` stands first, as CiA 306 has it."""
    return _NODE_ID.match(text) is not None


def _fold(number: int, data_type: DataType) -> int:
    """The same bits read with the type's sign: FFFFh of an INTEGER16 is -1, -1 of an UNSIGNED16 is FFFFh."""
    bits = data_type.bits or 0
    if data_type.is_signed and 1 << bits - 1 <= number < 1 << bits:
        return number - (1 << bits)
    if data_type.name.startswith("UNSIGNED") and -(1 << bits - 1) <= number < 0:
        return number + (1 << bits)
    return number


def _parse_float(text: str, data_type: DataType) -> float:
    text = bare(text)
    if len(text) > _LONGEST_NUMBER:
        raise ValueError("too many digits")
    if _HEX.fullmatch(text):
        as_int, as_float, bits = _FLOAT_BITS[data_type]
        pattern = parse_int(text)
        if not 0 <= pattern < 1 << bits:
            raise ValueError(f"'{text}' has more than {bits} bits")
        number = float(struct.unpack(as_float, struct.pack(as_int, pattern))[0])
    elif _FLOAT.fullmatch(text):
        number = float(text)
    else:
        raise ValueError(f"'{text}' is no number")
    if not math.isfinite(number):
        raise ValueError(f"'{text}' is not finite")
    return number


def _parse_text(text: str) -> str:
    """The text as it stands; quotes around all of it are no part of it."""
    return text[1:-1] if len(text) >= 2 and text[0] == text[-1] == '"' else text


def _parse_bytes(text: str) -> bytes:
    text = bare(text)
    if text[:2] in ("0x", "0X"):
        text = text[2:]
    if not text.isascii():
        raise ValueError("no hexadecimal bytes")
    return bytes.fromhex(text)


def bare(text: str) -> str:
    """The text of a number: without the comment behind it, blanks and quotes."""
    comment = _COMMENT.search(text)
    return text[: comment.start() if comment else None].strip().strip('"').strip()
