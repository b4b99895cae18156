"""A small device that has one of everything the schema knows."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.model.description import Description
from app.model.description_file import load

TOY = """\
schema = 1
id = "toy"
version = "1.0.0"
name = "Toy"
vendor = "Nobody"
bus = "canopen"
addressing = "od"
manual = "none"

[[variant]]
id = "big"

[[save]]
address = "1010:03"
signature = 0x65766173

[[group]]
id = "all"

[[bit_table]]
id = "outputs"
bits = [
  { bit = 0, name = "fan", clamp = "X1.1" },
  { bit = 4, last = 5, name = "mode" },
]

[[enumeration]]
id = "kind"
values = [
  { value = 1, name = "one" },
  { value = -3, name = "three" },
]

[[object]]
index = 0x1010
name = "store parameters"
kind = "array"
section = "1"
group = "all"
type = "unsigned32"
access = "rw"
verify = "ack"
subs = [
  { sub = 3, name = "save application" },
]

[[object]]
index = 0x2000
name = "temperature supervisor"
kind = "record"
section = "2"
group = "all"
type = "integer16"
access = "rw"
saved = true
unit = "°C"
scale = 0.1
restore = "copy"
subs = [
  { sub = 1, name = "warning level", default = 500, max = { address = "2000:02" } },
  { sub = 2, name = "error level", default = 550, min = -400, max = 900, by_variant = { big = { max = 1200 } } },
]

[[object]]
index = 0x2001
name = "outputs"
section = "3"
group = "all"
type = "unsigned8"
access = "rw"
bits = "outputs"

[[object]]
index = 0x2002
name = "kind"
section = "4"
group = "all"
type = "integer8"
access = "rw"
enumeration = "kind"

[[object]]
index = 0x2003
name = "home offset"
section = "5"
group = "all"
type = "integer32"
access = "rw"
unit = "°"
scale = 0.01
unit_from = { address = "2004:01", shaft = "2004:02" }
requires = [ { address = "2002", values = [1] } ]

[[object]]
index = 0x2004
name = "feed constant"
kind = "array"
section = "6"
group = "all"
type = "unsigned32"
access = "r(w)"
restore = "factory"
elements = { count = 2, name = "part {n}", default = 1 }

[[object]]
index = 0x2005
name = "label"
section = "7"
group = "all"
type = "visible_string"
access = "ro"
default = "x"
"""


@pytest.fixture
def toy_file(tmp_path: Path) -> Path:
    """The toy's description as a file."""
    path = tmp_path / "toy.toml"
    path.write_text(TOY, encoding="utf-8")
    return path


@pytest.fixture
def toy(toy_file: Path) -> Description:
    """The toy's description."""
    return load(toy_file)
