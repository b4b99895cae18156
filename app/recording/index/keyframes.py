"""State keyframes as packed bytes: one whole, those after it by what differs from it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import zstandard

_LEVEL: Final = 3
_WHOLE_EACH: Final = 64
_DIFFERS: Final = 0.4
"""A keyframe whose difference takes this share of a whole one makes the next one whole."""


class PackedKeyframe(NamedTuple):
    """A keyframe; ``base_ns`` is the time of the whole one that it is told by, its own where it is whole."""

    t_ns: int
    base_ns: int
    data: bytes


class KeyframePacker:
    """Packs keyframes in order of time."""

    def __init__(self) -> None:
        self._since = 0
        self._base_ns = 0
        self._whole_bytes = 0
        self._packer: zstandard.ZstdCompressor | None = None

    def pack(self, t_ns: int, state: Mapping[str, Any]) -> PackedKeyframe:
        """A keyframe behind all others."""
        text = json.dumps(state, separators=(",", ":")).encode()
        if self._packer is None or self._since >= _WHOLE_EACH:
            self._since, self._base_ns = 1, t_ns
            self._packer = zstandard.ZstdCompressor(level=_LEVEL, write_checksum=True, dict_data=_dictionary(text))
            whole = zstandard.ZstdCompressor(level=_LEVEL, write_checksum=True).compress(text)
            self._whole_bytes = len(whole)
            return PackedKeyframe(t_ns, t_ns, whole)
        packed = self._packer.compress(text)
        if len(packed) > self._whole_bytes * _DIFFERS:
            self._packer = None  # too little in common: from here on the difference is to the next one
        self._since += 1
        return PackedKeyframe(t_ns, self._base_ns, packed)


def unpack_keyframe(data: bytes, whole: bytes | None) -> dict[str, Any]:
    """The state of a keyframe; ``whole`` is the packed keyframe that it is told by, None where it is whole itself.

    Raises ``zstandard.ZstdError`` or ValueError on damaged bytes.
    """
    if whole is None:
        text = zstandard.ZstdDecompressor().decompress(data)
    else:
        base = zstandard.ZstdDecompressor().decompress(whole)
        text = zstandard.ZstdDecompressor(dict_data=_dictionary(base)).decompress(data)
    state: dict[str, Any] = json.loads(text)
    return state


def _dictionary(text: bytes) -> zstandard.ZstdCompressionDict:
    return zstandard.ZstdCompressionDict(text, dict_type=zstandard.DICT_TYPE_RAWCONTENT)
