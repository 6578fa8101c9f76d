"""Visits of pages in a browser, and the windows that they are seen in."""

from dataclasses import dataclass, field
from typing import Any, Self
from urllib.parse import urlsplit

#: the page is told by this attribute when nothing is under way
IDLE = '#main[aria-busy="false"]'
#: what a page is seen in, unless a visit says otherwise
VIEW = {"width": 1280, "height": 900}
#: collected before any script of the page runs
WATCH = """
window.reports = [];
document.addEventListener('securitypolicyviolation', (event) => {
  reports.push(`${event.violatedDirective} ${event.blockedURI}`);
});
"""
#: resolves once a canvas shows something else; rejects after a while, so that no test waits forever
CHANGED = """
([selector, before]) => new Promise((done, failed) => {
  const end = performance.now() + 300_000;
  const look = () => {
    if (document.querySelector(selector)?.toDataURL() !== before) done();
    else if (performance.now() > end) failed(new Error(`${selector} shows the same as before`));
    else requestAnimationFrame(look);
  };
  look();
})
"""


@dataclass
class Visit:
    """A page in a browser, and what went wrong on it.

    errors   console errors and uncaught exceptions, in order
    foreign  addresses that were asked of other hosts; all of them are refused
    asked    paths with query that were asked of ours
    """

    page: Any
    errors: list[str] = field(default_factory=list)
    foreign: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)

    def idle(self) -> None:
        """Wait until nothing is under way."""
        self.page.wait_for_selector(IDLE)

    def picture(self, selector: str) -> str:
        """What a canvas shows."""
        return str(self.page.eval_on_selector(selector, "(canvas) => canvas.toDataURL()"))

    def changed(self, selector: str, before: str) -> None:
        """Wait until a canvas shows something else."""
        self.page.evaluate(CHANGED, [selector, before])

    def reports(self) -> list[str]:
        """Violations of the content security policy."""
        return list(self.page.evaluate("() => window.reports"))

    def refused(self) -> None:
        """The service refused something here, as it should: the browser's own notes of that are no errors."""
        self.idle()
        notes = [error for error in self.errors if "status of 422" in error]
        assert notes, "nothing was refused"
        self.errors[:] = [error for error in self.errors if error not in notes]

    def slide(self, selector: str, value: float) -> None:
        """Move a slider as a hand would: value, then input event."""
        self.page.locator(selector).fill(str(value))


@dataclass(eq=False)
class Window:
    """A page in a context of its own, which one visit after the other may use.

    page  of the browser
    seen  by the visit that uses it
    """

    page: Any
    seen: Visit | None = None

    @classmethod
    def opened(cls, browser: Any, options: dict[str, Any]) -> Self:
        """A new one."""
        context = browser.new_context(**{"viewport": VIEW, **options})
        context.set_default_timeout(300_000)
        context.add_init_script(WATCH)
        made = cls(context.new_page())
        made.page.on("console", lambda told: made.wrong(told.text) if told.type == "error" else None)
        made.page.on("pageerror", lambda problem: made.wrong(str(problem)))
        return made

    def wrong(self, text: str) -> None:
        """What went wrong is the matter of the visit, if there is one."""
        if self.seen:
            self.seen.errors.append(text)

    def load(self, address: str) -> Visit:
        """A visit of an address: what is asked of others is refused."""
        self.seen = made = Visit(self.page)
        host = urlsplit(address).netloc

        def routed(route: Any) -> None:
            parts = urlsplit(route.request.url)
            if parts.netloc == host:
                made.asked.append(parts.path + ("?" + parts.query if parts.query else ""))
                route.continue_()
            else:
                made.foreign.append(route.request.url)
                route.abort()

        self.page.context.route("**/*", routed)
        self.page.goto(address)
        return made

    def leave(self) -> Self:
        """Nothing of the visit stays but the process: no document, no route, the pointer at the corner."""
        self.seen = None
        self.page.unroute_all(behavior="ignoreErrors")
        self.page.context.unroute_all(behavior="ignoreErrors")
        self.page.goto("about:blank")
        self.page.set_viewport_size(VIEW)
        self.page.mouse.move(0, 0)
        return self
