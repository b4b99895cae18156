"""Signs: what a person looks for when an axis has tripped, found in the records of the decoder. Pure and streaming."""

from app.wire.signs.finder import SignFinder
from app.wire.signs.sign import Sign, SignKind, folded

__all__ = ["Sign", "SignFinder", "SignKind", "folded"]
