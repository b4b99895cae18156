"""``hubside index``: make the index beside a recording, and tell what is in it.

Exit codes: 0 where every file has its index, 2 where one could not be read or its index not be written.
"""

from __future__ import annotations

import argparse
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from app.cli.output import Output
from app.errors import RecordingError
from app.recording.index import Gap, GapKind, RecordingIndex, build_index, open_index
from app.recording.reader import open_recording

NS: Final = 1_000_000_000
_TOLD_GAPS: Final = 20


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the command."""
    parser = commands.add_parser("index", help="make the index beside a recording, and tell what is in it")
    parser.add_argument("recording", nargs="+", type=Path)
    parser.add_argument("--again", action="store_true", help="make it anew where there is a good one")
    parser.set_defaults(run=_index)


def _index(arguments: argparse.Namespace, output: Output) -> int:
    code = 0
    for path in arguments.recording:
        try:
            with _opened(path, arguments, output) as index:
                _tell(index, output)
        except RecordingError as error:
            output.error(error)
            code = error.exit_code
    return code


def _opened(path: Path, arguments: argparse.Namespace, output: Output) -> RecordingIndex:
    cache: Path = arguments.settings.data / "indexes"
    index = None if arguments.again else open_index(path, cache)
    return made_index(path, cache, output) if index is None else index


def made_index(path: Path, cache: Path, output: Output) -> RecordingIndex:
    """Make the index of a recording. Raises RecordingError."""
    with open_recording(path) as recording:
        descriptions = recording.descriptions

    def shown(share: float) -> None:
        output.progress("cli.indexing", file=path.name, percent=round(100 * share))

    return build_index(path, descriptions, shown, cache=cache)


def _tell(index: RecordingIndex, output: Output) -> None:
    gaps = index.gaps()
    kinds = Counter(gap.kind for gap in gaps)
    data: dict[str, Any] = {
        "file": str(index.recording),
        "index": str(index.path),
        "index_bytes": index.path.stat().st_size,
        "from_ns": index.span_ns[0],
        "to_ns": index.span_ns[1],
        "frames": index.frames,
        "events": len(index.events()),
        "signs": len(index.signs()),
        "signals": len(index.signals()),
        "keyframes": index.keyframes,
        "gaps": {kind.value: kinds[kind] for kind in GapKind if kinds[kind]},
    }
    seconds = f"{(index.span_ns[1] - index.span_ns[0]) / NS:.1f}"
    size = f"{data['index_bytes'] / 1e6:.2f} MB"
    text = {key: value for key, value in data.items() if key != "gaps"}
    output.result(data, output.texts("cli.indexed", **text, seconds=seconds, size=size))
    if not output.as_json:
        for gap in [one for one in gaps if one.kind is not GapKind.RESTART][:_TOLD_GAPS]:
            output.line(_gap_line(gap, output))


def _gap_line(gap: Gap, output: Output) -> str:
    at = datetime.fromtimestamp(gap.from_ns / NS, UTC).isoformat(timespec="milliseconds")
    what = output.texts(gap.kind.text_key)
    count = gap.details.get("count")
    seconds = f"{(gap.to_ns - gap.from_ns) / NS:.3f}"
    key = "cli.index_gap" if count is None else "cli.index_loss"
    return output.texts(key, at=at, bus=gap.bus or "–", what=what, seconds=seconds, count=count)
