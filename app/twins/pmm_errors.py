"""Errors and warnings of the PMM (manual, 3.2 and 4.1): one code object for both, messages for errors only."""

from __future__ import annotations

from app.twins.emergency import Emergency


class PmmErrors:
    """Errors stay until they are reset and their cause is gone; warnings go with their cause."""

    def __init__(self, emergency: Emergency) -> None:
        self._emergency = emergency
        self._present: set[int] = set()
        self._pending: dict[int, None] = {}
        self._warnings: dict[int, None] = {}

    @property
    def pending(self) -> tuple[int, ...]:
        """Error codes that wait for a reset, the oldest first."""
        return tuple(self._pending)

    @property
    def warnings(self) -> tuple[int, ...]:
        """Warning codes, the oldest first."""
        return tuple(self._warnings)

    @property
    def code(self) -> int:
        """603Fh: the oldest error, else the oldest warning, else 0."""
        return next(iter(self._pending), next(iter(self._warnings), 0))

    def clear(self) -> None:
        """Forget all, as at power-on."""
        self._present.clear()
        self._pending.clear()
        self._warnings.clear()

    def error(self, code: int, present: bool) -> None:
        """The cause of an error appears or disappears."""
        if not present:
            self._present.discard(code)
            return
        self._present.add(code)
        if code not in self._pending:
            self._pending[code] = None
            self._emergency.occur(code)

    def event(self, code: int) -> None:
        """An error without a lasting cause."""
        self.error(code, True)
        self._present.discard(code)

    def warning(self, code: int, present: bool) -> None:
        """A warning appears or disappears; no message is sent."""
        if present:
            self._warnings[code] = None
        else:
            self._warnings.pop(code, None)

    def reset(self) -> None:
        """Fault reset: errors whose cause is gone are cleared."""
        for code in [code for code in self._pending if code not in self._present]:
            del self._pending[code]
            self._emergency.clear(code)
