"""Runs the examples of the integrator's guide, one after the other, as they stand there.

    examples.py PROGRAMS
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile

from bench import Bench

GUIDE = pathlib.Path(__file__).parents[3] / "docs/integrators-guide.md"


def examples(text):
    """Each example: its language, its text, and the line that it begins in."""
    for match in re.finditer(r"^```(sh|python)\n(.*?)^```$", text, re.M | re.S):
        yield match[1], match[2], text.count("\n", 0, match.start(2)) + 1


def main():
    programs = pathlib.Path(sys.argv[1]).resolve()
    scanner = ["--columns", "60", "--samples", "80", "--line-rate", "200"]
    with tempfile.TemporaryDirectory() as folder:
        with Bench(programs, folder, scanner) as bench:
            work = pathlib.Path(folder) / "work"
            work.mkdir()
            environment = {
                **os.environ,
                "RELIEF_URL": bench.url,
                "RELIEF_TOKEN": bench.token,
            }
            count = 0
            for language, text, line in examples(GUIDE.read_text()):
                print(f"{GUIDE.name}:{line}: {language}", flush=True)
                command = {
                    "sh": ["bash", "-euo", "pipefail", "-c", text],
                    "python": [sys.executable, "-c", text],
                }[language]
                subprocess.run(
                    command, check=True, cwd=work, env=environment, timeout=120
                )
                count += 1
            assert count > 8, f"only {count} examples"
            print(f"{count} examples hold")


if __name__ == "__main__":
    main()
