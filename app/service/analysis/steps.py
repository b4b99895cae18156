"""Steps: like signs of several nodes at one moment are one step, in the order in which they began."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from app.recording.node_table import NodeKey
from app.wire.events import Severity
from app.wire.signs import Sign, SignKind

TOGETHER_NS: Final = 100_000_000
"""Like signs of other nodes within this are one step."""


@dataclass(frozen=True, slots=True)
class Step:
    """One or more like signs; ``signs[0]`` was the first."""

    signs: tuple[Sign, ...]

    @property
    def sign(self) -> Sign:
        """The first of them."""
        return self.signs[0]

    @property
    def kind(self) -> SignKind:
        """What they are."""
        return self.sign.kind

    @property
    def t_ns(self) -> int:
        """When the first began, as far as that is known."""
        return onset_ns(self.sign)

    @property
    def severity(self) -> Severity:
        """How much it matters."""
        return self.sign.severity

    @property
    def nodes(self) -> tuple[NodeKey, ...]:
        """The nodes, each once, in the order of time."""
        return tuple(dict.fromkeys((one.bus, one.node) for one in self.signs))


def onset_ns(sign: Sign) -> int:
    """When it began: who is silent is so since the last frame, not since somebody missed the next."""
    return sign.since_ns if sign.kind is SignKind.SILENT else sign.t_ns


def steps_of(signs: Iterable[Sign]) -> list[Step]:
    """The begins among ``signs`` as steps, by time of their onset."""
    steps: list[list[Sign]] = []
    latest: dict[tuple[SignKind, str, str], int] = {}
    for sign in sorted((one for one in signs if not one.ends), key=onset_ns):
        like = sign.kind, sign.subject, sign.text_key
        at = latest.get(like)
        if at is not None and onset_ns(sign) - onset_ns(steps[at][0]) <= TOGETHER_NS:
            steps[at].append(sign)
            continue
        latest[like] = len(steps)
        steps.append([sign])
    return [Step(tuple(group)) for group in steps]
