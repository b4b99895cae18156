"""Searching recordings: the signature as JSON and as text, and a search as it stands."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.errors import UsageError
from app.model.address import parse_address
from app.service.analysis.search import query as q
from app.service.analysis.search.parser import MAX_DEPTH, parse_query
from app.service.analysis.search.search import Hit, Search, Unsearched
from app.service.jobs import Job, JobState
from app.web.models.analysis import WordsDoc
from app.wire.signs import SignKind

MS = 1_000_000
_DAY_MS = 86_400_000
Word = Annotated[str, Field(max_length=40)]
Milliseconds = Annotated[float, Field(ge=0, le=_DAY_MS)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid")


class ScopeDoc(_Part):
    """Where: null means anywhere. ``device`` is the last part of a slug: pmm, pmc."""

    blade: Annotated[int | None, Field(ge=0, le=9)] = None
    node: Annotated[int | None, Field(ge=0, le=127)] = None
    device: Word | None = None
    bus: Word | None = None

    def scope(self) -> q.Scope:
        """As the use case takes it."""
        return q.Scope(self.blade, self.node, self.device, self.bus)


class EventPart(_Part):
    """A sign, a trip, any error or any warning. ``code``: of an emergency message; ``ended``: the condition's end."""

    type: Literal["event"] = "event"
    kind: SignKind | q.Special
    code: Annotated[int | None, Field(ge=0, le=0xFFFF)] = None
    scope: ScopeDoc = ScopeDoc()
    ended: bool = False


class LevelPart(_Part):
    """A signal on one side of a number (scaled) for at least ``lasting_ms``; ``amount``: without its sign."""

    type: Literal["level"] = "level"
    object: Word
    comparison: q.Comparison
    number: float
    unit: Word = ""
    lasting_ms: Milliseconds = 0
    amount: bool = False
    scope: ScopeDoc = ScopeDoc()


class PairPart(_Part):
    """Two things in an order, within a time."""

    type: Literal["pair"] = "pair"
    left: QueryPart
    order: q.Order
    right: QueryPart
    within_ms: Milliseconds
    same: q.Same | None = None


class AllPart(_Part):
    """Each of these somewhere in the recording."""

    type: Literal["all"] = "all"
    parts: Annotated[list[QueryPart], Field(min_length=2, max_length=20)]


class AnyPart(_Part):
    """At least one of these."""

    type: Literal["any"] = "any"
    parts: Annotated[list[QueryPart], Field(min_length=2, max_length=20)]


class NotPart(_Part):
    """Nowhere in the recording."""

    type: Literal["not"] = "not"
    part: QueryPart


QueryPart = Annotated[EventPart | LevelPart | PairPart | AllPart | AnyPart | NotPart, Field(discriminator="type")]
for _model in (PairPart, AllPart, AnyPart, NotPart):
    _model.model_rebuild()


def query_of(part: QueryPart, depth: int = 0) -> q.Query:
    """The signature that a JSON body describes. Raises UsageError."""
    if depth > MAX_DEPTH:
        raise UsageError(reason="the signature is nested too deeply")
    if isinstance(part, EventPart):
        return q.EventIs(part.kind, part.code, part.scope.scope(), part.ended)
    if isinstance(part, LevelPart):
        lasting_ns = round(part.lasting_ms * MS)
        where = part.scope.scope()
        address = parse_address(part.object)
        return q.Level(address, part.comparison, part.number, part.unit, lasting_ns, part.amount, where)
    if isinstance(part, PairPart):
        left, right = query_of(part.left, depth + 1), query_of(part.right, depth + 1)
        if isinstance(left, q.Not | q.All) or isinstance(right, q.Not | q.All):
            raise UsageError(reason="'not' and 'all' cannot stand in an order of time")
        return q.Pair(left, part.order, right, round(part.within_ms * MS), part.same)
    if isinstance(part, NotPart):
        return q.Not(query_of(part.part, depth + 1))
    parts = tuple(query_of(one, depth + 1) for one in part.parts)
    return q.All(parts) if isinstance(part, AllPart) else q.Any(parts)


def part_of(query: q.Query) -> QueryPart:
    """The JSON form of a signature."""
    if isinstance(query, q.EventIs):
        return EventPart(kind=query.kind, code=query.code, scope=_scope(query.scope), ended=query.ended)
    if isinstance(query, q.Level):
        return LevelPart(
            object=query.address.short, comparison=query.comparison, number=query.number, unit=query.unit,
            lasting_ms=query.lasting_ns / MS, amount=query.amount, scope=_scope(query.scope),
        )  # fmt: skip
    if isinstance(query, q.Pair):
        left, right = part_of(query.left), part_of(query.right)
        return PairPart(left=left, order=query.order, right=right, within_ms=query.within_ns / MS, same=query.same)
    if isinstance(query, q.Not):
        return NotPart(part=part_of(query.part))
    parts = [part_of(one) for one in query.parts]
    return AllPart(parts=parts) if isinstance(query, q.All) else AnyPart(parts=parts)


def _scope(scope: q.Scope) -> ScopeDoc:
    return ScopeDoc(blade=scope.blade, node=scope.node, device=scope.device, bus=scope.bus)


class SignatureRequest(_Part):
    """A signature, as text or as JSON; exactly one of them."""

    text: Annotated[str | None, Field(max_length=1000)] = None
    query: QueryPart | None = None

    def signature(self) -> q.Query:
        """What is looked for. Raises SignatureError where the text is not understood, and UsageError."""
        if self.text is not None and self.query is None:
            return parse_query(self.text)
        if self.query is not None and self.text is None:
            return query_of(self.query)
        raise UsageError(reason="give the signature as text or as query")


class RecordingSearchRequest(SignatureRequest):
    """What is looked for, and in which recordings of the list; null: in all.

    ``make_indexes``: recordings that have no index get one first, which can take minutes each.
    """

    recordings: Annotated[list[Annotated[str, Field(max_length=250)]] | None, Field(max_length=1000)] = None
    make_indexes: bool = False


class SignatureDoc(BaseModel):
    """A signature as it was understood, in both forms."""

    text: str
    query: QueryPart

    @classmethod
    def of(cls, query: q.Query) -> SignatureDoc:
        """Both forms."""
        return cls(text=str(query), query=part_of(query))


class HitDoc(BaseModel):
    """A place that matches: jump to ``t_ns`` of the recording ``name``; ``from_ns`` to ``to_ns`` is what matched."""

    name: str
    turbine: str
    t_ns: int
    from_ns: int
    to_ns: int
    bus: str | None
    node: int | None
    says: WordsDoc

    @classmethod
    def of(cls, hit: Hit) -> HitDoc:
        """One hit."""
        found = hit.found
        bus, node = found.key or (None, None)
        return cls(
            name=hit.file, turbine=hit.turbine, t_ns=found.t_ns, from_ns=found.from_ns, to_ns=found.to_ns,
            bus=bus, node=node, says=WordsDoc.of(hit.words),
        )  # fmt: skip


class SkippedDoc(BaseModel):
    """A recording that was not looked into; ``text_key`` and ``details`` are of what went wrong, where anything did."""

    name: str
    reason: Unsearched
    reason_key: str
    text_key: str | None
    details: dict[str, Any]


class SignatureSearchDoc(BaseModel):
    """A search as it stands: ``done`` of ``total`` recordings.

    ``hits`` are those from the place ``since`` on that was asked for; ask again with ``hits_total``. ``more``: there
    were more hits than are kept.
    """

    id: str
    state: JobState
    done: int
    total: int
    searched: int
    signature: SignatureDoc
    hits: list[HitDoc]
    hits_total: int
    more: bool
    skipped: list[SkippedDoc]
    text_key: str | None
    details: dict[str, Any]

    @classmethod
    def of(cls, job: Job, search: Search, since: int) -> SignatureSearchDoc:
        """As it stands now."""
        return cls(
            id=job.id,
            state=job.state,
            done=job.done,
            total=job.total,
            searched=search.searched,
            signature=SignatureDoc.of(search.query),
            hits=[HitDoc.of(hit) for hit in search.hits[since:]],
            hits_total=len(search.hits),
            more=search.more,
            skipped=[
                SkippedDoc(
                    name=one.file,
                    reason=one.reason,
                    reason_key=one.reason.text_key,
                    text_key=None if one.error is None else one.error.text_key,
                    details={} if one.error is None else dict(one.error.details),
                )
                for one in search.skipped
            ],
            text_key=None if job.error is None else job.error.text_key,
            details={} if job.error is None else dict(job.error.details),
        )
