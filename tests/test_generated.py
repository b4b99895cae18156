"""What is generated is up to date: the API's document, and the page's types that are made from it."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from app.web import generate

FRONTEND = Path(__file__).resolve().parent.parent / "frontend"
DOCUMENT = FRONTEND / "openapi.json"
TYPES = FRONTEND / "src" / "api" / "generated.ts"
HOW = "out of date: run 'make generate'"


def test_the_api_document_is_up_to_date() -> None:
    assert DOCUMENT.read_text(encoding="utf-8") == generate.text(), f"{DOCUMENT.name} is {HOW}"


def test_generating_is_deterministic(tmp_path: Path) -> None:
    assert generate.main([str(tmp_path / "a.json")]) == 0
    assert generate.main([str(tmp_path / "b.json")]) == 0
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    assert generate.main([]) == 2


def test_every_message_of_the_socket_has_its_type() -> None:
    document = generate.openapi()
    schemas = document["components"]["schemas"]
    for name in ("HelloMessage", "ValuesMessage", "AxesMessage", "ClientMessage", "Problem"):
        assert name in schemas
    message = schemas["ValuesMessage"]
    assert {"v", "ctx", "type", "seq", "t_ns", "data"} == set(message["required"])


def test_the_types_of_the_page_are_up_to_date(tmp_path: Path) -> None:
    npx = shutil.which("npx")
    assert npx is not None and (FRONTEND / "node_modules").is_dir(), "the page's tools are missing: make page"
    made = tmp_path / "generated.ts"
    command = [npx, "--no-install", "openapi-typescript", str(DOCUMENT), "-o", str(made)]
    subprocess.run(command, cwd=FRONTEND, check=True, capture_output=True, timeout=60)
    assert TYPES.read_text(encoding="utf-8") == made.read_text(encoding="utf-8"), f"{TYPES.name} is {HOW}"
