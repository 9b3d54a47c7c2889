"""A headless Chromium for tests that look at a page; they are skipped where there is none."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
"""Looked for on the PATH; without any, playwright's own is taken."""
ARGUMENTS = (
    "--no-sandbox", "--disable-background-networking", "--disable-component-update",
    "--disable-sync", "--no-first-run",
    # A machine without a graphics card draws WebGL in software.
    "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
)  # fmt: skip
TIMEOUT = 300_000
"""[ms] for any single thing, on a busy machine that draws in software; it only ends a hang."""


class Tab:
    """A page, and all it complained about or asked the network for."""

    def __init__(self, page: Any) -> None:
        self.page = page
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.devtools = 0
        page.set_default_timeout(TIMEOUT)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("console", self._hear)
        page.on("request", lambda request: self.requests.append(request.url))

    def _hear(self, message: Any) -> None:
        if message.type == "error":
            self.complaints.append(message.text)

    def other(self, address: Path) -> "Tab":
        """A further tab of the same browser: playwright starts only one in a thread."""
        tab = Tab(self.page.context.browser.new_page())
        tab.page.goto(address.as_uri())
        return tab

    def run(self, script: str) -> Any:
        """What a JavaScript expression gives."""
        return self.page.evaluate(script)

    def wait(self, condition: str) -> None:
        """Until a JavaScript condition holds."""
        self.page.wait_for_function(condition, timeout=TIMEOUT)


@contextmanager
def open_tab(
    address: str | Path, width: int = 1280, height: int = 900, arguments: tuple[str, ...] = ()
) -> Iterator[Tab]:
    """Open a file or a URL; `arguments` are further ones of the browser."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="no playwright (pip install playwright)"
    )
    found = next((path for name in NAMES if (path := shutil.which(name))), None)
    with playwright.sync_playwright() as tool:
        try:
            browser = tool.chromium.launch(
                executable_path=found, args=[*ARGUMENTS, *arguments], timeout=TIMEOUT
            )
        except playwright.Error as error:
            reason = str(error).strip().splitlines()[0]
            pytest.skip(f"no Chromium (apt-get install chromium): {reason}")
        try:
            tab = Tab(browser.new_page(viewport={"width": width, "height": height}))
            tab.page.goto(address.as_uri() if isinstance(address, Path) else address)
            yield tab
        finally:
            browser.close()
