"""Where the page is served: the loopback address by itself, any other only by TLS and with users."""

from __future__ import annotations

import re
import ssl
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv6Address, ip_address
from pathlib import Path
from typing import Final

from app.errors import UsageError
from app.web.guard import LOOPBACK_NAMES, Reach

Ip = IPv4Address | IPv6Address
LOOPBACK: Final = IPv4Address("127.0.0.1")
_LISTEN: Final = re.compile(
    r"(?:\[(?P<six>[^\]]+)\]|(?P<other>[^:\[\]]+))(?::(?P<port>[0-9]{1,5}))?\Z|(?P<bare_six>[^\[\]]*:[^\[\]]*:[^\[\]]*)\Z"
)


@dataclass(frozen=True, slots=True)
class Tls:
    """Certificate (with its chain) and private key, as PEM files."""

    certificate: Path
    key: Path

    def check(self) -> None:
        """Raises UsageError where the two cannot be read or do not belong together."""
        for file in (self.certificate, self.key):
            if not file.is_file():
                raise UsageError(reason=f"{file}: there is no such file")
        try:
            ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(self.certificate, self.key, _no_password)
        except (ssl.SSLError, OSError, ValueError) as error:
            text = getattr(error, "reason", None) or getattr(error, "strerror", None) or str(error)
            raise UsageError(reason=f"{self.certificate} with {self.key}: {text}") from error


@dataclass(frozen=True, slots=True)
class Listen:
    """An address and a port (0: any free one), and ``names`` under which browsers reach it besides."""

    address: Ip = LOOPBACK
    port: int = 0
    tls: Tls | None = None
    names: tuple[str, ...] = ()

    def check(self, users: bool) -> None:
        """Raises UsageError where it is not safe: in the open only with TLS and with ``users``, under known names."""
        if self.tls is not None:
            self.tls.check()
        if self.address.is_loopback:
            return
        if self.tls is None:
            raise UsageError(reason=f"on {self.address} the page is served by TLS only: name --tls-cert and --tls-key")
        if not users:
            raise UsageError(
                reason=f"on {self.address} one must log in, and there are no users: make one with 'hubside users add'"
            )
        if self.address.is_unspecified and not self.names:
            raise UsageError(reason=f"{self.address} is every address: name those that browsers use with --host")

    def reach(self, port: int) -> Reach:
        """Under which names the server is reached on ``port``."""
        own = () if self.address.is_unspecified else (host_of(self.address),)
        usual = LOOPBACK_NAMES if self.address.is_loopback or self.address.is_unspecified else ()
        return Reach.of((*own, *usual, *(name.lower() for name in self.names)), port, self.tls is not None)

    def url(self, port: int) -> str:
        """The address of the page, without a token."""
        scheme = "http" if self.tls is None else "https"
        name = self.names[0] if self.names else host_of(self.address)
        return f"{scheme}://{name}:{port}/"


def parse_listen(text: str, port: int) -> tuple[Ip, int]:
    """Read ``192.0.2.7``, ``192.0.2.7:8600``, ``[::1]:8600`` or ``localhost``; ``port`` where none is named.

    Raises UsageError.
    """
    match = _LISTEN.match(text)
    if match is None:
        raise _no_address(text)
    host, named = match["six"] or match["bare_six"] or match["other"], match["port"]
    try:
        address = LOOPBACK if host == "localhost" else ip_address(host)
    except ValueError as error:
        raise _no_address(text) from error
    if named is not None and int(named) > 65535:
        raise _no_address(text)
    return address, port if named is None else int(named)


def host_of(address: Ip) -> str:
    """An address as it stands in a URL and a Host header."""
    return f"[{address}]" if isinstance(address, IPv6Address) else str(address)


def _no_address(text: str) -> UsageError:
    return UsageError(reason=f"'{text}' is no address to listen on (examples: 192.0.2.7, 192.0.2.7:8600, [::1]:8600)")


def _no_password() -> str:
    raise ValueError("the key is encrypted; a server that starts by itself cannot ask for its password")
