"""What is under way at an axis, and why it ended."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from enum import Enum, IntEnum
from typing import Final

from app.errors import HubsideError
from app.service.motion.commanding import Commanding


class Doing(Enum):
    """What is under way at an axis; the value is the end of its text key ``motion.doing.…``."""

    PREPARING = "preparing"
    PUTTING_BACK = "putting_back"
    JOG = "jog"
    MOVE = "move"
    HOMING = "homing"
    RESET = "reset"
    HOLD = "hold"
    FEATHER = "feather"
    BRAKE_TEST = "brake_test"
    SIGNAL = "signal"


class Ended(Enum):
    """Why a motion ended; the value is the end of its text key ``motion.ended.…``."""

    DONE = "done"
    RELEASED = "released"
    SILENT = "silent"
    LEASE = "lease"
    LINK = "link"
    INTERLOCK = "interlock"
    LIMIT = "limit"
    STOPPED = "stopped"
    FAILED = "failed"


STOPPING: Final = (Ended.SILENT, Ended.LEASE, Ended.LINK, Ended.INTERLOCK)
"""A quick stop was sent already."""


@dataclass
class Running:
    """A motion under way.

    ``held``: it goes on only while its person holds it; ``turning``: the axis was told to run; ``let_go``: the word by
    which it stops when its person lets go, None: by its ramp.
    """

    slug: str
    doing: Doing
    control: Commanding
    held: bool
    order: int = 0
    turning: bool = False
    let_go: IntEnum | None = None
    why: Ended | None = None
    task: asyncio.Task[None] | None = None
    over: asyncio.Event = field(default_factory=asyncio.Event)

    def end(self, why: Ended) -> None:
        """It ends now, for the first reason that there was; what was done, and then failed to come to rest, failed."""
        if self.why is None or (self.why is Ended.DONE and why is Ended.FAILED):
            self.why = why
        self.over.set()


@dataclass(frozen=True, slots=True)
class Last:
    """The latest motion: axis, what, why it ended, and the error where it failed."""

    slug: str
    doing: Doing
    why: Ended
    error: HubsideError | None
