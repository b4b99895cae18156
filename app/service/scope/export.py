"""A capture as a file: CSV for spreadsheets in the reader's language, JSON with all of it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from decimal import Decimal
from typing import Any, Final

import numpy as np

from app.model.sets import iso_time
from app.model.texts import Texts
from app.service.compare.export import harmless
from app.service.records.view import visible
from app.service.scope.capture import Capture, InForce, KeptSignal

FORMAT: Final = "hubside-capture/1"
BOM: Final = "\ufeff"
"""So that spreadsheets take the file for UTF-8."""


def csv_lines(capture: Capture, texts: Texts) -> Iterator[str]:
    """One row an instant at which a signal was seen; a cell is empty where that signal was not seen then.

    Decimal sign and separator as the language has them.
    """
    head = capture.head
    point, mark = texts("scope.csv.point"), texts("scope.csv.separator")
    names = [texts("scope.csv.time"), "t_ns", *(title_of(one, texts) for one in head.signals)]
    yield BOM + mark.join(_quoted(harmless(name), mark) for name in names) + "\r\n"
    every = [values.t_ns for values in capture.values if len(values.t_ns)]
    times = np.unique(np.concatenate(every)) if every else np.zeros(0, np.int64)
    at = [0] * len(capture.values)
    columns = [(values.t_ns.tolist(), values.raw.tolist()) for values in capture.values]
    steps = [Decimal(one.scale) for one in head.signals]
    for t_ns in times.tolist():
        same = [t_ns]  # values of one signal at the same instant each get a row
        while same:
            same = []
            cells = []
            for number, (own, raws) in enumerate(columns):
                here = at[number]
                if here < len(own) and own[here] == t_ns:
                    cells.append(scaled_text(raws[here], steps[number]).replace(".", point))
                    at[number] = here + 1
                    if here + 1 < len(own) and own[here + 1] == t_ns:
                        same = [t_ns]
                else:
                    cells.append("")
            yield mark.join((_seconds(t_ns - head.trigger_ns).replace(".", point), str(t_ns), *cells)) + "\r\n"


def title_of(signal: KeptSignal, texts: Texts) -> str:
    """``blade-1/pmc position actual value [°]``."""
    bit = ""
    if signal.bit is not None:
        named = "" if signal.bit_key is None else f" {texts(signal.bit_key)}"
        bit = f", {texts('scope.csv.bit', bit=signal.bit)}{named}"
    unit = f" [{signal.unit}]" if signal.unit else ""
    return visible(f"{signal.device.partition('/')[2]} {texts.name(signal.title)}{bit}{unit}")


def scaled_text(raw: int | float, step: Decimal) -> str:
    """A raw value in its unit, with all the digits that it has and no more."""
    if isinstance(raw, float) and step == 1:
        return repr(raw)
    number = Decimal(str(raw)) * step
    return f"{number:f}"


def _seconds(ns: int) -> str:
    return f"{'-' if ns < 0 else ''}{abs(ns) // 10**9}.{abs(ns) % 10**9:09d}"


def _quoted(text: str, mark: str) -> str:
    return f'"{text.replace(chr(34), chr(34) * 2)}"' if any(one in text for one in (mark, '"', "\r", "\n")) else text


def to_json(capture: Capture, rows: Sequence[InForce]) -> str:
    """All of it: settings, raw and scaled values, marks, identities, parameter values in force."""
    head = capture.head
    plain: dict[str, Any] = {"format": FORMAT, **asdict(head), "time": iso_time(head.trigger_ns)}
    plain["signals"] = [
        {
            **asdict(one),
            "t_ns": values.t_ns.tolist(),
            "raw": values.raw.tolist(),
            "scaled": [float(scaled_text(raw, Decimal(one.scale))) for raw in values.raw.tolist()],
        }
        for one, values in zip(head.signals, capture.values, strict=True)
    ]
    plain["in_force"] = [asdict(one) for one in rows]
    return json.dumps(plain, ensure_ascii=False, separators=(",", ":")) + "\n"
