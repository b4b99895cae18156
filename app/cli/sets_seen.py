"""How values that come out of recordings are marked: read or written, when, by whom, and whether they are in doubt."""

from __future__ import annotations

from typing import Final

from app.cli.output import Output
from app.model.sets import iso_time
from app.service.library.recovered import Doubt, Seen
from app.wire.records import SdoAccess

_DOUBT: Final = {None: "", Doubt.BOOT_UP: "?", Doubt.GAP: "??"}


def mark(look: Seen) -> str:
    """``w*? 2026-03-04 14:03:21.250``: written, by another master, before a restart; the instant in UTC."""
    access = "w" if look.access is SdoAccess.WRITE else "r"
    time = iso_time(look.t_ns)[:23].rstrip("Z").replace("T", " ")
    return f"{access}{'' if look.ours else '*'}{_DOUBT[look.doubt]} {time}"


def tell_legend(output: Output, recording: str) -> None:
    """What the marks mean, and where they come from."""
    output.line(output.texts("cli.sets.seen_legend", recording=recording))
