"""What a column of a comparison is to show, as text: the same in an address, in the API and on the command line."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from app.errors import ColumnError


class ColumnKind(Enum):
    """Where the values of a column come from.

    ``LIVE``: RAM now. ``STORED``: non-volatile memory as far as it is known. ``EDITOR``: RAM with changes that are not
    written yet. ``DEFAULT``: of the description. ``SET``: a record of the library. ``FILE``: a set file. ``GOLDEN``:
    the model set of the device's kind. ``DELIVERED``: as delivered. ``FOUND``, ``LEFT``: of the last visit that kept
    values. ``YEAR``: about a year ago. ``LATEST``: the newest set that is kept, a complete one where there is one.
    ``MOMENT``: what a recording had shown until a time, as ``moment:<recording>@<t_ns>/<device>``.
    """

    LIVE = "live"
    STORED = "stored"
    EDITOR = "editor"
    DEFAULT = "default"
    SET = "set"
    FILE = "file"
    GOLDEN = "golden"
    DELIVERED = "delivered"
    FOUND = "found"
    LEFT = "left"
    YEAR = "year"
    LATEST = "latest"
    MOMENT = "moment"

    @property
    def of_device(self) -> bool:
        """True where the column is named by a device."""
        return self not in (ColumnKind.SET, ColumnKind.FILE, ColumnKind.MOMENT)


class Unresolved(Enum):
    """Why a column cannot be shown. The text is ``compare.unresolved.<value>``."""

    NO_SPEC = "no-spec"
    NOT_CONNECTED = "not-connected"
    NO_DEVICE = "no-device"
    NO_SET = "no-set"
    NO_GOLDEN = "no-golden"
    NO_DELIVERED = "no-delivered"
    NO_VISIT = "no-visit"
    NO_YEAR = "no-year"
    NO_LATEST = "no-latest"
    NO_DESCRIPTION = "no-description"
    NO_OBJECT = "no-object"
    NOT_HERE = "not-here"
    NO_EDITOR = "no-editor"
    NO_MOMENT = "no-moment"

    def error(self, column: str, **details: str) -> ColumnError:
        """The error that says so of ``column``."""
        return ColumnError(column=column, reason_key=f"compare.unresolved.{self.value}", **details)


@dataclass(frozen=True, slots=True)
class ColumnSpec:
    """``of`` is a device (turbine/station/device), a record's id or the beginning of a set's hash, or a path.

    Of a moment it is ``<recording>@<t_ns>/<device>``.
    """

    kind: ColumnKind
    of: str

    def __str__(self) -> str:
        return f"{self.kind.value}:{self.of}"


def parse_moment(spec: ColumnSpec) -> tuple[str, int, str]:
    """Recording, time in ns and device of a moment. Raises ColumnError."""
    place, _, device = spec.of.partition("/")
    recording, _, digits = place.rpartition("@")
    if not recording or not device or not (digits.isascii() and digits.isdecimal() and len(digits) <= 19):
        raise Unresolved.NO_MOMENT.error(str(spec))
    return recording, int(digits), device


def parse_spec(text: str) -> ColumnSpec:
    """Read ``live:wtg-07/blade-2/pmc``. Raises ColumnError."""
    word, colon, of = text.strip().partition(":")
    kind = next((one for one in ColumnKind if one.value == word), None)
    if kind is None or not colon or not of:
        raise Unresolved.NO_SPEC.error(text)
    return ColumnSpec(kind, of)
