"""Times of a recording on the command line: seconds since its first frame, or a date with time."""

from __future__ import annotations

import argparse
import math
from datetime import UTC, datetime

from app.errors import UsageError
from app.recording.cdr import MAX_T_NS, NS
from app.recording.reader import Recording


def add_range(parser: argparse.ArgumentParser) -> None:
    """``--from`` and ``--until``."""
    parser.add_argument(
        "--from", dest="start", metavar="TIME", help="from here on: 12.5 (s from the start) or ISO 8601"
    )
    parser.add_argument("--until", dest="end", metavar="TIME", help="before this time")


def chosen_range(arguments: argparse.Namespace, recording: Recording) -> tuple[int | None, int | None]:
    """The range in ns since 1970, None where it is open. Raises UsageError."""
    span = recording.span_ns
    first_ns = 0 if span is None else span[0]
    start_ns, end_ns = (
        None if text is None else moment_ns(text, first_ns) for text in (arguments.start, arguments.end)
    )
    return start_ns, end_ns


def moment_ns(text: str, first_ns: int) -> int:
    """A time in ns since 1970; without a zone it is UTC. Raises UsageError."""
    try:
        seconds = float(text)
    except ValueError:
        return date_ns(text)
    if not math.isfinite(seconds) or not 0 <= first_ns + seconds * NS < MAX_T_NS:
        raise UsageError(reason=f"'{text}' lies in no recording")
    return first_ns + round(seconds * NS)


def date_ns(text: str) -> int:
    """``2026-03-02T13:00:41.5Z`` in ns since 1970. Raises UsageError."""
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise UsageError(
            reason=f"'{text}' is neither a number of seconds nor a date such as 2026-03-02T13:00:41Z"
        ) from None
    moment = moment if moment.tzinfo is not None else moment.replace(tzinfo=UTC)
    since = moment - datetime(1970, 1, 1, tzinfo=UTC)
    t_ns = (since.days * 86_400 + since.seconds) * NS + since.microseconds * 1_000
    if not 0 <= t_ns < MAX_T_NS:
        raise UsageError(reason=f"'{text}' lies in no recording")
    return t_ns
