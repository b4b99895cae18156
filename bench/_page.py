"""A page in a real browser, whose buttons and keys are pressed."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import httpx
from playwright.async_api import Page, async_playwright

from bench._chromium import CHROMIUM, FLAGS


class PressedPage:
    """The axis room, signed in by what ``client`` is signed in with."""

    def __init__(self, page: Page) -> None:
        self._page = page

    @classmethod
    @asynccontextmanager
    async def at(cls, base: str, client: httpx.AsyncClient) -> AsyncIterator[PressedPage]:
        """Opened in a Chromium of its own, without the 3D view, and connected."""
        async with async_playwright() as playwright:
            chromium = await playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
            context = await chromium.new_context(viewport={"width": 1366, "height": 768}, locale="en-GB")
            await context.add_cookies(
                [{"name": one.name, "value": one.value or "", "url": base} for one in client.cookies.jar]
            )
            page = await context.new_page()
            await page.goto(f"{base}/axis?blade=1&scene=off")
            await page.get_by_test_id("axis-angle").wait_for()
            yield cls(page)
            await chromium.close()

    async def click(self, test_id: str) -> float:
        """Press a button of the frame. When, by the monotonic clock: before the browser is told."""
        button = self._page.get_by_test_id(test_id)
        await button.hover()
        pressed_s = time.monotonic()
        await self._page.mouse.down()
        await self._page.mouse.up()
        return pressed_s

    async def until_moving(self) -> None:
        """Until Esc is STOP, as the button then says."""
        await self._page.locator("[data-testid=stop][aria-keyshortcuts=Escape]").wait_for()

    async def escape(self) -> float:
        """Press Esc. When, by the monotonic clock: before the browser is told."""
        pressed_s = time.monotonic()
        await self._page.keyboard.press("Escape")
        return pressed_s
