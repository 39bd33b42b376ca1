"""Has a real browser run the whole story of a scan on the page of the service.

    story.py PROGRAMS PICTURES

Screenshots of every view go into the folder PICTURES.
"""

import hashlib
import json
import pathlib
import shutil
import sys
import tempfile
import time

import fleet
from bench import Bench
from browser import Page, browser
from playwright.sync_api import expect

# Longer than anything takes that is waited for.
GUARD_MS = 60_000
expect.set_options(timeout=GUARD_MS)


class Story:
    def __init__(self, bench, opened, pictures):
        self.bench, self.opened, self.pictures = bench, opened, pictures

    def open(self, *place, **options):
        opened = Page(self.opened, self.bench, *place, **options)
        opened.page.set_default_timeout(GUARD_MS)
        return opened

    def shot(self, opened, name):
        opened.page.screenshot(path=str(self.pictures / f"{name}.png"), full_page=True)

    def wrong_token(self):
        with self.open(token=False) as opened:
            dialog = opened.page.get_by_role("dialog")
            dialog.get_by_label("Token").fill("relief_wrong")
            dialog.get_by_role("button", name="Sign in").click()
            expect(dialog.get_by_role("alert")).to_contain_text("does not know this token")
            self.shot(opened, "sign-in-wrong")
            opened.axe("sign in")
            dialog.get_by_label("Token").fill(self.bench.token)
            dialog.get_by_role("button", name="Sign in").click()
            expect(dialog).to_have_count(0)
            expect(opened.page.get_by_text("Laser off", exact=False).first).to_be_visible()

    def start(self, opened, name):
        page = opened.page
        page.get_by_role("button", name="Start scan").click()
        page.get_by_label("Name", exact=True).fill(name)
        page.get_by_label("Operator").fill("A. Judge")
        self.shot(opened, "start")
        page.get_by_role("button", name="Start \u2026").click()
        self.shot(opened, "start-sure")
        page.get_by_role("button", name="Laser on: start the scan").click()

    def columns(self):
        scan = self.bench.get("/v1/status").get("scan")
        return scan["columns"] if scan else None

    def whole_story(self):
        """Open, start, watch, pause, resume, finish, look at it in 3-D, download."""
        with self.open() as opened:
            page = opened.page
            expect(page.get_by_role("button", name="Start scan")).to_be_enabled()
            self.start(opened, "bracket")
            expect(page.get_by_text("LASER ON").first).to_be_visible()
            image = page.get_by_role("application", name="Range image")
            # Columns arrive: the picture grows. Its colours need not: they are spread anew over all of it.
            self.bench.wait(lambda: (self.columns() or 0) > 20)
            page.wait_for_timeout(500)
            colours, few = opened.colours(image), opened.painted(image)
            assert colours > 20, f"{colours} colours"
            since = self.columns()
            self.bench.wait(lambda: (self.columns() or 0) > since + 30)
            page.wait_for_timeout(500)
            more = opened.painted(image)
            assert more > few, f"{few} pixels, then {more}"
            image.hover(position={"x": 20, "y": 20})
            box = image.bounding_box()
            image.hover(position={"x": box["width"] * 0.4, "y": box["height"] * 0.5})
            self.shot(opened, "machine-scanning")
            opened.axe("machine, scanning")

            page.get_by_role("button", name="Pause").click()
            controls = page.get_by_role("group", name="Controls")
            resume = controls.get_by_role("button", name="Resume")
            expect(resume).to_be_visible()
            self.bench.wait(lambda: self.bench.get("/v1/status")["laser"]["laser"] == "off")
            expect(page.get_by_text("LASER ON")).to_have_count(0)
            stands = self.columns()
            page.wait_for_timeout(700)
            assert self.columns() == stands, "columns came during the pause"
            self.shot(opened, "machine-paused")
            opened.axe("machine, paused")
            resume.click()
            self.shot(opened, "resume-sure")
            page.get_by_role("button", name="Resume: laser on").click()
            self.bench.wait(lambda: (self.columns() or 0) > stands)

            # Another page that is opened in the midst of it has the whole image.
            with self.open() as other:
                late = other.page.get_by_role("application", name="Range image")
                other.page.wait_for_timeout(1000)
                assert other.painted(late) > more, "the page that came late lacks the beginning"

            scan = self.bench.get("/v1/scans?limit=1")["scans"][0]["id"]
            self.done(scan)
            page.goto(f"{self.bench.url}/#/scans")
            self.shot(opened, "scans")
            opened.axe("scans")
            self.result(opened, scan)
        return scan

    def done(self, scan):
        self.bench.wait(lambda: self.bench.get(f"/v1/scans/{scan}")["state"] == "complete")
        job = self.bench.get(f"/v1/scans/{scan}")["jobs"][0]
        self.bench.wait(lambda: self.bench.get(f"/v1/jobs/{job}")["state"] == "done")

    def result(self, opened, scan):
        page = opened.page
        page.goto(f"{self.bench.url}/#/result/{scan}")
        solid = page.get_by_role("application", name="face")
        expect(solid.first).to_be_visible()
        page.wait_for_timeout(1500)
        colours = opened.colours(solid.first)
        assert colours > 30, f"the 3-D view shows {colours} colours"
        before = solid.first.screenshot()
        solid.first.focus()
        for _ in range(6):
            page.keyboard.press("ArrowRight")
        page.wait_for_timeout(300)
        assert solid.first.screenshot() != before, "the 3-D view does not turn"
        page.get_by_label("Face", exact=True).select_option(index=1)
        self.shot(opened, "result")
        opened.axe("result")
        page.get_by_role("tab", name="Deviations").click()
        page.wait_for_timeout(1000)
        self.shot(opened, "result-deviations")
        opened.axe("result, deviations")
        with page.expect_download() as download:
            page.get_by_role("link", name="bracket.igs").first.click()
        content = pathlib.Path(download.value.path()).read_bytes()
        manifest = self.bench.get(f"/v1/spool/{scan}/manifest.json")
        listed = {file["name"]: file["sha256"] for file in manifest["files"]}
        assert hashlib.sha256(content).hexdigest() == listed["bracket.igs"]

    def preview(self, scan):
        with self.open(f"#/preview/{scan}") as opened:
            page = opened.page
            page.get_by_label("Grid pitch, mm").first.fill("1.2")
            page.get_by_role("button", name="Show", exact=True).click()
            expect(page.get_by_text("1.200 mm").first).to_be_visible()
            page.wait_for_timeout(500)
            self.shot(opened, "preview")
            opened.axe("preview")
        assert len(self.bench.get(f"/v1/scans/{scan}")["jobs"]) == 1, "a preview changes nothing"

    def aborted(self):
        with self.open() as opened:
            page = opened.page
            self.start(opened, "unwanted")
            self.bench.wait(lambda: (self.columns() or 0) > 5)
            page.get_by_role("button", name="Abort").first.click()
            self.shot(opened, "abort-sure")
            page.get_by_role("dialog").get_by_role("button", name="Abort").click()
            self.bench.wait(lambda: self.columns() is None)
            scan = self.bench.get("/v1/scans?limit=1")["scans"][0]
            assert scan["state"] == "aborted", scan
            expect(page.get_by_text("aborted").first).to_be_visible()
            self.shot(opened, "machine-aborted")

    def failed_job(self, scan):
        settings = {"settings": {"regrid.roi_x_mm": [900.0, 901.0]}}
        job = self.bench.post(f"/v1/scans/{scan}/rerun", settings)["id"]
        self.bench.wait(lambda: self.bench.get(f"/v1/jobs/{job}")["state"] == "failed")
        error = self.bench.get(f"/v1/jobs/{job}")["error"]
        with self.open("#/jobs") as opened:
            expect(opened.page.get_by_text(error[:40]).first).to_be_visible()
            self.shot(opened, "jobs-failed")
            opened.axe("jobs, one failed")

    def restarted(self):
        """The service is started anew while somebody watches."""
        with self.open() as opened:
            page = opened.page
            expect(page.get_by_role("button", name="Start scan")).to_be_enabled()
            self.bench.stop("reliefd")
            lost = page.get_by_role("region", name="Connection lost")
            expect(lost).to_be_visible()
            page.wait_for_timeout(1500)
            self.shot(opened, "machine-stale")
            opened.axe("machine, stale")
            self.bench.start("reliefd", "--config", str(self.bench.config))
            expect(lost).to_be_hidden()
            expect(page.get_by_role("button", name="Start scan")).to_be_enabled()
        assert self.bench.get("/v1/status")["scanner"]["link"]

    def keyboard(self):
        """From the address to a scan that is started and aborted, without a mouse."""
        self.bench.wait(lambda: self.bench.get("/v1/status")["scanner"]["link"] == "ready")
        with self.open() as opened:
            page = opened.page
            expect(page.get_by_role("button", name="Start scan")).to_be_enabled()
            press = page.keyboard.press
            press("Tab")
            expect(page.get_by_role("link", name="Skip to the content")).to_be_focused()
            press("Enter")
            self.tab_to(page, "Start scan")
            press("Enter")
            page.keyboard.type("by hand")
            self.tab_to(page, "Start \u2026")
            press("Enter")
            self.tab_to(page, "Laser on: start the scan")
            press("Enter")
            self.bench.wait(lambda: (self.columns() or 0) > 3)
            self.tab_to(page, "Abort")
            press("Enter")
            expect(page.get_by_role("dialog")).to_be_visible()
            self.tab_to(page, "Abort", within="dialog")
            press("Enter")
            self.bench.wait(lambda: self.columns() is None)
            # Out of a dialog by Escape, back to where one was.
            self.tab_to(page, "Start scan")
            press("Enter")
            press("Escape")
            expect(page.get_by_role("dialog")).to_have_count(0)
            expect(page.get_by_role("button", name="Start scan")).to_be_focused()

    def tab_to(self, page, name, within="body"):
        """Presses Tab until the focus is on a button of this name."""
        focused = f"""() => {{
            const at = document.activeElement;
            const said = at.getAttribute('aria-label') ?? at.textContent;
            return at.closest({within!r}) && at.tagName === 'BUTTON' && said.includes({name!r});
        }}"""
        # What it is for may have to come first.
        button = page.locator(within).get_by_role("button", name=name).first
        expect(button).to_be_enabled()
        for _ in range(60):
            if page.evaluate(focused):
                return
            page.keyboard.press("Tab")
        raise AssertionError(f"the keyboard does not reach {name}")

    def many_jobs(self, scan):
        """500 jobs in the list."""
        have = len(self.bench.get("/v1/jobs")["jobs"])
        jobs = []
        for _ in range(500 - have):
            job = self.bench.post(f"/v1/scans/{scan}/rerun", {"name": "again"})["id"]
            jobs.append(job)
            # They need not be done.
            try:
                self.bench.post(f"/v1/jobs/{job}/cancel")
            except OSError:
                pass
        with self.open("#/jobs") as opened:
            page = opened.page
            expect(page.get_by_text(f"{jobs[-1]}").first).to_be_visible()
            begun = time.monotonic()
            rows = page.get_by_role("main").get_by_role("listitem")
            while page.get_by_role("button", name="Show more").count():
                page.get_by_role("button", name="Show more").click()
                page.wait_for_timeout(100)
            expect(page.get_by_text("500 in all")).to_be_visible()
            assert rows.count() >= 500, rows.count()
            print(f"500 jobs are listed in {time.monotonic() - begun:.1f} s")

    def handed_on(self, scan, archive):
        """A program has run for the result, and a copy has gone elsewhere."""
        with self.open("#/room") as opened:
            page = opened.page
            page.get_by_role("button", name="Run check for the newest result").click()
            expect(page.get_by_text("check has done it")).to_be_visible(timeout=30_000)
            page.get_by_role("button", name="Copy the newest result to archive").click()
            expect(page.get_by_text("archive has done it")).to_be_visible(timeout=30_000)
        assert (archive / scan / "manifest.json").is_file()

    def looks(self, scan):
        """Every view, small and large, light and dark, in both languages."""
        views = {
            "machine": "#/machine",
            "scans": "#/scans",
            "jobs": "#/jobs",
            "result": f"#/result/{scan}",
            "preview": f"#/preview/{scan}",
            "room": "#/room",
        }
        looks = [
            ("phone", "light", "en"),
            ("phone", "dark", "ko"),
            ("desk", "dark", "en"),
            ("desk", "light", "ko"),
            ("wall", "dark", "ko"),
        ]
        for size, theme, language in looks:
            for name, place in views.items():
                look = dict(size=size, theme=theme, language=language, touch=size == "phone")
                with self.open(place, **look) as opened:
                    opened.page.wait_for_timeout(1500)
                    self.shot(opened, f"{name}-{size}-{theme}-{language}")
                    opened.axe(f"{name}, {size}, {theme}, {language}")
                    wide = opened.page.evaluate(
                        "document.documentElement.scrollWidth - document.documentElement.clientWidth"
                    )
                    assert wide <= 0, f"{name} on a {size} is {wide} px too wide"

    def first_paint(self):
        """How soon something is seen, and how much is sent for it."""
        with self.open() as opened:
            page = opened.page
            expect(page.get_by_role("button", name="Start scan")).to_be_enabled()
            painted = "performance.getEntriesByName('first-contentful-paint').length > 0"
            self.bench.wait(lambda: page.evaluate(painted))
            paint_ms, sent = page.evaluate(
                """() => [
                    performance.getEntriesByName('first-contentful-paint')[0].startTime,
                    performance.getEntries().reduce((all, e) => all + (e.transferSize ?? 0), 0),
                ]"""
            )
        print(f"first paint after {paint_ms:.0f} ms, {sent / 1000:.0f} kB sent")
        assert sent < 1_500_000, f"{sent} bytes"
        return paint_ms


def main():
    programs, pictures = map(pathlib.Path, sys.argv[1:3])
    pictures.mkdir(parents=True, exist_ok=True)
    # Slow enough to be watched.
    scanner = ["--columns", "240", "--samples", "256", "--line-rate", "10", "--noise-mm", "0.05"]
    with tempfile.TemporaryDirectory() as folder, browser() as opened:
        archive = pathlib.Path(folder) / "archive"
        archive.mkdir()
        doers = f"""
[[hooks]]
name = "check"
command = ["/bin/sh", "-c", "echo $RELIEF_NAME"]
[[uploads]]
name = "archive"
to = "folder"
folder = "{archive}"
"""
        with Bench(programs.resolve(), folder, scanner, doers) as bench:
            story = Story(bench, opened, pictures)
            story.first_paint()
            story.wrong_token()
            scan = story.whole_story()
            story.handed_on(scan, archive)
            story.preview(scan)
            story.failed_job(scan)
            story.aborted()
            story.restarted()
            story.keyboard()
            story.looks(scan)
            story.many_jobs(scan)
        if shutil.which("nats-server"):
            fleet.judge(programs.resolve(), opened, pictures)
    print(f"the story is told; its pictures are in {pictures}")


if __name__ == "__main__":
    main()
