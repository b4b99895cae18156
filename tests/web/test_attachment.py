"""Names of files that are downloaded, as browsers and old clients read them."""

from __future__ import annotations

import re
from email.message import Message
from pathlib import Path
from urllib.parse import unquote

import pytest

from app.web.attachment import as_attachment

ROUTES = Path(__file__).resolve().parent.parent.parent / "app" / "web" / "routes"
NAMES = (
    ("comparison.html", 'attachment; filename="comparison.html"', "comparison.html"),
    (
        "Prüfstand.json",
        "attachment; filename=\"Pr_fstand.json\"; filename*=UTF-8''Pr%C3%BCfstand.json",
        "Prüfstand.json",
    ),
    ("风电 1.csv", "attachment; filename=\"__ 1.csv\"; filename*=UTF-8''%E9%A3%8E%E7%94%B5%201.csv", "风电 1.csv"),
    ('a"b\\c.json', 'attachment; filename="a_b_c.json"', "a_b_c.json"),
    ("a\r\nSet-Cookie: x=1.csv", 'attachment; filename="a__Set-Cookie_ x=1.csv"', "a__Set-Cookie_ x=1.csv"),
    ("../etc/passwd", 'attachment; filename=".._etc_passwd"', ".._etc_passwd"),
    ("ö'(50%).dcf", "attachment; filename=\"_'(50%).dcf\"; filename*=UTF-8''%C3%B6%27%2850%25%29.dcf", "ö'(50%).dcf"),
)


@pytest.mark.parametrize(("name", "header", "read"), NAMES)
def test_a_name_is_told_in_ascii_and_as_it_is(name: str, header: str, read: str) -> None:
    found = as_attachment(name)["Content-Disposition"]
    assert found == header
    assert found.encode("latin-1").isascii(), "a header is sent as Latin-1"
    assert read_name(found) == read


def read_name(header: str) -> str | None:
    """As a browser does: the extended name where there is one."""
    extended = re.search(r"filename\*=UTF-8''([^ ;]+)$", header)
    if extended is not None:
        return unquote(extended[1])
    message = Message()
    message["Content-Disposition"] = header
    return message.get_filename()


def test_no_route_writes_the_header_by_itself() -> None:
    own = [
        path.name for path in ROUTES.glob("*.py") if re.search(r"content-disposition|filename=", path.read_text(), re.I)
    ]
    assert own == []
