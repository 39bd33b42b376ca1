"""Has schemathesis ask the API for everything that its description allows, and for what it
does not; has promtool read the metrics, if it is there.

    api.py PROGRAMS [--seconds N] [--seed N]

PROGRAMS is the folder of the release programs. Fails if anything is answered by a fault of the
service, or by what the description does not have.
"""

import argparse
import base64
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.error

from bench import Bench

HERE = pathlib.Path(__file__).parent

CHECKS = [
    "no_fault_of_the_service",
    "status_code_conformance",
    "content_type_conformance",
    "response_headers_conformance",
    "response_schema_conformance",
    "negative_data_rejection",
    "ignored_auth",
    "unsupported_method",
]


def refused(bench, path, fields):
    """The status of a request without the judge's token."""
    bearer, bench.token = bench.token, "x"
    try:
        bench.request("GET", path, fields=fields).close()
    except urllib.error.HTTPError as error:
        return error.code
    finally:
        bench.token = bearer
    return 200


def schemathesis(bench, seconds, seed):
    program = pathlib.Path(sys.executable).parent / "st"
    command = [
        str(program),
        "run",
        f"{bench.url}/v1/openapi.json",
        "--header",
        f"Authorization:Bearer {bench.token}",
        "--checks",
        ",".join(CHECKS),
        "--phases",
        "examples,coverage,fuzzing,stateful",
        "--max-time",
        str(seconds),
        "--seed",
        str(seed),
        "--request-timeout",
        "30",
        "--continue-on-failure",
        # A stream that has no end.
        "--exclude-path",
        "/v1/events",
        "--suppress-health-check",
        "all",
    ]
    environment = {"SCHEMATHESIS_HOOKS": "hooks", "PATH": "/usr/bin:/bin", "PYTHONPATH": str(HERE)}
    subprocess.run(command, check=True, env=environment, cwd=bench.folder)


def expressions(part):
    """Everything that a dashboard asks Prometheus."""
    if isinstance(part, dict):
        if isinstance(part.get("expr"), str):
            yield part["expr"]
        part = list(part.values())
    if isinstance(part, list):
        for one in part:
            yield from expressions(one)


def promtool(bench):
    text = bench.request("GET", "/v1/metrics").read().decode()
    assert text.endswith("# EOF\n"), text
    monitoring = HERE.parents[2] / "config/monitoring"
    rules = monitoring / "relief.rules.yml"
    asked = list(expressions(json.loads((monitoring / "relief.dashboard.json").read_text())))
    assert asked
    # What they ask for is there; a counter is known from its start, a histogram by its parts.
    known = set(re.findall(r"^# TYPE (\w+)", text, re.M))
    for name in re.findall(r"\brelief_\w+", "\n".join([rules.read_text(), *asked])):
        stem = re.sub(r"_(total|bucket|count|sum)$", "", name)
        assert {name, stem} & known, f"no metric is named {name}"
    if not shutil.which("promtool"):
        print("promtool is not there: the metrics are not judged")
        return
    subprocess.run(["promtool", "check", "rules", str(rules)], check=True)
    # The dashboard's, as rules that record them.
    recorded = [{"record": f"panel:{k}", "expr": expr} for k, expr in enumerate(asked)]
    panels = bench.folder / "panels.json"
    panels.write_text(json.dumps({"groups": [{"name": "dashboard", "rules": recorded}]}))
    subprocess.run(["promtool", "check", "rules", str(panels)], check=True)
    # It reads the older of the two formats, which has no unit and no end.
    older = [line for line in text.splitlines() if not line.startswith(("# UNIT", "# EOF"))]
    older = "\n".join(older) + "\n"
    told = subprocess.run(["promtool", "check", "metrics"], input=older, text=True)
    assert told.returncode in (0, 3), "promtool cannot read the metrics"


def end_scans(bench):
    """Ends what may still be under way, paused perhaps, and waits for the scanner."""
    try:
        bench.post("/v1/abort", {})
    except urllib.error.HTTPError as error:
        # Nothing was under way.
        assert error.code == 409, error

    def is_free():
        status = bench.get("/v1/status")
        return not status.get("scan") and status["scanner"]["link"] == "ready"

    bench.wait(is_free)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("programs", type=pathlib.Path)
    parser.add_argument("--seconds", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    scanner = ["--columns", "40", "--samples", "64", "--line-rate", "400"]
    with tempfile.TemporaryDirectory() as folder:
        secret = pathlib.Path(folder) / "secret"
        secret.touch(mode=0o600)
        secret.write_text("whsec_" + base64.b64encode(bytes(range(32))).decode())
        # Nobody listens there.
        webhook = f"""
[[webhooks]]
name = "away"
url = "http://127.0.0.1:9/"
secret_file = "{secret}"
"""
        with Bench(options.programs.resolve(), folder, scanner, webhook) as bench:
            # Something to ask for.
            bench.scan("part")
            promtool(bench)
            assert refused(bench, "/v1/status", {}) == 401
            schemathesis(bench, options.seconds, options.seed)
            # It still works, once it has done what was asked of it meanwhile.
            end_scans(bench)
            bench.scan("after", longest=60 + 2 * options.seconds)


if __name__ == "__main__":
    main()
