"""The page's measurement of the device that shows it: how long it takes, and how long the page does not answer."""

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

#: what chromium is called on today's systems, and what makes it draw and compute in software
NAMES = ("chromium", "chromium-browser", "google-chrome")
OPTIONS = (
    "--no-sandbox", "--disable-dev-shm-usage", "--enable-unsafe-swiftshader", "--enable-unsafe-webgpu",
    "--use-webgpu-adapter=swiftshader",
)  # fmt: skip
#: seconds from the click to the result, and milliseconds of the longest task of the page's own thread
SECONDS, BLOCKED = 15.0, 100.0
#: milliseconds that a browser waits for the end of a measurement
PATIENCE = 300_000
DONE = "#measure-save, #measure-result .problem"
#: tasks of 50 ms and more, from the click on
WATCH = """
window.tasks = [];
new PerformanceObserver((list) => {
  tasks.push(...list.getEntries().map((one) => one.duration));
}).observe({type: 'longtask'});
"""
#: a task that must be seen; else none would be a good sign
PLANTED = """
new Promise((seen) => setTimeout(() => {
  const end = performance.now() + 150;
  while (performance.now() < end);
  const look = () => tasks.length ? seen(tasks.splice(0).length) : setTimeout(look, 10);
  look();
}))
"""
#: a browser whose page finds no WebGPU
NO_WEBGPU = "export const open = async () => null;"


@dataclass
class Found:
    """Of each way to the device: what was told, the seconds it took, and the longest task; faults are missed bars."""

    told: dict[str, str] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    blocked: dict[str, float] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)

    def judged(self, way: str) -> None:
        """Hold one way against the bars."""
        if f"by {way}, " not in self.told[way]:
            self.faults.append(f"{way}: {self.told[way]}")
        if self.seconds[way] > SECONDS:
            self.faults.append(f"{way}: {self.seconds[way]:.1f} s from the click to the result")
        if self.blocked[way] > BLOCKED:
            self.faults.append(f"{way}: the page did not answer for {self.blocked[way]:.0f} ms")


def measured(runs: Path) -> Found:
    """Press the button in a browser on a server of its own, once for each way."""
    from playwright.sync_api import sync_playwright

    found = Found()
    with _serving(runs) as url, sync_playwright() as playwright:
        path = next(filter(None, map(shutil.which, NAMES)), None)
        browser = playwright.chromium.launch(executable_path=path, args=OPTIONS)
        for way in ("WebGPU", "WebGL 2"):
            page = browser.new_page()
            page.set_default_timeout(PATIENCE)
            if way == "WebGL 2":
                page.context.route("**/measure/webgpu.js", _without_webgpu)
            page.goto(url)
            page.wait_for_selector('#main[aria-busy="false"]')
            page.evaluate(WATCH)
            page.evaluate(PLANTED)
            page.locator("#measure").click()
            began = page.evaluate("performance.now()")
            page.wait_for_selector(DONE)
            found.seconds[way] = (page.evaluate("performance.now()") - began) / 1e3
            found.told[way] = page.locator("#measure-result").inner_text()
            found.blocked[way] = max(page.evaluate("tasks"), default=0.0)
            found.judged(way)
            page.close()
        browser.close()
    return found


def _without_webgpu(route: Any) -> None:
    route.fulfill(body=NO_WEBGPU, content_type="text/javascript")


@contextmanager
def _serving(runs: Path) -> Iterator[str]:
    command = [sys.executable, "-m", "phongbench", "serve", "--port", "0", "--runs", str(runs)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server:
        said = ""
        for line in server.stderr or ():
            said += line
            if "ready" in line:
                break
        yield re.findall(r"serves (\S+)", said)[0]
        server.terminate()
