"""Problem documents tell the operator's text in the language that was asked for."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest

from app.errors import SdoAbortError
from app.model.texts import load_texts
from app.web.problem import problem_of, texts_for
from tests.web.rig import Server, running


@pytest.fixture
async def server() -> AsyncIterator[Server]:
    async with running() as started:
        yield started


@pytest.mark.parametrize(
    ("wish", "language"),
    [
        (None, "en"),
        ("de", "de"),
        ("de-AT,de;q=0.9,en;q=0.8", "de"),
        ("en-GB,en;q=0.9,de;q=0.8", "en"),
        ("fr,de;q=0.5,en;q=0.3", "de"),
        ("de;q=0", "en"),
        ("de;q=much", "en"),
        ("*", "en"),
    ],
)
def test_the_language_that_is_wanted_most(wish: str | None, language: str) -> None:
    assert texts_for(wish) is load_texts(language)


async def test_a_refusal_is_told_in_words(server: Server) -> None:
    answers = {}
    for language in ("en", "de"):
        headers = {"Accept-Language": language}
        for client, path in ((server.client, "/api/live/jobs/none"), (server.stranger, "/api/session")):
            document = (await client.get(path, headers=headers)).json()
            assert document["text"] and not document["text"].startswith("error.")
            answers[language, path] = document["text"]
    assert len(set(answers.values())) == 4


def test_an_abort_code_is_told_in_words_and_as_the_number() -> None:
    error = SdoAbortError(node=1, address="6064", abort_code=0x06010002, text_key_reason="abort.read_only")
    text = problem_of(error).text
    assert "06010002h" in text
    assert "abort." not in text
