"""The page's files: compressed, cached as their names allow, and nothing outside their folder."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from tests.web.rig import Server, running


@pytest.fixture
def page_folder(tmp_path: Path) -> Path:
    folder = tmp_path / "dist"
    (folder / "assets").mkdir(parents=True)
    (folder / "index.html").write_text("<!doctype html><title>page</title>")
    (folder / "assets" / "index-abc.js").write_text("export {};\n" * 1000)
    (tmp_path / "secret.txt").write_text("kept apart")
    return folder


@pytest.fixture
async def server(page_folder: Path) -> AsyncIterator[Server]:
    async with running(page=page_folder) as started:
        yield started


async def test_files_are_compressed_and_cached_for_good_where_their_names_hold_a_hash(server: Server) -> None:
    answer = await server.client.get("/assets/index-abc.js")
    assert answer.headers["content-encoding"] == "gzip"
    assert int(answer.headers["content-length"]) < 200
    assert answer.text == "export {};\n" * 1000
    assert "immutable" in answer.headers["cache-control"]
    assert answer.headers["content-type"].startswith("text/javascript")
    plain = await server.client.get("/assets/index-abc.js", headers={"Accept-Encoding": "identity"})
    assert "content-encoding" not in plain.headers
    assert plain.content == answer.content


async def test_the_index_is_asked_for_anew_and_not_sent_twice(server: Server) -> None:
    answer = await server.client.get("/")
    assert answer.headers["cache-control"] == "no-cache"
    again = await server.client.get("/", headers={"If-None-Match": answer.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert again.headers["content-security-policy"]


async def test_routes_of_the_page_give_its_index_and_missing_files_do_not(server: Server) -> None:
    assert (await server.client.get("/parameters")).text.startswith("<!doctype html>")
    for path in ("/assets/gone.js", "/gone.png", "/api/gone", "/viserx"):
        assert (await server.client.get(path)).status_code == 404, path


async def test_nothing_outside_the_folder_is_served(server: Server) -> None:
    for path in ("/../secret.txt", "/%2e%2e/secret.txt", "/assets/..%2f..%2fsecret.txt", "//etc/passwd", "/etc/passwd"):
        answer = await server.client.get(path)
        assert "kept apart" not in answer.text
        assert "root:" not in answer.text


async def test_a_new_build_is_served_without_a_restart(server: Server, page_folder: Path) -> None:
    before = await server.client.get("/")
    (page_folder / "index.html").write_text("<!doctype html><title>new build</title>")
    after = await server.client.get("/")
    assert "new build" in after.text
    assert before.headers["etag"] != after.headers["etag"]


async def test_a_page_that_was_not_built_is_said(tmp_path: Path) -> None:
    async with running(page=tmp_path) as server:
        assert (await server.client.get("/")).status_code == 404
        assert (await server.client.get("/api/session")).status_code == 200
