#!/usr/bin/env python3
"""Tables of what the judge said: classes, sizes, nesting, uncertainties, rebuilt solids, seconds.

    python report.py --set NAME=FILE [--set NAME=FILE ...] [--page FILE | --check SET]

Each FILE is the JSON list of `judge.py`; NAME is `published`, `published-0` (not turned), `random`,
`odd`, or `random` with the network's answer replaced: `random-plain`, `random-chance`. Prints
Markdown, or writes it to a page; `--check` exits with 1 where a figure of the set is beyond its bar.
"""

import argparse
import json
import math
import statistics
import sys

CLASSES = ["block", "pocket", "slot", "step", "hole", "boss", "countersink", "chamfer", "round",
           "fillet"]
GROUPS = (("diameter", ("diameter",)), ("centre x, y", ("centre x", "centre y")),
          ("length, width", ("length", "width")), ("depth, height", ("depth", "height")),
          ("level of the centre", ("centre z",)),
          ("radius of corner or edge, width of chamfer", ("corner_radius", "radius")))
# Root mean square errors on the published part, millimetres.
BARS_MM = {"diameter": 0.03, "centre x, y": 0.035, "length, width": 0.05, "depth, height": 0.05}
RECALL, PRECISION, COVERED = 0.98, 0.98, (0.90, 0.98)
SOLID_MM, SECONDS_1M = 0.1, 3.0


def asked(parts):
    """Features other than blocks that the scans show."""
    return [f for p in parts for f in p["features"]
            if f["type"] != "block" and not f["out_of_view"]]


def classes(parts):
    """Of each class how many there are, found as such, and called so that are not."""
    table = {c: {"there": 0, "right": 0, "called": 0} for c in CLASSES}

    def of(kind):
        return table.setdefault(kind, {"there": 0, "right": 0, "called": 0})

    for part in parts:
        for feature in part["features"]:
            if feature["out_of_view"]:
                continue
            of(feature["type"])["there"] += 1
            of(feature["type"])["right"] += feature["found"] == feature["type"]
            if feature["found"]:
                of(feature["found"])["called"] += 1
        for more in part["more"]:
            of(more["type"])["called"] += 1
    return table


def rates(parts):
    """Recall and precision over all features but blocks; what is called unknown is a miss, and no
    false name."""
    table = classes(parts)
    kinds = [k for k in table if k != "block"]
    there = sum(table[k]["there"] for k in kinds)
    right = sum(table[k]["right"] for k in kinds)
    called = sum(table[k]["called"] for k in kinds if k != "unknown")
    return right, there, called


def share(part, whole):
    return f"{100.0 * part / whole:.1f} %" if whole else "-"


def class_table(parts):
    yield "| class | there | found | recall | called so | precision |"
    yield "| --- | ---: | ---: | ---: | ---: | ---: |"
    for kind, row in classes(parts).items():
        if row["there"] == row["called"] == 0:
            continue
        precision = "-" if kind == "unknown" else share(row["right"], row["called"])
        yield (f"| {kind} | {row['there']} | {row['right']} | {share(row['right'], row['there'])} "
               f"| {row['called']} | {precision} |")
    right, there, called = rates(parts)
    yield (f"| all but blocks | {there} | {right} | {share(right, there)} | {called} "
           f"| {share(right, called)} |")


def confusion(parts):
    """Rows: what is there; columns: what it is called."""
    counts = {}
    for part in parts:
        for feature in part["features"]:
            if not feature["out_of_view"]:
                key = (feature["type"], feature["found"] or "missing")
                counts[key] = counts.get(key, 0) + 1
        for more in part["more"]:
            key = ("nothing", more["type"])
            counts[key] = counts.get(key, 0) + 1
    rows = [c for c in [*CLASSES, "nothing"] if any(k[0] == c for k in counts)]
    called = {k[1] for k in counts}
    columns = [c for c in [*CLASSES, "unknown", "missing"] if c in called]
    columns += sorted(called - set(columns))
    yield "| there \\ called | " + " | ".join(columns) + " |"
    yield "| --- |" + " ---: |" * len(columns)
    for row in rows:
        cells = [str(counts.get((row, column), "")) for column in columns]
        yield f"| {row} | " + " | ".join(cells) + " |"


def sizes(parts):
    """All numbers that were asked for, with their parts."""
    for part in parts:
        for feature in part["features"]:
            for row in feature.get("sizes", []):
                yield part, feature, row


def group_of(feature, row):
    if feature["type"] == "chamfer" and row["name"] == "width":
        return GROUPS[5][0]
    for name, members in GROUPS:
        if row["name"] in members:
            return name
    return None


def figures(parts):
    """By group of sizes: errors and stated uncertainties."""
    found = {name: {"errors": [], "sigmas": [], "untold": 0} for name, _ in GROUPS}
    for _, feature, row in sizes(parts):
        group = group_of(feature, row)
        if group is None or not row["asked"]:
            continue
        if row["error"] is None:
            found[group]["untold"] += 1
        else:
            found[group]["errors"].append(row["error"])
            found[group]["sigmas"].append(row["sigma"])
    return found


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values)) if values else math.nan


def covered(own):
    pairs = [(e, s) for e, s in zip(own["errors"], own["sigmas"]) if s]
    return sum(abs(e) <= 1.96 * s for e, s in pairs), len(pairs)


def size_table(parts, bars):
    yield ("| size | told | not told | bias, mm | rms, mm | bar, mm | median of errors, mm "
           "| beyond 0.5 mm | in the 95 % interval | median half-width, mm |")
    yield "| --- |" + " ---: |" * 9
    for name, own in figures(parts).items():
        errors = own["errors"]
        if not errors and not own["untold"]:
            continue
        inside, stated = covered(own)
        widths = [1.96 * s for s in own["sigmas"] if s]
        bar = f"{bars[name]}" if name in bars else ""
        bias = sum(errors) / len(errors) if errors else math.nan
        middle = statistics.median(abs(e) for e in errors) if errors else math.nan
        width = f"{statistics.median(widths):.4f}" if widths else "-"
        yield (f"| {name} | {len(errors)} | {own['untold']} | {bias:+.4f} | {rms(errors):.4f} "
               f"| {bar} | {middle:.4f} | {sum(abs(e) > 0.5 for e in errors)} "
               f"| {share(inside, stated)} of {stated} | {width} |")


def all_covered(parts):
    inside = stated = 0
    for own in figures(parts).values():
        i, s = covered(own)
        inside, stated = inside + i, stated + s
    return inside, stated


def nested(parts):
    known = [f for f in asked(parts) if "parent_right" in f and f["found"] == f["type"]]
    return sum(f["parent_right"] for f in known), len(known)


def misleading(parts):
    return [(part["name"], feature["type"], row["name"], row["error"], row["sigma"])
            for part, feature, row in sizes(parts) if row["misleads"]]


def whole(part):
    """All found and rightly nested, and nothing besides."""
    seen = [f for f in part["features"] if not f["out_of_view"]]
    return (all(f["found"] == f["type"] and f.get("parent_right") for f in seen)
            and not [m for m in part["more"] if m["type"] != "unknown"])


def solids(parts):
    made = [p["solid"] for p in parts if "solid" in p]
    sound = [s for s in made if s.get("is_read") and s["solids"] == 1 and s["is_valid"]
             and s["is_closed"] and s["volume_mm3"] > 0.0]
    near = [s for s in sound if s["rms_mm"] <= SOLID_MM]
    return made, sound, near


def text_of(name, parts):
    right, there, called = rates(parts)
    yield f"{len(parts)} scans, {there} features besides the blocks; " + conditions(parts)
    yield ""
    missing = [p["name"] for p in parts if p.get("no_answer")]
    if missing:
        yield f"No answer for {len(missing)}: {', '.join(missing[:20])}."
        yield ""
    yield from class_table(parts)
    yield ""
    yield "What is there (rows), and what it is called (columns):"
    yield ""
    yield from confusion(parts)
    yield ""
    yield from size_table(parts, BARS_MM if name.startswith("published") else {})
    yield ""
    inside, stated = all_covered(parts)
    under, known = nested(parts)
    lost = misleading(parts)
    yield f"- In the stated 95 % interval: {share(inside, stated)} of {stated} numbers."
    yield f"- Rightly nested: {under} of {known} that were recognised."
    yield f"- All features found, rightly nested, and nothing besides: {sum(map(whole, parts))} of " \
          f"{len(parts)} scans."
    yield f"- Off by more than {2.0:g} pitches and 5 stated uncertainties without a warning: " \
          f"{len(lost)} numbers."
    there = sum(p["patterns"]["there"] for p in parts)
    if there:
        found = sum(p["patterns"]["found"] for p in parts)
        more = sum(p["patterns"]["more"] for p in parts)
        yield f"- Patterns of equal holes: {found} of {there} with all members; {more} besides."
    through = [row for _, _, row in sizes(parts) if row["name"] == "through" and row["asked"]]
    if through:
        wrong = sum(row["error"] != 0.0 for row in through)
        yield f"- Through or blind told wrongly: {wrong} of {len(through)} holes."
    made, sound, near = solids(parts)
    if made:
        off = [s["rms_mm"] for s in sound]
        yield (f"- Rebuilt solids: {len(made)}, one valid closed solid in {len(sound)}; to the "
               f"part's visible faces within {SOLID_MM} mm rms in {len(near)}"
               + (f" (median {statistics.median(off):.4f}, most {max(off):.4f} mm)." if off else "."))
        faces = sum(s["faces_judged"] for s in sound)
        yield (f"- Faces of them beyond {SOLID_MM} mm rms: {sum(s['faces_off'] for s in sound)} of "
               f"{faces} that the scanner saw.")
    seconds = sorted(p["seconds"] for p in parts if "seconds" in p)
    if seconds:
        yield f"- Seconds for a scan: median {statistics.median(seconds):.2f}, most {seconds[-1]:.2f}."


def conditions(parts):
    def span(name, scale=1.0, unit=""):
        values = [p[name] * scale for p in parts]
        low, high = f"{min(values):.4g}", f"{max(values):.4g}"
        return f"{low}{unit}" if low == high else f"{low} to {high}{unit}"

    return (f"pitch {span('pitch_mm')} mm, noise {span('noise_mm')} mm, outliers "
            f"{span('outliers', 100.0)} %, {span('on_part')} samples of the part.")


def side_by_side(sets):
    """The network's part in it: the same scans with its answer and without."""
    rows = [("random", "as delivered"), ("random-plain", "9-15-6 of the paper"),
            ("random-chance", "answer by chance")]
    rows = [(key, words) for key, words in rows if key in sets]
    if len(rows) < 2:
        return
    yield "| network | features | recall | precision | rightly nested | unknown |"
    yield "| --- | ---: | ---: | ---: | ---: | ---: |"
    for key, words in rows:
        right, there, called = rates(sets[key])
        under, known = nested(sets[key])
        unknown = classes(sets[key]).get("unknown", {"called": 0})["called"]
        yield (f"| {words} | {there} | {share(right, there)} | {share(right, called)} "
               f"| {share(under, known)} | {unknown} |")


def odd_table(parts):
    yield "| scan | recognised | unknown | besides | misleading numbers | warnings | verdict |"
    yield "| --- | ---: | ---: | ---: | ---: | ---: | --- |"
    for part in parts:
        seen = [f for f in part["features"] if not f["out_of_view"]]
        warned = sum(f["warned"] for f in part["features"]) + sum(m["warned"] for m in part["more"])
        unknown = sum(m["type"] == "unknown" for m in part["more"]) + sum(
            f["found"] == "unknown" for f in seen)
        besides = sum(m["type"] != "unknown" for m in part["more"])
        yield (f"| {part['name']} | {sum(f['found'] == f['type'] for f in seen)} of {len(seen)} "
               f"| {unknown} | {besides} | {len(misleading([part]))} | {warned} "
               f"| {'holds' if not odd_faults(part) else '; '.join(odd_faults(part))} |")


def odd_faults(part):
    """What is stated without a warning and is not so."""
    faults = [f"a {m['type']} that is not there" for m in part["more"]
              if m["type"] != "unknown" and not m["warned"]]
    for feature in part["features"]:
        if feature["out_of_view"]:
            continue
        if feature["found"] is None:
            # It may be left out where it is cut, and nowhere else.
            if not feature["cut"]:
                faults.append(f"no {feature['type']}")
        elif feature["found"] not in (feature["type"], "unknown") and not feature["warned"]:
            faults.append(f"a {feature['type']} called {feature['found']}")
        if feature["cut"] and feature["found"] == feature["type"] and not feature["warned"]:
            faults.append(f"a {feature['type']} that is cut, without a warning")
    faults += [f"{kind}'s {name} off by {error:.2f} mm" for _, kind, name, error, _ in
               misleading([part])]
    return faults


def failures(name, parts):
    """What is beyond its bar."""
    out = [f"{p['name']}: no answer" for p in parts if p.get("no_answer")]
    if name == "random-chance":
        # Were it as good, the network would decide nothing.
        right, there, _ = rates(parts)
        return out + ([f"recall {share(right, there)}, though answers are by chance"]
                      if right > 0.5 * there else [])
    if name == "random-plain":
        return out
    if name.startswith("odd"):
        return out + [f"{p['name']}: {fault}" for p in parts for fault in odd_faults(p)]
    right, there, called = rates(parts)
    if right < RECALL * there:
        out.append(f"recall {share(right, there)}")
    if right < PRECISION * called:
        out.append(f"precision {share(right, called)}")
    made, sound, near = solids(parts)
    answered = sum(not p.get("no_answer") for p in parts)
    if len(sound) < answered:
        out.append(f"{answered - len(sound)} parts without a valid closed solid")
    if len(near) < len(sound):
        out.append(f"{len(sound) - len(near)} solids farther than {SOLID_MM} mm rms from the part")
    inside, stated = all_covered(parts)
    # Of few numbers the share scatters: three standard deviations of it are granted.
    slack = 3.0 * math.sqrt(0.05 * 0.95 / stated) if stated and stated < 2000 else 0.0
    if not stated or not COVERED[0] - slack <= inside / stated <= min(1.0, COVERED[1] + slack):
        out.append(f"95 % intervals cover {share(inside, stated)}")
    out += [f"{part}: {kind}'s {number} off by {error:.2f} mm without a warning"
            for part, kind, number, error, _ in misleading(parts)]
    if name.startswith("published"):
        out += [f"{p['name']}: not all found and rightly nested" for p in parts if not whole(p)]
    if name == "published":
        for group, bar in BARS_MM.items():
            own = figures(parts)[group]
            # A bar of rms on few numbers is allowed what chance makes of it.
            allowed = bar * (1.0 + 2.0 / math.sqrt(max(1, len(own["errors"]))))
            if len(own["errors"]) >= 100:
                allowed = bar
            if own["untold"] or not rms(own["errors"]) <= allowed:
                out.append(f"{group}: rms {rms(own['errors']):.4f} mm, bar {bar} mm, "
                           f"{own['untold']} not told")
    return out


TITLES = {"published": "The published part, turned by 5 degrees",
          "published-0": "The published part, not turned",
          "random": "Random parts", "random-plain": "Random parts, the plain network",
          "random-chance": "Random parts, the network's answer replaced by chance",
          "odd": "Parts of which little can be told"}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--set", action="append", required=True, metavar="NAME=FILE")
    parser.add_argument("--preface", help="what the page begins with")
    parser.add_argument("--seconds", help="what is said of the scan of a million points")
    parser.add_argument("--page")
    parser.add_argument("--check", action="store_true")
    arguments = parser.parse_args()
    sets = {}
    for words in arguments.set:
        name, path = words.split("=", 1)
        with open(path, encoding="utf-8") as file:
            sets[name] = json.load(file)
    lines = []
    if arguments.preface:
        with open(arguments.preface, encoding="utf-8") as file:
            lines += [file.read().rstrip(), ""]
    for name, parts in sets.items():
        lines += [f"## {TITLES.get(name, name)}", ""]
        lines += list(odd_table(parts) if name == "odd" else text_of(name, parts))
        lines.append("")
    if list(side_by_side(sets)):
        lines += ["## What the network decides", "", *side_by_side(sets), ""]
    if arguments.seconds:
        lines += ["## A million points", "", arguments.seconds, ""]
    text = "\n".join(lines)
    if arguments.page:
        with open(arguments.page, "w", encoding="utf-8") as file:
            file.write(text)
    else:
        print(text)
    if arguments.check:
        failed = [f"{TITLES.get(name, name)}: {fault}"
                  for name, parts in sets.items() for fault in failures(name, parts)]
        if failed:
            sys.exit("does not hold:\n  " + "\n  ".join(failed))


if __name__ == "__main__":
    main()
