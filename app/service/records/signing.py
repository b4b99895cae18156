"""The key of this installation (Ed25519, RFC 8032), and the seals that it makes.

The private key is made at first use, in a file of the data folder that nobody else may read, and is never written over.
A seal is one line of text: what kind of file it closes, the SHA-256 of the bytes that it covers, the public key and the
signature over all of that. It tells that these bytes were sealed with this key; it tells nothing of the time.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import os
import re
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Final

from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)

from app.errors import SigningKeyError

FILE: Final = "signing-key.pem"
PUBLIC: Final = "hubside-key/1"
SEAL: Final = "hubside-seal/1"
NO_RENDERER: Final = "-"
_SEAL_LINE: Final = re.compile(
    rf"{SEAL} (record|html|pdf) ([a-z]{{2}}|-) ([0-9a-f]{{16}}|-) ([0-9a-f]{{64}})"
    r" ([A-Za-z0-9+/=]{44}) ([A-Za-z0-9+/=]{88})"
)


class Form(Enum):
    """What a seal closes: the canonical JSON of a record, or a file that shows it."""

    RECORD = "record"
    HTML = "html"
    PDF = "pdf"


@dataclass(frozen=True, slots=True)
class PublicKey:
    """The public half: 32 bytes. Whoever has it can check what the other half has sealed."""

    raw: bytes

    @property
    def fingerprint(self) -> str:
        """The first 128 bits of its SHA-256, in eight groups, to be compared by people."""
        digits = hashlib.sha256(self.raw).hexdigest()[:32]
        return " ".join(digits[at : at + 4] for at in range(0, 32, 4))

    @property
    def text(self) -> str:
        """The line to hand out."""
        return f"{PUBLIC} {_base64(self.raw)}"


@dataclass(frozen=True, slots=True)
class Seal:
    """One seal. ``renderer`` names the version of the page that made a file; ``digest`` is SHA-256, hexadecimal."""

    form: Form
    language: str
    renderer: str
    digest: str
    key: PublicKey
    signature: bytes

    @property
    def line(self) -> str:
        """As it stands in a file."""
        return f"{_statement(self.form, self.language, self.renderer, self.digest, self.key)} {_base64(self.signature)}"

    def covers(self, data: bytes) -> bool:
        """True where these are the very bytes, and the seal is one of its key."""
        if hashlib.sha256(data).hexdigest() != self.digest:
            return False
        statement = _statement(self.form, self.language, self.renderer, self.digest, self.key)
        try:
            Ed25519PublicKey.from_public_bytes(self.key.raw).verify(self.signature, statement.encode())
        except (InvalidSignature, ValueError):
            return False
        return True


class SigningKey:
    """The private half, in memory."""

    def __init__(self, private: Ed25519PrivateKey) -> None:
        self._private = private
        self.public = PublicKey(private.public_key().public_bytes_raw())

    @classmethod
    def of(cls, folder: Path) -> SigningKey:
        """The key of a data folder, made where there is none. Waits for the disk. Raises SigningKeyError."""
        path = folder / FILE
        try:
            if not path.exists():
                _make(path)
        except OSError as error:
            raise SigningKeyError(file=str(path), reason=error.strerror or str(error)) from error
        return cls(_private_of(path))

    def seal(self, form: Form, data: bytes, language: str = "-", renderer: str = NO_RENDERER) -> Seal:
        """A seal over ``data``."""
        digest = hashlib.sha256(data).hexdigest()
        signature = self._private.sign(_statement(form, language, renderer, digest, self.public).encode())
        return Seal(form, language, renderer, digest, self.public, signature)


def public_key_of(folder: Path) -> PublicKey | None:
    """The public key of a data folder, or None where it has none yet. Raises SigningKeyError."""
    path = folder / FILE
    return SigningKey(_private_of(path)).public if path.exists() else None


def parse_public_key(text: str) -> PublicKey | None:
    """The key of a line that was handed out; None where it is none."""
    name, _, data = text.strip().partition(" ")
    raw = _unbase64(data)
    return PublicKey(raw) if name == PUBLIC and raw is not None and len(raw) == 32 else None


def parse_seal(line: str) -> Seal | None:
    """The seal of a line; None where it is none, in whatever way."""
    match = _SEAL_LINE.fullmatch(line)
    if match is None:
        return None
    form, language, renderer, digest, key, signature = match.groups()
    raw, signed = _unbase64(key), _unbase64(signature)
    if raw is None or signed is None or len(raw) != 32:
        return None
    return Seal(Form(form), language, renderer, digest, PublicKey(raw), signed)


def _statement(form: Form, language: str, renderer: str, digest: str, key: PublicKey) -> str:
    """What is signed: the seal but for its signature."""
    return f"{SEAL} {form.value} {language} {renderer} {digest} {_base64(key.raw)}"


def _make(path: Path) -> None:
    """A new key, on the disk before its name is. Where another process was first, theirs stays."""
    pem = Ed25519PrivateKey.generate().private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f"{path.name}.{os.getpid()}.{os.urandom(4).hex()}")
    descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(pem)
            file.flush()
            os.fsync(file.fileno())
        with suppress(FileExistsError):
            os.link(draft, path)  # unlike a rename, it never replaces a key
    finally:
        draft.unlink()
    _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    if os.name == "nt":  # a folder cannot be opened there
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _private_of(path: Path) -> Ed25519PrivateKey:
    try:
        key = load_pem_private_key(path.read_bytes(), password=None)
    except OSError as error:
        raise SigningKeyError(file=str(path), reason=error.strerror or str(error)) from error
    except (ValueError, TypeError, UnsupportedAlgorithm) as error:
        raise SigningKeyError(file=str(path), reason="it holds no private key") from error
    if not isinstance(key, Ed25519PrivateKey):
        raise SigningKeyError(file=str(path), reason="its key is not of the kind Ed25519")
    return key


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def _unbase64(text: str) -> bytes | None:
    """Decoded; None unless it is the one way to write these bytes, so that no changed digit goes unseen."""
    try:
        data = base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError):
        return None
    return data if _base64(data) == text else None
