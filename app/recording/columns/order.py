"""Brings blocks of one bus into the order of time: threads that overtook each other leave them overlapping a little."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from app.recording.can_table import Block, Columns, by_time, concatenated


class InOrder:
    """Takes blocks of one bus, each sorted by time and none beginning before one ahead of it; gives what is in order.

    Blocks that do not overlap pass as they are; of the others only what overlaps is copied. Of equal times the frame
    of the earlier block comes first.
    """

    def __init__(self) -> None:
        self._held: list[Block] = []

    def take(self, block: Block) -> Iterator[Block]:
        """The frames before the first of ``block``; the others are held back."""
        if not len(block.t_ns):
            return
        first_ns = block.t_ns[0]
        held, self._held = self._held, []
        rest: list[Block] = []
        for piece in held:
            size = len(piece.t_ns)
            cut = int(np.searchsorted(piece.t_ns, first_ns, "right"))
            if cut:
                yield piece.part(0, cut) if cut < size else piece
            if cut < size:
                rest.append(piece.part(cut, size) if cut else piece)
        self._held = _merged(rest, block) if rest else [block]

    def end(self) -> Iterator[Block]:
        """What is left when no block comes any more."""
        yield from self._held
        self._held = []


def _merged(rest: list[Block], block: Block) -> list[Block]:
    """``rest`` with the beginning of ``block`` as one, then what is left of ``block``."""
    last_ns, size = max(piece.t_ns[-1] for piece in rest), len(block.t_ns)
    cut = int(np.searchsorted(block.t_ns, last_ns, "left"))
    pieces = [*(piece.gather(slice(None)) for piece in rest), block.gather(slice(0, cut))]
    merged = Columns(by_time(concatenated(pieces)))
    return [merged, block.part(cut, size)] if cut < size else [merged]
