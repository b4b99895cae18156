"""The types of the trace: what a page asks, pages of rows, tables of the bus, and the socket's topic ``trace``."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.service.trace.query import TraceQuery

Words = Annotated[str, Field(max_length=200)]


class TraceFilter(BaseModel):
    """Empty means any; all that is given must hold. ``id`` comes back with each answer.

    ``ids``: identifiers and ranges in hexadecimal (``18B, 580-5FF``); ``data``: a pattern of bytes (``4? ?? 60``,
    ``* 64 60``); ``q``: part of an object's name or address, or of what a row says, in any language.
    """

    model_config = ConfigDict(extra="forbid")

    id: int = 0
    nodes: Annotated[list[int], Field(max_length=128)] = []
    services: Annotated[list[Words], Field(max_length=32)] = []
    buses: Annotated[list[Words], Field(max_length=16)] = []
    direction: Literal["rx", "tx"] | None = None
    ids: Words = ""
    data: Words = ""
    q: Words = ""
    errors: bool = False
    from_t_ns: int | None = None
    to_t_ns: int | None = None

    def query(self) -> TraceQuery:
        """As the use case takes it; times as they stand on the wire, not as a browser rounds them."""
        plain = self.model_dump()
        for name in ("nodes", "services", "buses"):
            plain[name] = tuple(plain[name])
        for name in ("from_t_ns", "to_t_ns"):
            plain[name] = None if plain[name] is None else exact_ns(plain[name])
        return TraceQuery(**plain)


def exact_ns(t_ns: int) -> int:
    """The time stamp that a browser means: its numbers have 53 bits, and time stamps are made to fit them."""
    return int(float(t_ns))
