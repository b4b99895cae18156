"""What ``hubside restore`` tells: people hear each part as it comes, machines get one document when it has ended."""

from __future__ import annotations

from types import TracebackType
from typing import Any

from app.cli.output import Output
from app.cli.restore_plan import plan_dict, tell_plan
from app.service.restore.prepare import Prepared


class Told:
    """``{"plan": …, "result": …}``, null where there is none; nothing at all where neither came to be."""

    def __init__(self, output: Output) -> None:
        self.output = output
        self._document: dict[str, Any] = {"plan": None, "result": None}

    def plan(self, prepared: Prepared) -> None:
        """What would be done, and what speaks against it."""
        if self.output.as_json:
            self._document["plan"] = plan_dict(prepared)
        else:
            tell_plan(prepared, self.output)

    def result(self, details: dict[str, Any], text: str) -> None:
        """How it ended."""
        if self.output.as_json:
            self._document["result"] = details
        else:
            self.output.line(text)

    def __enter__(self) -> Told:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """A refusal or an interruption leaves the plan to be told."""
        if self.output.as_json and any(self._document.values()):
            self.output.result(self._document, "")
