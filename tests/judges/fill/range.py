"""An independent judge of filled range images: which holes `relief convert --fill` closes, and which it keeps.

usage: range.py RELIEF SCANNER --out DIR [--seeds A..=B] [--short] [--off] [--write PAGE.md]

Parts with drilled holes, glossy and stained (`range_parts.py`), are scanned by SCANNER (`study-features`), and
each scan is converted twice by RELIEF: without filling and with it. OpenCASCADE reads both IGES files; every inner
loop of every face, and what the faces cover, are held against the part. Ends with 1 where a bar is missed. Nothing
here shares code with the command.
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent

import range_loops
import range_planted
import range_tables

# The largest hole that is to be filled, millimetres.
MOST_MM = 15.0
JUDGING = (51, 100)
SHORT = (51, 56)
FILL = ("--fill", "auto", "--fill-max-mm", str(MOST_MM))


def run(words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, words))}: {done.stderr.strip()[-500:]}")


def one(options, seed):
    """Makes, scans, converts and judges a part."""
    out = options.out
    if not options.kept:
        # The scanner leaves alone what it has scanned.
        (out / f"{seed}.seen.json").unlink(missing_ok=True)
        run([sys.executable, "-B", HERE / "range_parts.py", "--anew", "--out", out, seed])
    run([options.scanner, "scan", out, seed])
    answers = {}
    for name, more in (("off", ()), ("on", FILL)):
        if name == "on" and options.off:
            continue
        igs, report = out / f"{seed}.{name}.igs", out / f"{seed}.{name}.json"
        # One scan on each processor.
        run([options.relief, "convert", out / f"{seed}.scan", "-o", igs, "--report", report, "--threads", 1, *more])
        answers[name] = (igs, report)
    return range_loops.judge(out / f"{seed}.json", answers, MOST_MM)


def seeds(text):
    first, _, last = text.partition("..=")
    try:
        return range(int(first), int(last or first) + 1)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text} is not like 51..=100") from None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("relief", help="the command")
    parser.add_argument("scanner", help="study-features, which scans")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder of parts, scans and answers")
    parser.add_argument("--seeds", type=seeds, help="51..=100 is for judging; others have been looked at")
    parser.add_argument("--short", action="store_true", help="the first six parts")
    parser.add_argument("--kept", action="store_true", help="with parts and scans that an earlier run has left")
    parser.add_argument("--off", action="store_true", help="without filling: what there is to be filled")
    parser.add_argument("--write", type=pathlib.Path, help="put the tables into this page")
    options = parser.parse_args()
    whole = range(JUDGING[0], JUDGING[1] + 1)
    options.seeds = options.seeds or (range(SHORT[0], SHORT[1] + 1) if options.short else whole)
    if options.write and (options.off or options.kept or options.seeds != whole):
        sys.exit("--write wants the whole judgement")
    options.out.mkdir(parents=True, exist_ok=True)
    range_planted.run()
    told, failed = [], []
    with concurrent.futures.ProcessPoolExecutor(os.cpu_count()) as pool:
        waiting = [(seed, pool.submit(one, options, seed)) for seed in options.seeds]
        for seed, work in waiting:
            try:
                told.append(work.result())
            except RuntimeError as error:
                failed.append(f"part {seed}: {error}")
                print(failed[-1], flush=True)
                continue
            print(range_tables.line(told[-1]), flush=True)
    (out := options.out / "judged.json").write_text(json.dumps(told, indent=1))
    print(f"all that was judged is in {out}")
    page = range_tables.page(told, MOST_MM)
    print(page)
    missed = failed + range_tables.missed(told)
    if options.write:
        head = options.write.read_text().split(range_tables.BEGIN)[0]
        options.write.write_text(head + page)
    for bar in missed:
        print("missed:", bar)
    if missed:
        sys.exit(1)
    print("every bar is held")


if __name__ == "__main__":
    main()
