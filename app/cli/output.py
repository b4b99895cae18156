"""What the command line prints: results on stdout, progress and errors on stderr, JSON where asked for."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from app.errors import (
    ConsentError,
    DeviceBusyError,
    DeviceError,
    HubsideError,
    NoAnswerError,
    OvertakenError,
    PdoBrokenError,
    RefusedError,
    RestoreOpenError,
    RestoreRefusedError,
    UnverifiedError,
    UsageError,
)
from app.model.texts import Texts, error_text

if TYPE_CHECKING:
    from app.model.eds import EdsWarning


class Output:
    """Speaks to the person or to the machine that called."""

    def __init__(self, texts: Texts, as_json: bool, out: TextIO | None = None, err: TextIO | None = None) -> None:
        self.texts = texts
        self.as_json = as_json
        self._out = out or sys.stdout
        self._err = err or sys.stderr
        self._open_progress = False

    def line(self, text: str) -> None:
        """One line of the result."""
        self._end_progress()
        print(text, file=self._out, flush=True)

    def raw(self, text: str) -> None:
        """A file's text as it is, its line ends kept."""
        self._out.flush()
        binary = getattr(self._out, "buffer", None)
        if binary is None:
            self._out.write(text)
        else:
            binary.write(text.encode("utf-8"))
            binary.flush()

    def result(self, data: Any, text: str) -> None:
        """The result: ``data`` as JSON for machines, ``text`` for people."""
        self.line(json.dumps(data, ensure_ascii=False) if self.as_json else text)

    def say(self, key: str, /, **details: Any) -> None:
        """A remark on stderr."""
        self._end_progress()
        print(self.texts(key, **details), file=self._err, flush=True)

    def progress(self, key: str, /, **details: Any) -> None:
        """Progress on stderr: rewritten in place on a terminal, silent elsewhere."""
        if self._err.isatty():
            print(f"\r\x1b[K{self.texts(key, **details)}", end="", file=self._err, flush=True)
            self._open_progress = True

    def error(self, error: HubsideError) -> None:
        """What went wrong, where, the state of the device, and what to do next."""
        self._end_progress()
        text = error_text(self.texts, error)
        step = next_step(error)
        if self.as_json:
            details = {key: str(value) for key, value in error.details.items()}
            print(
                json.dumps({"error": error.code, "text": text, "details": details}, ensure_ascii=False), file=self._err
            )
        else:
            print("hubside: " + text, file=self._err)
            if step:
                print("  " + self.texts(step), file=self._err)

    def table(self, head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """Columns as wide as they need."""
        widths = [max(len(row[column]) for row in (head, *rows)) for column in range(len(head))]
        for row in (head, *rows):
            self.line("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())

    def _end_progress(self) -> None:
        if self._open_progress:
            print(file=self._err)
            self._open_progress = False


def tell_warning(output: Output, path: Path, warning: EdsWarning) -> None:
    """One warning of an EDS or DCF file, with its line."""
    text = output.texts(warning.text_key, **warning.details)
    output.say("cli.eds_warning", file=path, line=warning.line, text=text)


def next_step(error: HubsideError) -> str | None:
    """Text key of what to do next."""
    for kind, key in (
        (UsageError, "usage"),
        (DeviceBusyError, "device_busy"),
        (PdoBrokenError, "pdo_broken"),
        (RestoreOpenError, "restore_open"),
        (RestoreRefusedError, "restore_refused"),
        (ConsentError, "consent"),
        (OvertakenError, "overtaken"),
        (RefusedError, "refused"),
        (DeviceError, "device"),
        (NoAnswerError, "no_answer"),
        (UnverifiedError, "unverified"),
    ):
        if isinstance(error, kind):
            return None if kind is UsageError and type(error) is not UsageError else f"next_step.{key}"
    return None
