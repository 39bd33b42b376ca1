#!/usr/bin/env python3
"""Judge recognised features against what a part really has; knows of the product only its files.

    python judge.py --truth DIR --found DIR NAME [NAME ...]

Of each NAME: DIR/NAME.json and DIR/NAME.seen.json (what is there, and how much of each face the
scanner saw), and found/NAME.features.json and, if there is one, found/NAME.step. Prints a JSON list,
one entry for each part.

Features are matched by where they are and how large, whatever they are called; then the class is
looked at, then whose child each is, then its sizes. "unknown" is never right. A feature that the scan
does not show at all is not asked for. Chamfers, rounds and fillets lie on the rims of others and are
matched among themselves.
"""

import argparse
import json
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

EDGES = {"chamfer", "round", "fillet"}
# Other names for what the truth calls a hole: the wider of two holes in one another, a hole whose
# thread was guessed.
SYNONYMS = {"counterbore": "hole", "tapped_hole": "hole", "blind_hole": "hole",
            "through_hole": "hole", "stepped_hole": "hole"}
# Not features of their own.
NOT_FEATURES = {"pattern"}
# A face of which fewer samples came back is not seen.
SEEN_LEAST = 12
# What is off by so much without a warning, and by so many stated uncertainties, misleads.
WRONG_SIGMAS, WRONG_PITCHES = 5.0, 2.0


def kind_of(found):
    return SYNONYMS.get(found["type"], found["type"])


def size_of(dimensions):
    """Side of a square as large as the outline; `None` where nothing is told of it."""
    if "diameter" in dimensions:
        return dimensions["diameter"]
    if "length" in dimensions and "width" in dimensions:
        return math.sqrt(max(1e-12, dimensions["length"] * dimensions["width"]))
    return None


def size_of_edge(dimensions):
    return dimensions.get("width", dimensions.get("radius"))


def pairs(truths, founds, cost):
    """The cheapest pairs first, each feature once."""
    options = []
    for i, truth in truths:
        for j, found in founds:
            asked = cost(truth, found)
            if asked is not None:
                options.append((asked, i, j))
    matched, used = {}, set()
    for _, i, j in sorted(options):
        if i not in matched and j not in used:
            matched[i] = j
            used.add(j)
    return matched


def cost_of(truth, found):
    """How unlike two features are by place and size; `None` for too much."""
    own, other = size_of(truth["dimensions_mm"]), size_of(found.get("dimensions_mm", {}))
    apart = math.dist(truth["center_mm"][:2], found["center_mm"][:2])
    if apart > max(2.0, 0.35 * own):
        return None
    larger = 0.3 if other is None else abs(math.log(max(other, 1e-6) / own))
    if larger > 0.6:
        return None
    high = abs(truth["center_mm"][2] - found["center_mm"][2])
    other_kind = 0.15 if kind_of(found) != truth["type"] else 0.0
    return apart / own + larger + min(0.3, 0.1 * high) + other_kind


def cost_of_edge(outlines):
    def cost(truth, found):
        own = size_of_edge(truth["dimensions_mm"])
        other = size_of_edge(found.get("dimensions_mm", {}))
        apart = math.dist(truth["center_mm"][:2], found["center_mm"][:2])
        if apart > max(2.0, 0.35 * outlines[truth["id"]]):
            return None
        larger = 0.5 if other is None else abs(math.log(max(other, 1e-6) / own))
        if larger > 1.1:
            return None
        high = abs(truth["center_mm"][2] - found["center_mm"][2])
        other_kind = 0.15 if kind_of(found) != truth["type"] else 0.0
        return apart / outlines[truth["id"]] + larger + min(0.5, 0.1 * high) + other_kind

    return cost


def extent(outline):
    xs, ys = [p[0] for p in outline], [p[1] for p in outline]
    return math.hypot(max(xs) - min(xs), max(ys) - min(ys)) / math.sqrt(2.0)


def matches(truths, founds):
    """From features that are there to those that were found, by number."""
    blocks = [f for f in founds if f["type"] == "block"]
    matched = {0: blocks[0]["id"]} if blocks else {}

    def of(features, edges, is_found):
        kind = kind_of if is_found else (lambda f: f["type"])
        return [(f["id"], f) for f in features
                if f["type"] != "block" and (kind(f) in EDGES) == edges]

    matched.update(pairs(of(truths, False, False), of(founds, False, True), cost_of))
    outlines = {t["id"]: extent(t["outline_mm"]) for t in truths}
    matched.update(pairs(of(truths, True, False), of(founds, True, True), cost_of_edge(outlines)))
    return matched


def seen_of_floor(truth, seen):
    faces = {face for face in truth.get("floor_faces", []) if face is not None}
    return sum(seen["faces"][face] for face in faces)


def told_sizes(truth, found):
    """Pairs of true and told sizes; nearly square ones in the order that fits."""
    own, other = truth["dimensions_mm"], dict(found.get("dimensions_mm", {}))
    sigma = dict(found.get("sigma_mm", {}))
    if {"length", "width"} <= own.keys() & other.keys() and truth["type"] != "slot":
        as_told = abs(own["length"] - other["length"]) + abs(own["width"] - other["width"])
        swapped = abs(own["length"] - other["width"]) + abs(own["width"] - other["length"])
        if swapped < as_told and own["length"] < 1.15 * own["width"]:
            for numbers in (other, sigma):
                if {"length", "width"} <= numbers.keys():
                    numbers["length"], numbers["width"] = numbers["width"], numbers["length"]
    return own, other, sigma


def measured(truth, found, hidden, cut, pitch):
    """What is told of a feature that was recognised, number by number."""
    own, other, sigma = told_sizes(truth, found)
    warned = bool(found.get("warnings"))
    rows = []

    def row(name, error, stated, is_asked=True):
        off = abs(error) > WRONG_PITCHES * pitch and abs(error) > WRONG_SIGMAS * (stated or 0.0)
        rows.append({"name": name, "error": error, "sigma": stated, "asked": is_asked,
                     "misleads": off and not warned})

    for name, value in own.items():
        is_asked = name not in cut and not (hidden and name in ("depth", "height"))
        if name in other and other[name] is not None:
            row(name, other[name] - value, sigma.get(name), is_asked)
        elif is_asked:
            rows.append({"name": name, "error": None, "sigma": None, "asked": True,
                         "misleads": False})
    if truth.get("free_form") and "depth_mm" in truth and other.get("depth") is not None:
        low, high = truth["depth_mm"]
        outside = max(low - other["depth"], other["depth"] - high, 0.0)
        row("depth of a free form", outside, sigma.get("depth"), False)
    centre = sigma.get("center", sigma.get("centre"))
    if not cut:
        for axis, name in enumerate(("x", "y")):
            stated = centre[axis] if isinstance(centre, list) else centre
            stated = sigma.get(f"center_{name}", stated)
            row(f"centre {name}", found["center_mm"][axis] - truth["center_mm"][axis], stated)
        nested_lower = truth["type"] in ("hole", "countersink") and "or_parents" in truth
        stated = sigma.get("center_z", centre[2] if isinstance(centre, list) else None)
        row("centre z", found["center_mm"][2] - truth["center_mm"][2], stated,
            not nested_lower and not truth["type"] in EDGES)
    if truth.get("through") is not None and "through" in found:
        rows.append({"name": "through", "error": float(found["through"] != truth["through"]),
                     "sigma": None, "asked": not hidden, "misleads": False})
    return rows


def turned(truth, found):
    """Angle between directions, degrees; `None` where there are none."""
    if "direction" not in truth or not found.get("direction"):
        return None
    dot = abs(sum(a * b for a, b in zip(truth["direction"], found["direction"])))
    return math.degrees(math.acos(min(1.0, dot)))


def judged(truth, seen, found):
    pitch = truth["scan"]["pitch_mm"]
    founds = [f for f in found["features"] if f["type"] not in NOT_FEATURES]
    truths = truth["features"]
    matched = matches(truths, founds)
    by_id = {f["id"]: f for f in founds}
    back = {j: i for i, j in matched.items()}
    rows = []
    for told in truths:
        own = by_id.get(matched.get(told["id"]))
        is_through = told.get("through") is True
        if is_through:
            # What lies behind it is the table, which is seen or not.
            hidden = not truth["table_seen"]
        elif told["type"] == "block":
            hidden = not truth["table_seen"]
        else:
            hidden = seen_of_floor(told, seen) < SEEN_LEAST
        entry = {"id": told["id"], "type": told["type"], "hidden": hidden,
                 "out_of_view": bool(told.get("out_of_view")), "cut": told.get("cut", []),
                 "found": kind_of(own) if own else None,
                 "warned": bool(own and own.get("warnings")), "depth": depth_in_tree(told, truths)}
        if own:
            parents = [told["parent"], *told.get("or_parents", [])]
            entry["parent_right"] = (own.get("parent") is None if told["parent"] is None else
                                     back.get(own.get("parent")) in parents)
        if own and kind_of(own) == told["type"]:
            entry["sizes"] = measured(told, own, hidden, entry["cut"], pitch)
            entry["turned_deg"] = turned(told, own)
            entry["score"] = own.get("score")
        rows.append(entry)
    more = [{"type": kind_of(f), "warned": bool(f.get("warnings")), "center_mm": f["center_mm"],
             "dimensions_mm": f.get("dimensions_mm", {})}
            for f in founds if f["id"] not in back]
    return {"name": truth["name"], "pitch_mm": pitch, "noise_mm": truth["scan"]["noise_mm"],
            "outliers": truth["scan"]["outliers"], "samples": seen["samples"],
            "on_part": seen["on_part"], "features": rows, "more": more,
            "patterns": patterns(truth.get("patterns", []), found.get("patterns", []), matched)}


def depth_in_tree(told, truths):
    depth = 0
    while told["parent"] is not None:
        told, depth = truths[told["parent"]], depth + 1
    return depth


def patterns(true, told, matched):
    """How many patterns of equal holes are told with all their members, and how many besides."""
    found = {(p["kind"], frozenset(p["members"])) for p in told}
    wanted = {(p["kind"], frozenset(matched.get(m, -1) for m in p["members"])) for p in true}
    return {"there": len(wanted), "found": len(wanted & found), "more": len(found - wanted)}


def read(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def one(truth_dir, found_dir, name):
    truth = read(os.path.join(truth_dir, name + ".json"))
    seen = read(os.path.join(truth_dir, name + ".seen.json"))
    path = os.path.join(found_dir, name + ".features.json")
    if not os.path.exists(path):
        # No answer: all is missing.
        entry = judged(truth, seen, {"features": []})
        return {**entry, "no_answer": True}
    entry = judged(truth, seen, read(path))
    step = os.path.join(found_dir, name + ".step")
    if os.path.exists(step):
        import rebuilt

        entry["solid"] = rebuilt.judged(step, os.path.join(truth_dir, name + ".stl"), truth, seen)
    seconds = os.path.join(found_dir, name + ".seconds")
    if os.path.exists(seconds):
        entry["seconds"] = read(seconds)
    return entry


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="+")
    parser.add_argument("--truth", required=True)
    parser.add_argument("--found", required=True)
    arguments = parser.parse_args()
    told = [one(arguments.truth, arguments.found, name) for name in arguments.names]
    json.dump(told, sys.stdout)


if __name__ == "__main__":
    main()
