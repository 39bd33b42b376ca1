"""An independent judge of `relief fill`, side by side with MeshLab and MeshFix.

usage: judge.py RELIEF --out DIR --data DIR [--short] [--seed N] [--only PART ...] [--write PAGE.md]

Ends with 1 where a bar is missed. Nothing here shares code with the command: surfaces, cuts and distances
are NumPy's and SciPy's, meshes are checked by trimesh, libigl and CGAL.
"""

import argparse
import importlib.metadata
import pathlib
import sys

import accuracy
import many
import odd
import patches
import planted
import speed

# The page's text ends before this line; the tables follow.
TABLES = "## Known surfaces\n"
PACKAGES = ("pymeshlab", "pymeshfix", "libigl", "trimesh", "cadquery-ocp", "numpy", "scipy")
PARTS = ("surfaces", "patches", "random", "recorded", "formats", "speed", "odd")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("relief", help="the command")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder of the meshes")
    parser.add_argument("--data", type=pathlib.Path, required=True, help="folder of recorded meshes")
    parser.add_argument("--short", action="store_true", help="fewer holes, smaller meshes")
    parser.add_argument("--seed", type=int, default=9001, help="those below 1000 were looked at")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--write", type=pathlib.Path, help="put the tables into this page")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    planted.run()
    missed = []
    page = "\n\n".join(sections(options, missed)) + "\n"
    print(page)
    if options.write:
        if options.short or options.only != PARTS:
            sys.exit("--write wants the whole judgement")
        head = options.write.read_text().split(TABLES)[0]
        options.write.write_text(head + page)
    for one in missed:
        print("missed:", one)
    if missed:
        sys.exit(1)
    print("every bar is held")


def sections(options, missed):
    def part(name, work):
        if name not in options.only:
            return None
        print(name, flush=True)
        return work(options, options.out, missed)

    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in PACKAGES)
    rows = part("surfaces", accuracy.run)
    yield TABLES + f"\n{versions}. Seed {options.seed}."
    if rows:
        yield accuracy.table(rows)
        yield accuracy.verdict([row for row in rows if not row["case"].noise])
        yield "## With noise"
        yield accuracy.noise_table(rows)
        yield accuracy.verdict([row for row in rows if row["case"].noise])
    for title, name, work in (
        ("## Trimmed surfaces", "patches", patches.run),
        ("## Many holes", "random", many.random),
        ("## Recorded meshes", "recorded", many.recorded),
        ("## Formats", "formats", many.formats),
        ("## A large mesh", "speed", speed.many),
        ("## A long border", "speed", speed.points),
        ("## The paper's solve", "speed", speed.dense),
        ("## Odd input", "odd", odd.run),
    ):
        told = part(name, work)
        if told:
            yield title
            yield told
    if "speed" in options.only:
        yield f"Times are of {speed.machine()}."
    yield "## Bars\n\n" + bars(missed)


def bars(missed):
    if not missed:
        return "Every bar is held."
    return "Missed:\n\n" + "\n".join(f"- {one}" for one in missed)


if __name__ == "__main__":
    main()
