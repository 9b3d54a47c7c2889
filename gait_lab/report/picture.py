"""`nao_gait write picture`: a picture of a report, such as those in docs/."""

import shutil
from collections.abc import Callable
from pathlib import Path

WIDTH, HEIGHT = 1280, 860
ARGUMENTS = ["--no-sandbox", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]


def picture(page: Path, out: Path, section: str, say: Callable[[str], None]) -> None:
    """A picture of the top of the page, or of one of its sections (`speeds`, `com`, ...)."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as tool:
        browser = tool.chromium.launch(
            executable_path=shutil.which("chromium") or shutil.which("google-chrome"),
            args=ARGUMENTS,
        )
        tab = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        tab.goto(page.resolve().as_uri())
        tab.wait_for_function("document.documentElement.dataset.ready === 'yes'", timeout=120_000)
        if section:
            tab.evaluate("document.getElementById('bar').hidden = true")
            tab.evaluate("document.querySelector('nav').remove()")
            tab.locator(f"#s-{section}").scroll_into_view_if_needed()
            tab.wait_for_timeout(1500)
            tab.locator(f"#s-{section}").screenshot(path=out)
        else:
            tab.wait_for_timeout(1500)
            tab.screenshot(path=out)
        browser.close()
    say(f"written: {out}")
