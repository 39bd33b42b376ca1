"""What watchers cost a scan: its line rate with 20 of them, and with none, in one run.

    watchers.py PROGRAMS [--watchers N] [--rounds N] [--check]

Each round takes a scan without and one with watchers, each of which reads all events, columns of
the range image included. `--check` fails below 98 %; for machines that have nothing else to do.
"""

import argparse
import datetime
import json
import pathlib
import statistics
import tempfile
import threading

from bench import Bench

LEAST = 0.98
COLUMNS = 800
LINE_RATE_HZ = 200


def watch(bench, stop, heard):
    """Reads events as they come."""
    columns = 0
    with bench.request("GET", "/v1/events") as stream:
        for line in stream:
            columns += line == b"event: column\n"
            if stop.is_set():
                break
    heard.append(columns)


def rate_hz(bench, name):
    """Columns a second from the first to the last of a scan, by the service's own clock."""
    with bench.request("GET", "/v1/events") as stream:
        scan = bench.post("/v1/scans", {"name": name})["id"]
        for line in stream:
            if not line.startswith(b"data: "):
                continue
            event = json.loads(line[6:])
            if event.get("id") == scan and event.get("state") == "complete":
                break
    record = bench.get(f"/v1/scans/{scan}")
    begun = datetime.datetime.fromisoformat(record["started_at"])
    ended = datetime.datetime.fromisoformat(record["ended_at"])
    job = record["jobs"][0]
    bench.wait(lambda: bench.get(f"/v1/jobs/{job}")["state"] != "running")
    return record["columns"] / (ended - begun).total_seconds()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("programs", type=pathlib.Path)
    parser.add_argument("--watchers", type=int, default=20)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    scanner = ["--columns", str(COLUMNS), "--samples", "128", "--line-rate", str(LINE_RATE_HZ)]
    ratios = []
    with tempfile.TemporaryDirectory() as folder:
        with Bench(options.programs.resolve(), folder, scanner) as bench:
            for number in range(options.rounds):
                alone = rate_hz(bench, f"alone-{number}")
                stop, heard = threading.Event(), []
                threads = [
                    threading.Thread(target=watch, args=(bench, stop, heard), daemon=True)
                    for _ in range(options.watchers)
                ]
                for thread in threads:
                    thread.start()
                watched = rate_hz(bench, f"watched-{number}")
                stop.set()
                # An event more, so that each looks whether it may go.
                bench.post("/v1/scans/preview")
                ratios.append(watched / alone)
                print(f"{alone:.1f} columns/s alone, {watched:.1f} watched: {ratios[-1]:.3f}")
    median = statistics.median(ratios)
    print(f"with {options.watchers} watchers {median:.3f} of the line rate (median)")
    assert not options.check or median >= LEAST, f"below {LEAST}"


if __name__ == "__main__":
    main()
