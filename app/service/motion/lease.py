"""The lease: one page at a time may move the axes of the connection. Pure; the clock is passed in.

Each grant has a fencing number, higher than all before, also those of an earlier server: a command that bears another
one is old, or of somebody who has lost the lease. A lease ends when it is given back, when it was not used for
``LEASE_S``, or when its page has been unheard of for ``AWAY_S``. Whoever wants it meanwhile asks; the holder hands it
over or keeps it. A holder who does not answer within ``ANSWER_S`` loses it, unless an axis is held in motion.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from app.errors import LeaseError, LeaseHeldError, LeaseNeededError

LEASE_S: Final = 600.0
AWAY_S: Final = 5.0
ANSWER_S: Final = 20.0


@dataclass(frozen=True, slots=True)
class Holder:
    """Who has the lease: ``person`` at ``page``, until ``until_s`` of the monotonic clock unless it is used."""

    person: str
    page: str
    fence: int
    until_s: float


@dataclass(frozen=True, slots=True)
class Wish:
    """Somebody asks for the lease; without an answer it is theirs at ``due_s`` of the monotonic clock."""

    person: str
    page: str
    due_s: float


class Lease:
    """The lease of one connection. ``fence_now`` gives numbers that rise, also over restarts of the server."""

    def __init__(self, monotonic_s: Callable[[], float], fence_now: Callable[[], int]) -> None:
        self._now_s = monotonic_s
        self._fence_now = fence_now
        self._last_fence = 0
        self._heard_s = 0.0
        self.refused: str | None = None
        """The page whose wish the holder has refused last."""
        self.holder: Holder | None = None
        self.wish: Wish | None = None

    def take(self, person: str, page: str) -> Holder:
        """Have the lease, or keep it. Raises LeaseHeldError where another page or another person has it."""
        holder = self.holder
        if holder is not None and (holder.page, holder.person) != (page, person):
            raise LeaseHeldError(holder=holder.person)
        if holder is not None:
            return self._used(holder)
        return self._grant(person, page)

    def ask(self, person: str, page: str) -> Wish | None:
        """Ask the holder for the lease; None where it is free or one's own, and so had at once.

        Raises LeaseHeldError where somebody else is already asking.
        """
        if self.holder is None or (self.holder.page, self.holder.person) == (page, person):
            self.take(person, page)
            return None
        if self.wish is not None and (self.wish.page, self.wish.person) != (page, person):
            raise LeaseHeldError(holder=self.wish.person)
        self.refused = None
        if self.wish is None:
            self.wish = Wish(person, page, self._now_s() + ANSWER_S)
        return self.wish

    def withdraw(self, page: str) -> None:
        """Whoever asked does not want it any more."""
        if self.wish is not None and self.wish.page == page:
            self.wish = None

    def answer(self, fence: int, hand_over: bool) -> None:
        """The holder's answer to who asks. Raises LeaseNeededError, LeaseError."""
        self.check(fence)
        wish, self.wish = self.wish, None
        if wish is None:
            return
        if hand_over:
            self._grant(wish.person, wish.page)
        else:
            self.refused = wish.page

    def give_back(self, fence: int) -> None:
        """End the lease; who asks has it. Raises LeaseNeededError, LeaseError."""
        self.check(fence)
        self._pass_on()

    def check(self, fence: int) -> Holder:
        """The holder, where ``fence`` is the number of the lease; it counts as used.

        Raises LeaseNeededError, LeaseError.
        """
        if self.holder is None:
            raise LeaseNeededError
        if fence != self.holder.fence:
            raise LeaseError(holder=self.holder.person)
        return self._used(self.holder)

    def heard(self, page: str) -> None:
        """The holder's page has been heard of."""
        if self.holder is not None and self.holder.page == page:
            self._heard_s = self._now_s()

    def tick(self, in_motion: bool) -> bool:
        """Take the lease from who is gone, or does not answer. True where another one has it now, or nobody."""
        now_s, holder = self._now_s(), self.holder
        if holder is None:
            return False
        unanswered = self.wish is not None and now_s >= self.wish.due_s and not in_motion
        if now_s < holder.until_s and now_s - self._heard_s < AWAY_S and not unanswered:
            return False
        self._pass_on()
        return True

    def _pass_on(self) -> None:
        wish, self.wish, self.holder = self.wish, None, None
        if wish is not None:
            self._grant(wish.person, wish.page)

    def _grant(self, person: str, page: str) -> Holder:
        now_s = self._now_s()
        self._last_fence = max(self._last_fence + 1, self._fence_now())
        self._heard_s = now_s
        self.refused = None
        self.holder = Holder(person, page, self._last_fence, now_s + LEASE_S)
        return self.holder

    def _used(self, holder: Holder) -> Holder:
        self._heard_s = self._now_s()
        self.holder = replace(holder, until_s=self._heard_s + LEASE_S)
        return self.holder
