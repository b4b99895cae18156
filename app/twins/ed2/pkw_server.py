"""PKW: answers to jobs on single parameters, one at a time (ED2 manual, 4.6 and 4.7).

A job is taken up when another one than before stands in the telegram, and its answer stands from then on as long as the
job does; a read goes on telling the present value. Until a job is done the answer before it stands, which is why a
master puts AK 0 between two jobs. OPEN how long a job takes, and what a repeated one without AK 0 does: some
milliseconds, and nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from app.model.address import Address, Addressing
from app.twins.object_store import Deferred, ObjectStore, RefusedAccessError
from app.wire.profibus import pkw
from app.wire.profibus.fields import FormatError
from app.wire.profibus.pkw import AskKind, PkwAnswer, PkwError, PkwRequest, ReplyKind
from app.wire.sdo import Abort

JOB_NS: Final = 5_000_000
"""What a job takes (assumed)."""
_NOTHING: Final = PkwAnswer(ReplyKind.NOTHING)
_REPLIES: Final = {1: ReplyKind.BYTE, 2: ReplyKind.WORD, 4: ReplyKind.DOUBLE}
_CODES: Final = {
    # OPEN the code for a wrong IND; the parameter is as unknown as with a wrong PNU.
    Abort.NO_OBJECT: PkwError.UNKNOWN_PNU,
    Abort.NO_SUB_INDEX: PkwError.UNKNOWN_PNU,
    Abort.READ_ONLY: PkwError.NOT_CHANGEABLE,
    # OPEN the code for what cannot be changed in this state; the manual says that it is refused.
    Abort.DEVICE_STATE: PkwError.NOT_CHANGEABLE,
    Abort.VALUE_RANGE: PkwError.OUT_OF_RANGE,
    Abort.VALUE_TOO_HIGH: PkwError.OUT_OF_RANGE,
    Abort.VALUE_TOO_LOW: PkwError.OUT_OF_RANGE,
    Abort.LENGTH_TOO_HIGH: PkwError.WRONG_LENGTH,
    Abort.LENGTH_TOO_LOW: PkwError.WRONG_LENGTH,
}
ReadMore = Callable[[int], int]
"""Reads a parameter that is asked for with a value; gives the value of the answer. Raises RefusedAccessError."""


class _Work(NamedTuple):
    """A write that takes longer; it ends even where its job has gone from the telegram."""

    due_ns: int
    job: PkwRequest
    finish: Callable[[int], None]


class PkwServer:
    """The channel of one telegram.

    ``special`` are parameters whose read says more than an address; ``written`` is told of every write.
    """

    def __init__(self, store: ObjectStore, special: Mapping[Address, ReadMore], written: Callable[[], None]) -> None:
        self._store = store
        self._special = special
        self._written = written
        self._work: _Work | None = None
        self.reset()

    def reset(self) -> None:
        """Nobody asks any more."""
        self._asked = bytes(pkw.SIZE)
        self._answer = _NOTHING.encode()
        self._job: PkwRequest | None = None
        """What waits to be done."""
        self._due_ns = 0
        self._told: PkwRequest | None = None
        """A read that was answered and still stands."""

    @property
    def answer(self) -> bytes:
        """Eight bytes for the telegram."""
        return self._answer

    def ask(self, t_ns: int, data: bytes) -> None:
        """What stands in the telegram from the master."""
        if data == self._asked:
            return
        self._asked = data
        self._job = self._told = None
        try:
            request = pkw.decode_request(data)
        except FormatError:
            # A number that is reserved, or reserved bits: no code is told for it.
            self._answer = _refusal(Address(data[2], data[1], Addressing.PKW), PkwError.OTHER)
            return
        if request.kind is AskKind.NOTHING:
            self._answer = _NOTHING.encode()
            return
        self._job, self._due_ns = request, t_ns + JOB_NS

    def run_until(self, t_ns: int) -> None:
        """Do what is due, and let a read tell the present."""
        if self._work is not None:
            if t_ns < self._work.due_ns:
                return
            self._end(self._work, t_ns)
        if self._job is not None and t_ns >= self._due_ns:
            job, self._job = self._job, None
            self._do(job, t_ns)
        elif self._told is not None:
            self._answer = self._read(self._told)

    # -- inside ------------------------------------------------------------------------------

    def _do(self, job: PkwRequest, t_ns: int) -> None:
        if job.kind is AskKind.READ:
            self._told = job
            self._answer = self._read(job)
            return
        try:
            deferred = self._write(job)
        except RefusedAccessError as error:
            self._answer = _refusal(job.address, _code_of(error))
            return
        self._written()
        if deferred is None:
            self._answer = _done(job)
        else:
            self._work = _Work(t_ns + deferred.duration_ns, job, deferred.finish)

    def _end(self, work: _Work, t_ns: int) -> None:
        self._work = None
        try:
            work.finish(t_ns)
        except RefusedAccessError as error:
            answer = _refusal(work.job.address, _code_of(error))
        else:
            answer = _done(work.job)
        if self._asked == work.job.encode():
            self._answer = answer

    def _write(self, job: PkwRequest) -> Deferred | None:
        assert job.data is not None  # the caller has looked
        return self._store.write(job.address, job.data)

    def _read(self, job: PkwRequest) -> bytes:
        try:
            more = self._special.get(job.address)
            if more is not None:
                return PkwAnswer(ReplyKind.WORD, job.address, more(job.value)).encode()
            data = self._store.read(job.address)
        except RefusedAccessError as error:
            return _refusal(job.address, _code_of(error))
        return PkwAnswer(_REPLIES[len(data)], job.address, int.from_bytes(data, "little")).encode()


def _done(job: PkwRequest) -> bytes:
    data = job.data
    assert data is not None  # only writes end so
    return PkwAnswer(_REPLIES[len(data)], job.address, int.from_bytes(data, "little")).encode()


def _refusal(address: Address, code: PkwError) -> bytes:
    return PkwAnswer(ReplyKind.REFUSED, address, code).encode()


def _code_of(error: RefusedAccessError) -> PkwError:
    return _CODES.get(error.code, PkwError.OTHER)
