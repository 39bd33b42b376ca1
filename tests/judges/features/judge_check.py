#!/usr/bin/env python3
"""Hold the judge itself against answers whose verdict is known: right ones, and each kind of fault."""

import copy
import sys

import judge
import report


def square(at, side):
    x, y, h = at[0], at[1], side / 2
    return [[x - h, y - h], [x + h, y - h], [x + h, y + h], [x - h, y + h]]


def feature(number, parent, kind, at, dimensions, side, **more):
    return {"id": number, "parent": parent, "type": kind, "center_mm": list(at),
            "axis": [0.0, 0.0, 1.0], "dimensions_mm": dimensions, "floor_z_mm": 0.0,
            "outline_mm": square(at, side), "floor_faces": [number], **more}


TRUTH = {
    "name": "made up", "table_seen": True, "patterns": [],
    "scan": {"pitch_mm": 0.4, "noise_mm": 0.05, "outliers": 0.01, "window_mm": None},
    "features": [
        feature(0, None, "block", (0, 0, 0), {"length": 80.0, "width": 50.0, "height": 20.0}, 60),
        feature(1, 0, "pocket", (-10, 0, 0), {"length": 30.0, "width": 20.0, "depth": 5.0}, 25),
        feature(2, 1, "hole", (-10, 0, -5), {"diameter": 6.0, "depth": 8.0}, 6, through=False),
        feature(3, 0, "boss", (25, 10, 0), {"diameter": 9.0, "height": 4.0}, 9),
        feature(4, 3, "chamfer", (25, 10, 4), {"width": 1.5}, 9),
    ],
}
SEEN = {"samples": 1000, "on_part": 900, "on_table": 100, "faces": [500, 300, 50, 40, 30]}


def right():
    """An answer that is right, with stated uncertainties and numbers of its own for features."""
    told = []
    for own in reversed(TRUTH["features"]):
        told.append({"id": 10 + own["id"],
                     "parent": None if own["parent"] is None else 10 + own["parent"],
                     "type": own["type"], "score": 0.9, "warnings": [],
                     "center_mm": [c + 0.01 for c in own["center_mm"]], "axis": own["axis"],
                     "dimensions_mm": {k: v + 0.02 for k, v in own["dimensions_mm"].items()},
                     "sigma_mm": {**{k: 0.02 for k in own["dimensions_mm"]}, "center": 0.02}})
    return {"units": "mm", "features": told}


def answer(change, seen=SEEN, truth=TRUTH):
    told = right()
    of = {own["id"] - 10: own for own in told["features"]}
    change(of, told)
    return judge.judged(copy.deepcopy(truth), seen, told)


def expect(what, is_so):
    if not is_so:
        sys.exit(f"the judge is wrong about {what}")


def rates(part):
    return report.rates([part])


def main():
    part = answer(lambda of, told: None)
    expect("a right answer", rates(part) == (4, 4, 4) and report.whole(part))
    expect("its intervals", report.all_covered([part]) == (21, 21))
    expect("its errors", all(abs(row["error"]) < 0.021 for f in part["features"]
                             for row in f["sizes"]))

    def called(kind):
        return answer(lambda of, told: of[1].update(type=kind))

    part = called("slot")
    expect("a pocket called slot", rates(part) == (3, 4, 4) and not report.whole(part))
    part = called("unknown")
    expect("a pocket called unknown", rates(part) == (3, 4, 3))
    part = answer(lambda of, told: told["features"].remove(of[3]))
    expect("a boss left out", rates(part) == (3, 4, 3))
    part = answer(lambda of, told: told["features"].append(
        {**of[3], "id": 99, "center_mm": [-35.0, -20.0, 0.0]}))
    expect("a boss too many", rates(part) == (4, 4, 5) and not report.whole(part))
    part = answer(lambda of, told: of[2].update(parent=10))
    expect("a hole on the block in place of the pocket",
           report.nested([part]) == (3, 4) and not report.whole(part))

    def deeper(warnings):
        def change(of, told):
            of[2]["dimensions_mm"]["depth"] = 12.0
            of[2]["warnings"] = warnings
        return change

    expect("a wrong depth", len(report.misleading([answer(deeper([]))])) == 1)
    expect("its interval", report.all_covered([answer(deeper([]))]) == (20, 21))
    expect("a wrong depth with a warning", not report.misleading([answer(deeper(["deep"]))]))
    unseen = {**SEEN, "faces": [500, 300, 3, 40, 30]}
    part = answer(deeper(["deep"]), unseen)
    expect("a depth that nobody sees", report.all_covered([part]) == (20, 20))

    cut = copy.deepcopy(TRUTH)
    cut["features"][1]["cut"] = ["length"]
    cut["features"][3]["out_of_view"] = cut["features"][4]["out_of_view"] = True
    expect("a cut pocket without a warning",
           report.odd_faults(answer(lambda of, told: None, truth=cut)))

    def warned(of, told):
        of[1]["warnings"] = ["cut by the scan's border"]
        told["features"].remove(of[3])
        told["features"].remove(of[4])

    expect("a cut pocket with a warning", not report.odd_faults(answer(warned, truth=cut)))
    print("the judge of features tells right from wrong")


if __name__ == "__main__":
    main()
