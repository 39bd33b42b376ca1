"""A real browser for judges: Debian's Chromium, driven by Playwright."""

import contextlib
import pathlib

import axe_playwright_python
from playwright.sync_api import sync_playwright

AXE = (pathlib.Path(axe_playwright_python.__file__).parent / "axe.min.js").read_text()

ARGUMENTS = [
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    # WebGL by the processor, where there is no graphics card.
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
]

SIZES = {"desk": (1440, 900), "phone": (360, 740), "wall": (3840, 2160)}


@contextlib.contextmanager
def browser():
    """A browser that is closed in the end."""
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=ARGUMENTS)
        yield opened
        opened.close()


class Page:
    """A page of the service, and everything that goes wrong on it."""

    def __init__(
        self,
        opened,
        bench,
        place="#/machine",
        size="desk",
        theme="light",
        language="en",
        token=True,
        touch=False,
    ):
        width, height = SIZES[size]
        self.context = opened.new_context(
            viewport={"width": width, "height": height},
            color_scheme=theme,
            locale=language,
            has_touch=touch,
            reduced_motion="reduce",
        )
        self.page = self.context.new_page()
        self.faults = []
        self.page.on("pageerror", lambda error: self.faults.append(str(error)))
        self.page.on("console", self._said)
        if token:
            script = f"sessionStorage.setItem('relief.token', {bench.token!r})"
            self.page.add_init_script(script)
        self.page.goto(f"{bench.url}/{place}")

    def _said(self, message):
        # What the browser says of refused and lost connections is no fault of the page.
        if message.type == "error" and "Failed to load resource" not in message.text:
            self.faults.append(message.text)

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        if kind is None:
            assert not self.faults, self.faults
        self.context.close()

    def axe(self, where):
        """No violation of accessibility, as axe knows them."""
        self.page.evaluate(AXE)
        found = self.page.evaluate("axe.run(document, {resultTypes: ['violations']})")
        told = [
            f"{violation['id']}: {node['html'][:120]}"
            for violation in found["violations"]
            for node in violation["nodes"]
        ]
        assert not told, f"{where}: {told}"

    def painted(self, locator):
        """How many pixels of the canvas in it are painted at all."""
        return locator.locator("canvas").first.evaluate(
            """(canvas) => {
                const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
                let count = 0;
                for (let k = 3; k < data.length; k += 4) if (data[k]) count += 1;
                return count;
            }"""
        )

    def colours(self, locator):
        """How many different colours a canvas shows, or what is drawn where it is."""
        shot = locator.screenshot()
        return self.page.evaluate(
            """async (png) => {
                const bytes = Uint8Array.from(atob(png), (c) => c.charCodeAt(0));
                const bitmap = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
                const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
                const context = canvas.getContext('2d');
                context.drawImage(bitmap, 0, 0);
                const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
                const seen = new Set();
                for (let k = 0; k < data.length; k += 4)
                    seen.add((data[k] << 16) | (data[k + 1] << 8) | data[k + 2]);
                return seen.size;
            }""",
            __import__("base64").b64encode(shot).decode(),
        )
