"""A running page and a real browser on it, headless, for tests and benchmarks."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

CHROMIUM = "/usr/bin/chromium"
FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
ROOT = Path(__file__).parent.parent
LONG_MS = 900_000  # of a diagnosis on a busy machine
NEEDED = pytest.mark.skipif(
    not Path(CHROMIUM).exists(), reason=f"no {CHROMIUM}: `apt-get install chromium`"
)


@contextmanager
def chromium():
    """A browser; skips where nothing can drive one."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright drives the browser")
    with playwright.sync_playwright() as started:
        found = started.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield found
        found.close()


def heard():
    """Ctrl-C is heard also where these tests run in the background of a shell, which mutes it."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


class Served:
    """A running page, and browser tabs on it."""

    def __init__(self, browser, folder, *files):
        self.browser, self.folder = browser, folder
        self.asked = []
        self.process = subprocess.Popen(
            [sys.executable, "-m", "studies.command_line", "app", *files],
            cwd=folder, stdout=subprocess.PIPE, text=True, preexec_fn=heard,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip
        self.address = self.process.stdout.readline().split()[-1]

    def tab(self, width=1280, height=800, scale=1.0):
        size = {"width": round(width / scale), "height": round(height / scale)}
        found = self.browser.new_page(viewport=size, device_scale_factor=scale)
        found.set_default_timeout(LONG_MS)
        found.on("request", lambda request: self.asked.append(request.url))
        found.goto(self.address)
        return found

    def shot(self, page, name):
        folder = Path(os.environ.get("WORKBENCH_SCREENSHOTS", self.folder))
        page.wait_for_timeout(700)
        page.screenshot(path=folder / f"{name}.png", full_page=True)
        assert (folder / f"{name}.png").stat().st_size > 20_000

    def children(self):
        """Processes that the server started, by command."""
        listed = subprocess.run(
            ["ps", "-eo", "pid,ppid,args"], capture_output=True, text=True, check=True
        ).stdout.splitlines()
        return [line for line in listed if "forkserver" in line]

    def close(self):
        self.process.send_signal(signal.SIGINT)
        assert self.process.wait(120) == 0


def click(page, label):
    page.get_by_role("button", name=label, exact=True).last.click()


def drag(page, x, y, far, lift=True):
    """Draw a box to the right as slowly as a hand does; without ``lift`` it is still held."""
    page.mouse.move(x, y)
    page.wait_for_timeout(200)
    page.mouse.down()
    for k in range(1, 9):
        page.mouse.move(x + far * k / 8, y + 3 * k)
        page.wait_for_timeout(50)
    if lift:
        page.mouse.up()


def no_wider_than_the_window(page):
    """False where something still sticks out when the page has had time to lay itself out."""
    fits = "document.documentElement.scrollWidth <= window.innerWidth + 1"
    with suppress(Exception):  # a timeout: what is asked then tells
        page.wait_for_function(fits, timeout=20_000)
    return page.evaluate(fits)
