"""The list of all rules as a file: CSV, JSON, and the page of the documentation. Pure: rules and texts in, text out."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Final

from app.model.rules.rule import Rule
from app.model.texts import Texts

_COLUMNS: Final = ("id", "severity", "stepwise", "section", "objects", "title", "why")
_INTRO: Final = """\
# Rules over the values of a station

This page is generated (`make generate`) from the rules themselves and their texts.

A rule looks at the values of one station, the PMM and the PMC of a blade together. It is a pure function: values in,
findings out. Where a value or a device that it needs is not known, it says *not checked* and names what is missing; it
never passes silently.

- **Error**: must not be so. A restore to such values is refused, and `hubside sets check` ends with exit code 3.
- **Warning**: a person must know. **Note**: worth a look.
- **At every write**: the rule holds after each single write of a restore as well, not only at its end. Such a rule
  compares values that lie in an order, so that single writes lead from any valid state to any other one.

`hubside sets rules --format csv` lists the rules, `hubside sets check FILE...` judges set files (those of one station
together), `hubside sets check --site FILE` reads and judges the connected devices. The page judges while a value is
typed, in the review of what is pending, in comparisons and before a restore. A finding names the object to mend first,
and says where that one still holds its default: some defaults of the manual break a rule, such as the maximum profile
velocity (607Fh) with a usual pitch gear.
"""


def to_csv(rules: Iterable[Rule], texts: Texts) -> str:
    """One line a rule (RFC 4180)."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\r\n")
    writer.writerow(_COLUMNS)
    for rule in rules:
        objects = " ".join(f"{kind}/{address}" for kind, found in rule.objects.items() for address in found)
        row = {**_row(rule, texts), "objects": objects, "stepwise": int(rule.stepwise)}
        writer.writerow([row[name] for name in _COLUMNS])
    return text.getvalue()


def to_json(rules: Iterable[Rule], texts: Texts) -> str:
    """A list of objects."""
    return json.dumps([_row(rule, texts) for rule in rules], ensure_ascii=False, indent=1) + "\n"


def to_markdown(rules: Iterable[Rule], texts: Texts) -> str:
    """The page of the documentation."""
    listed = tuple(rules)
    return "\n".join((_INTRO, *_table(listed, texts), *(line for rule in listed for line in _chapter(rule, texts))))


WRITERS: Final[Mapping[str, Callable[[Iterable[Rule], Texts], str]]] = {
    "csv": to_csv,
    "json": to_json,
    "md": to_markdown,
}
"""Writers by the name of their format."""


def _row(rule: Rule, texts: Texts) -> dict[str, Any]:
    return {
        "id": rule.id,
        "severity": rule.severity.value,
        "stepwise": rule.stepwise,
        "section": rule.section,
        "objects": {kind: list(addresses) for kind, addresses in rule.objects.items()},
        "title": texts(f"rule.{rule.id}.title"),
        "why": texts(f"rule.{rule.id}.why"),
    }


def _table(rules: Iterable[Rule], texts: Texts) -> Iterator[str]:
    yield "| Rule | Weight | At every write | Manual |"
    yield "|---|---|---|---|"
    for rule in rules:
        mark = "yes" if rule.stepwise else ""
        weight = texts(f"rule.severity.{rule.severity.value}")
        yield f"| [{texts(f'rule.{rule.id}.title')}](#{_anchor(rule)}) | {weight} | {mark} | {rule.section} |"
    yield ""


def _chapter(rule: Rule, texts: Texts) -> Iterator[str]:
    objects = "; ".join(
        f"{kind.rpartition('-')[2].upper()} {', '.join(addresses)}" for kind, addresses in rule.objects.items()
    )
    yield f"## {rule.id}"
    yield ""
    yield f"**{texts(f'rule.{rule.id}.title')}.** {texts(f'rule.{rule.id}.why')}"
    yield ""
    yield f"Objects: {objects}"
    yield ""


def _anchor(rule: Rule) -> str:
    return rule.id.replace(".", "")
