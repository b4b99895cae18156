"""What one PROFIBUS telegram says, beside the records that the decoder makes of it."""

from __future__ import annotations

from typing import NamedTuple

from app.wire.profibus.dp import Refused, Service, ServiceAnswer
from app.wire.profibus.pkw import PkwAnswer, PkwRequest
from app.wire.profibus.telegrams import Signal

SignalValue = tuple[Signal, int]


class FdlTold(NamedTuple):
    """Addresses, access points, the service, and what Data_Exchange carries.

    ``source`` and ``destination`` of SC, which names neither, are those of the request that it answers; None where
    there is none. ``service`` is that of the request, also in an answer; ``answer`` is what an answer says.
    ``has_pkw``: the first eight bytes are PKW; ``pkw`` is a job that is new there, or the answer that ended one.
    ``signals`` are the process data behind it as far as their order is proven; ``process_data`` are their bytes.
    """

    source: int | None = None
    destination: int | None = None
    dsap: int | None = None
    ssap: int | None = None
    service: Service | None = None
    answer: ServiceAnswer | None = None
    has_pkw: bool = False
    pkw: PkwRequest | PkwAnswer | None = None
    signals: tuple[SignalValue, ...] = ()
    process_data: bytes = b""

    @property
    def is_refusal(self) -> bool:
        """The station did not take what it was asked."""
        return isinstance(self.answer, Refused)
