"""The page of a bench whose jobs are done by a worker elsewhere, by way of a NATS server."""

import subprocess
import tempfile

from playwright.sync_api import expect

from bench import Bench, free_port
from browser import Page

LOOKS = [("phone", "dark", "ko"), ("desk", "light", "en")]


def judge(programs, opened, pictures):
    """The machine room tells of the worker, and the job of who has done it."""
    port = free_port()
    with tempfile.TemporaryDirectory() as folder:
        server = ["nats-server", "-a", "127.0.0.1", "-p", str(port), "-js", "-sd", f"{folder}/nats"]
        quiet = dict(stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        nats = subprocess.Popen(server, **quiet)
        servers = f"[nats]\nservers = [\"nats://127.0.0.1:{port}\"]\nbench = \"bench-7\"\n"
        scanner = ["--columns", "60", "--samples", "64"]
        try:
            with Bench(programs, folder, scanner, servers) as bench:
                bench.start("relief", "worker", "--connect", f"nats://127.0.0.1:{port}",
                            "--name", "hall-1", "--work-dir", folder)
                there = lambda: [one["name"] for one in bench.get("/v1/fleet")["workers"]]
                bench.wait(lambda: "hall-1" in there())
                bench.scan("house")
                for size, theme, language in LOOKS:
                    look = dict(size=size, theme=theme, language=language)
                    with Page(opened, bench, "#/room", **look) as shown:
                        expect(shown.page.get_by_role("cell", name="hall-1")).to_be_visible()
                        expect(shown.page.get_by_role("heading", name="bench-7")).to_be_visible()
                        name = f"fleet-{size}-{theme}-{language}"
                        shown.page.screenshot(path=str(pictures / f"{name}.png"), full_page=True)
                        shown.axe(name)
                nats.kill()
                nats.wait()
                with Page(opened, bench, "#/room") as shown:
                    region = shown.page.get_by_role("region", name="Workers on other machines")
                    expect(region.get_by_text("trouble", exact=True)).to_be_visible(timeout=30_000)
                    shown.page.screenshot(path=str(pictures / "fleet-away.png"), full_page=True)
        finally:
            nats.kill()
            nats.wait()
