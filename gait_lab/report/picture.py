"""`nao_gait write picture`: a picture of a report, such as those in docs/."""

import re
import shutil
from collections.abc import Callable
from pathlib import Path

from robot_core.errors import NaoGaitError
from robot_core.schema import read_text

WIDTH, HEIGHT = 1280, 860
LARGEST = 1 << 30
"""[bytes] of a page."""
READY = "dataset.ready"
ARGUMENTS = ["--no-sandbox", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]


def picture(page: Path, out: Path, section: str, say: Callable[[str], None]) -> None:
    """A picture of the top of the page, or of one of its sections (`speeds`, `com`, ...).

    Raises:
        NaoGaitError: The page is none of a report, or has no such section.
    """
    from playwright.sync_api import sync_playwright

    html = read_text(page, "page", LARGEST)
    if READY not in html:
        raise NaoGaitError("page", str(page), "a page of nao_gait report")
    if section and f'id="s-{section}"' not in html:
        raise NaoGaitError("--section", section, re.findall(r'id="s-(\w+)"', html))
    with sync_playwright() as tool:
        browser = tool.chromium.launch(
            executable_path=shutil.which("chromium") or shutil.which("google-chrome"),
            args=ARGUMENTS,
        )
        tab = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        tab.goto(page.resolve().as_uri())
        tab.wait_for_function(f"document.documentElement.{READY} === 'yes'", timeout=120_000)
        if section:
            tab.evaluate("document.getElementById('bar').hidden = true")
            tab.evaluate("document.querySelector('nav').remove()")
            tab.locator(f"#s-{section}").scroll_into_view_if_needed()
            tab.wait_for_timeout(1500)
            tab.locator(f"#s-{section}").screenshot(path=out, type="png")
        else:
            tab.wait_for_timeout(1500)
            tab.screenshot(path=out, type="png")
        browser.close()
    say(f"written: {out}")
