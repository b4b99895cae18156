"""The desk as every page sees it: who has the lease, what is prepared, what is under way, how the last motion ended."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.service.motion.desk import MotionDesk

_SECOND_NS: Final = 1_000_000_000


@dataclass(frozen=True, slots=True)
class LeaseLine:
    """Who has the lease, or asks for it; at ``until_ns`` of t_ns, to a second, it ends, or goes over unanswered."""

    person: str
    page: str
    until_ns: int


@dataclass(frozen=True, slots=True)
class PreparedLine:
    """An axis that may move: so long after our last heartbeat it had stopped by itself; None where it does not."""

    device: str
    proof_ms: int | None


@dataclass(frozen=True, slots=True)
class RunningLine:
    """What is under way; ``doing`` is the end of a text key."""

    device: str
    doing: str


@dataclass(frozen=True, slots=True)
class EndedLine:
    """The last motion and why it ended; ``error`` is the code of what failed, None where nothing did."""

    device: str
    doing: str
    why: str
    error: str | None


@dataclass(frozen=True, slots=True)
class MotionLine:
    """``available`` False: nothing is connected that could move, or this is a recording.

    ``refused``: the page whose wish for the lease was refused last. ``external_stops``: devices whose stop by hand an
    expert answers for. ``left``: devices where settings still stand that were changed for motion, by a server that was
    killed or a bus that was lost.
    """

    available: bool
    holder: LeaseLine | None
    wish: LeaseLine | None
    refused: str | None
    rotor_locked: bool
    people_out: bool
    external_stops: tuple[str, ...]
    prepared: tuple[PreparedLine, ...]
    left: tuple[str, ...]
    running: RunningLine | None
    ended: EndedLine | None


NO_MOTION: Final = MotionLine(False, None, None, None, False, False, (), (), (), None, None)


def motion_line(desk: MotionDesk | None) -> MotionLine:
    """The desk as it stands now."""
    if desk is None:
        return NO_MOTION
    holder, wish, running, last = desk.lease.holder, desk.lease.wish, desk.running, desk.last
    return MotionLine(
        available=True,
        holder=None if holder is None else LeaseLine(holder.person, holder.page, _at(desk, holder.until_s)),
        wish=None if wish is None else LeaseLine(wish.person, wish.page, _at(desk, wish.due_s)),
        refused=desk.lease.refused,
        rotor_locked=desk.confirmed.rotor_locked,
        people_out=desk.confirmed.people_out,
        external_stops=tuple(sorted(desk.confirmed.external_stops)),
        prepared=tuple(PreparedLine(slug, axis.proof_ms) for slug, axis in desk.prepared.items() if axis.may_move),
        left=tuple(slug for slug in desk.left.devices if slug not in desk.prepared),
        running=None if running is None else RunningLine(running.slug, running.doing.value),
        ended=None
        if last is None
        else EndedLine(last.slug, last.doing.value, last.why.value, None if last.error is None else last.error.code),
    )


def _at(desk: MotionDesk, s: float) -> int:
    """A time of the monotonic clock as t_ns, to a second: it must not change by being asked for."""
    return (desk.now_ns() + round((s - desk.now_s()) * 1e9) + _SECOND_NS // 2) // _SECOND_NS * _SECOND_NS
