"""Has schemathesis ask the API for everything that its description allows, and for what it
does not; has promtool read the metrics, if it is there.

    api.py PROGRAMS [--seconds N] [--seed N]

PROGRAMS is the folder of the release programs. Fails if anything is answered by a fault of the
service, or by what the description does not have.
"""

import argparse
import pathlib
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


def promtool(bench):
    text = bench.request("GET", "/v1/metrics").read().decode()
    assert text.endswith("# EOF\n"), text
    if not shutil.which("promtool"):
        print("promtool is not there: the metrics are not judged")
        return
    rules = HERE.parents[2] / "config/monitoring/relief.rules.yml"
    subprocess.run(["promtool", "check", "rules", str(rules)], check=True)
    # It reads the older of the two formats, which has no unit and no end.
    older = [line for line in text.splitlines() if not line.startswith(("# UNIT", "# EOF"))]
    older = "\n".join(older) + "\n"
    told = subprocess.run(["promtool", "check", "metrics"], input=older, text=True)
    assert told.returncode in (0, 3), "promtool cannot read the metrics"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("programs", type=pathlib.Path)
    parser.add_argument("--seconds", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    scanner = ["--columns", "40", "--samples", "64", "--line-rate", "400"]
    with tempfile.TemporaryDirectory() as folder:
        with Bench(options.programs.resolve(), folder, scanner) as bench:
            # Something to ask for.
            bench.scan("part")
            promtool(bench)
            assert refused(bench, "/v1/status", {}) == 401
            schemathesis(bench, options.seconds, options.seed)
            # It still works.
            bench.scan("after")


if __name__ == "__main__":
    main()
