"""Headless Chromium for the browser tests."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

from playwright.sync_api import Browser, BrowserContext, Page, ViewportSize, expect

SIZE: Final[ViewportSize] = {"width": 1366, "height": 768}
WAIT_MS: Final = 30_000
CHROMIUM: Final = os.environ.get("CHROMIUM") or shutil.which("chromium") or "/usr/bin/chromium"
FLAGS: Final = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
SOFTWARE_3D: Final = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
"""Renders the 3D view without a graphics card, at the cost of whole cores."""


@contextmanager
def signed_in(browser: Browser, url: str, **options: Any) -> Iterator[BrowserContext]:
    """A context whose session was opened by the address ``url``, which the demo prints and which works once."""
    context = browser.new_context(viewport=SIZE, locale="en-GB", **options)
    context.set_default_timeout(WAIT_MS)
    first = context.new_page()
    first.goto(url)
    expect(first.get_by_test_id("mode")).to_contain_text("TWIN", timeout=WAIT_MS)
    first.close()
    yield context
    context.close()


def answer_of(page: Page, asked: str, arg: Any = None, timeout_ms: float = WAIT_MS) -> Any:
    """What an asynchronous function of the page gives, once that is true. Raises TimeoutError.

    For what the page must fetch: ``wait_for_function`` takes every promise for true.
    """
    end_s = time.monotonic() + timeout_ms / 1000
    while not (answer := page.evaluate(asked, arg)):
        if time.monotonic() > end_s:
            raise TimeoutError(f"not true within {timeout_ms / 1000:.0f} s: {asked}")
        page.wait_for_timeout(50)
    return answer
