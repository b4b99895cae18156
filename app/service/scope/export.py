"""A capture as a file: CSV for spreadsheets in the reader's language, JSON with all of it.

Both come in pieces that take some milliseconds each. One call of the JSON writer for a million values holds up every
thread of the program until it is done, in whichever thread it runs, and with them the stop of an axis.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from decimal import Decimal
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from app.model.sets import iso_time
from app.model.texts import Texts
from app.service.compare.export import harmless
from app.service.records.view import visible
from app.service.scope.capture import Capture, InForce, KeptSignal, Values
from app.service.scope.series import each_once

FORMAT: Final = "hubside-capture/1"
BOM: Final = "\ufeff"
"""So that spreadsheets take the file for UTF-8."""
INSTANTS: Final = 1000
"""Of a piece of CSV."""
NUMBERS: Final = 2000
"""Of a piece of JSON."""
ROWS: Final = 200
"""Marks, or parameter values, of a piece of JSON."""
_EXACT: Final = 2**53
"""Up to here a float holds every integer."""


# -- CSV -----------------------------------------------------------------------------


def csv_pieces(capture: Capture, texts: Texts) -> Iterator[bytes]:
    """One row an instant at which a signal was seen; a cell is empty where that signal was not seen then.

    Decimal sign and separator as the language has them.
    """
    head = capture.head
    point, mark = texts("scope.csv.point"), texts("scope.csv.separator")
    names = [texts("scope.csv.time"), "t_ns", *(title_of(one, texts) for one in head.signals)]
    yield (BOM + mark.join(_quoted(harmless(name), mark) for name in names) + "\r\n").encode()
    times = each_once([values.t_ns for values in capture.values])
    steps = [Decimal(one.scale) for one in head.signals]
    for start in range(0, len(times), INSTANTS):
        lines = []
        for t_ns, rows in _rows(capture.values, steps, times[start : start + INSTANTS]):
            stamp = f"{_seconds(t_ns - head.trigger_ns).replace('.', point)}{mark}{t_ns}{mark}"
            lines += [f"{stamp}{mark.join(cells).replace('.', point)}\r\n" for cells in rows]
        yield "".join(lines).encode()


def _rows(
    values: Sequence[Values], steps: Sequence[Decimal], times: npt.NDArray[np.int64]
) -> Iterator[tuple[int, list[list[str]]]]:
    """The rows of some instants; values of one signal at the same instant each get a row."""
    found: dict[int, list[list[str]]] = {t_ns: [[""] * len(values)] for t_ns in times.tolist()}
    for column, (own, step) in enumerate(zip(values, steps, strict=True)):
        first = int(np.searchsorted(own.t_ns, times[0], "left"))
        last = int(np.searchsorted(own.t_ns, times[-1], "right"))
        raws = own.raw[first:last].tolist()
        texts = {raw: scaled_text(raw, step) for raw in set(raws)}
        before, at = None, 0
        for t_ns, raw in zip(own.t_ns[first:last].tolist(), raws, strict=True):
            at = at + 1 if t_ns == before else 0
            before = t_ns
            rows = found[t_ns]
            if at == len(rows):
                rows.append([""] * len(values))
            rows[at][column] = texts[raw]
    yield from found.items()


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


# -- JSON ----------------------------------------------------------------------------


def json_pieces(capture: Capture, rows: Sequence[InForce]) -> Iterator[bytes]:
    """All of it: settings, raw and scaled values, marks, identities, parameter values in force."""
    head = capture.head
    plain: dict[str, Any] = {"format": FORMAT, **asdict(replace(head, marks=())), "time": iso_time(head.trigger_ns)}
    del plain["marks"], plain["signals"]
    yield (_json(plain)[:-1] + ',"signals":[').encode()
    for number, (signal, values) in enumerate(zip(head.signals, capture.values, strict=True)):
        yield ((b"," if number else b"") + _json(asdict(signal))[:-1].encode() + b',"t_ns":')
        yield from _listed(values.t_ns, NUMBERS, lambda part: part.tolist())
        yield b',"raw":'
        yield from _listed(values.raw, NUMBERS, lambda part: part.tolist())
        yield b',"scaled":'
        step = Decimal(signal.scale)
        yield from _listed(values.raw, NUMBERS, lambda part, step=step: scaled_numbers(part, step))
        yield b"}"
    yield b'],"marks":'
    yield from _listed(head.marks, ROWS, lambda part: [asdict(one) for one in part])
    yield b',"in_force":'
    yield from _listed(rows, ROWS, lambda part: [asdict(one) for one in part])
    yield b"}\n"


def _listed(items: Any, size: int, plain_of: Any) -> Iterator[bytes]:
    """A JSON array, ``size`` items a piece."""
    yield b"["
    for start in range(0, len(items), size):
        inner = _json(plain_of(items[start : start + size]))[1:-1]
        yield (f",{inner}" if start else inner).encode()
    yield b"]"


def scaled_numbers(raws: npt.NDArray[Any], step: Decimal) -> list[float]:
    """In the signal's unit, each the float nearest to ``raw x step``."""
    divisor = 1 / step if step else step
    if divisor and divisor == divisor.to_integral_value() and len(raws):
        low, high = float(raws.min()), float(raws.max())
        if low >= -_EXACT and high <= _EXACT:  # one division of two exact numbers rounds once
            quotients: list[float] = (raws.astype(np.float64) / float(divisor)).tolist()
            return quotients
    return [float(scaled_text(raw, step)) for raw in raws.tolist()]


def _json(plain: object) -> str:
    return json.dumps(plain, ensure_ascii=False, separators=(",", ":"))
