"""Faces of an IGES file and their loops, held against the part that was scanned.

All is seen from above, on a grid of places. A face is said to lie on the top, on the table, or elsewhere (the top
of a boss, the floor of a pocket or hole) by the heights of its loops.
"""

import json
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, ".."))

import numpy as np
import occ_check
import range_tops
from OCP.BRepTools import BRepTools
from OCP.IFSelect import IFSelect_RetDone
from OCP.IGESControl import IGESControl_Reader
from OCP.TopAbs import TopAbs_FACE, TopAbs_WIRE
from OCP.TopoDS import TopoDS

# Distance of the places looked at, and of points along loops, millimetres.
STEP_MM = 0.1
SPACING_MM = 0.1
# A face lies on the top if its loops do, to so much (median), millimetres. All that goes in or stands up is at least
# 1 mm deep or high.
ON_TOP_MM = 0.5
# A loop belongs to an opening if it has so much of the opening, or so much of the loop is in it.
BELONGS = 0.5
# A drilled hole is kept if no face on the top covers so much of its mouth; a needless loop is closed if faces cover
# so much of what it left out.
KEPT, CLOSED = 0.8, 0.9
# A stain is black from this loss on.
BLACK = 0.95
# A loop of off.igs is known again in on.igs by so much of the smaller one's area.
SAME = 0.1


class Grid:
    """Places over the part."""

    def __init__(self, low, high):
        self.low = np.array(low, float)
        self.shape = tuple(int(np.ceil((h - l) / STEP_MM)) + 1 for l, h in zip(low, high))

    def places(self):
        x = self.low[0] + STEP_MM * np.arange(self.shape[0])
        y = self.low[1] + STEP_MM * np.arange(self.shape[1])
        return np.meshgrid(x, y, indexing="ij")

    def inside(self, outline):
        """Which places lie within a closed outline, by the even-odd rule."""
        p = (np.asarray(outline, float)[:, :2] - self.low) / STEP_MM
        q = np.roll(p, -1, axis=0)
        # Rows are those of y. An edge crosses the rows from the first at or above its lower end to the last below
        # its upper end.
        lower, upper = np.minimum(p[:, 1], q[:, 1]), np.maximum(p[:, 1], q[:, 1])
        first = np.clip(np.ceil(lower), 0, self.shape[1]).astype(int)
        last = np.clip(np.ceil(upper), 0, self.shape[1]).astype(int)
        count = last - first
        edge = np.repeat(np.arange(len(p)), count)
        row = first[edge] + np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
        a, b = p[edge], q[edge]
        x = a[:, 0] + (row - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
        column = np.clip(np.ceil(x), 0, self.shape[0]).astype(int)
        turns = np.zeros((self.shape[0] + 1, self.shape[1]), int)
        np.add.at(turns, (column, row), 1)
        return np.cumsum(turns, axis=0)[:-1] % 2 == 1


def area_mm2(outline):
    p = np.asarray(outline, float)
    q = np.roll(p, -1, axis=0)
    return abs(float(np.sum(p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]))) / 2.0


def size_mm(outline):
    """Greatest extent in any direction, seen from above: by directions a degree apart."""
    turn = np.radians(np.arange(180))
    along = np.asarray(outline, float)[:, :2] @ np.stack([np.cos(turn), np.sin(turn)])
    return float((along.max(0) - along.min(0)).max())


def faces_of(path):
    """Of each face of an IGES file the points along its outer loop, and along its inner ones."""
    occ_check.silence()
    reader = IGESControl_Reader()
    if reader.ReadFile(str(path)) != IFSelect_RetDone:
        raise RuntimeError(f"{path}: OpenCASCADE cannot read it")
    reader.TransferRoots()
    faces = []
    for face in occ_check.explore(reader.OneShape(), TopAbs_FACE, TopoDS.Face):
        outer = BRepTools.OuterWire_s(face)
        inner = []
        outline = None
        for wire in occ_check.explore(face, TopAbs_WIRE, TopoDS.Wire):
            points = np.array(occ_check.sample_wire(wire, face, SPACING_MM))
            if wire.IsSame(outer):
                outline = points
            else:
                inner.append(points)
        faces.append((outline, inner))
    return faces


class Truth:
    """The part, on a grid."""

    def __init__(self, told):
        self.told, scan = told, told["scan"]
        low, high = scan["view_mm"]
        self.grid = grid = Grid(low[:2], high[:2])
        self.x, self.y = grid.places()
        self.top = range_tops.of_told(self.told["top"])
        self.table_z_mm = scan["table_z_mm"]
        self.block = grid.inside(self.told["outline_mm"])
        self.openings = []
        for hole in self.told["holes"]:
            off = np.hypot(self.x - hole["centre_mm"][0], self.y - hole["centre_mm"][1])
            self.openings.append(("hole", off <= hole["diameter_mm"] / 2))
        for kind in ("bosses", "pockets"):
            for one in self.told[kind]:
                self.openings.append((kind, grid.inside(one["outline_mm"])))
        self.face = self.block.copy()
        for _, mouth in self.openings:
            self.face &= ~mouth
        self.stained = self.stains([one for one in scan["stains"] if one["loss"] < BLACK])
        self.black = self.stains([one for one in scan["stains"] if one["loss"] >= BLACK])
        self.glaring = self.glares(scan)
        self.hidden = self.shadows(scan)

    def height(self, x, y):
        try:
            return self.top.height(x, y)
        except ValueError:
            # Beyond the ball or cylinder.
            return -np.inf

    def where(self, face):
        """On what a face lies."""
        outline, inner = face
        points = np.concatenate([outline, *inner])
        heights = np.array([self.height(x, y) for x, y, _ in points])
        if np.median(np.abs(points[:, 2] - heights)) < ON_TOP_MM:
            return "top"
        if self.table_z_mm is not None and np.median(np.abs(points[:, 2] - self.table_z_mm)) < ON_TOP_MM:
            return "table"
        return "elsewhere"

    def stains(self, told):
        found = np.zeros(self.grid.shape, bool)
        for one in told:
            off = np.hypot(self.x - one["centre_mm"][0], self.y - one["centre_mm"][1])
            found |= off <= one["radius_mm"] + one["rim_mm"] / 2
        return found

    def glares(self, scan):
        """Where the top loses at least every tenth reading to gloss. On a coarser grid: the top is smooth."""
        found = np.zeros(self.grid.shape, bool)
        width, every = np.radians(scan["glare_width_deg"]), 5
        for i in range(0, self.grid.shape[0], every):
            for j in range(0, self.grid.shape[1], every):
                if not self.block[i, j]:
                    continue
                off = self.top.mirror_off_rad(self.x[i, j], self.y[i, j], self.told["extent_mm"],
                                              scan["standoff_mm"], scan["baseline_mm"])
                if scan["glare"] * np.exp(-((off / width) ** 2) / 2) >= 0.1:
                    found[i:i + every, j:j + every] = True
        return found & self.face

    def shadows(self, scan):
        """Where a boss stands between the top and the laser or the sensor."""
        found = np.zeros(self.grid.shape, bool)
        low, high = self.told["extent_mm"]
        laser_y, z = (low[1] + high[1]) / 2, (low[2] + high[2]) / 2 + scan["standoff_mm"]
        ground = np.full(self.grid.shape, low[2])
        ground[self.face] = [self.height(x, y) for x, y in zip(self.x[self.face], self.y[self.face])]
        own = np.broadcast_to(np.arange(self.grid.shape[1]), self.grid.shape)
        for one, (_, foot) in zip(self.told["bosses"], self.of("bosses")):
            # Laser and sensor stand over the same x: the line of sight keeps to its column of places, up to where
            # it is higher than the boss.
            before = np.concatenate([np.zeros((self.grid.shape[0], 1), int), np.cumsum(foot, axis=1)], axis=1)
            for viewer_y in (laser_y, laser_y + scan["baseline_mm"]):
                way = (viewer_y - self.y) * (one["top_z_mm"] - ground) / (z - ground) / STEP_MM
                end = np.clip(own + way, 0, self.grid.shape[1] - 1).astype(int)
                first, last = np.minimum(own, end), np.maximum(own, end)
                met = np.take_along_axis(before, last + 1, 1) - np.take_along_axis(before, first, 1)
                found |= (met > 0) & (one["top_z_mm"] > ground)
        return found & self.face

    def of(self, kind):
        return [opening for opening in self.openings if opening[0] == kind]

    def opening_of(self, inside):
        """The opening that a loop belongs to, if any; the loop by its places."""
        own = inside.sum()
        for number, (_, mouth) in enumerate(self.openings):
            both = (inside & mouth).sum()
            if both >= BELONGS * mouth.sum() or (own > 0 and both >= BELONGS * own):
                return number
        return None

    def cause(self, inside):
        """What may have made a needless loop; the loop by its places, a little beyond it."""
        for name, places in (("black", self.black), ("stain", self.stained), ("gloss", self.glaring),
                             ("shadow", self.hidden)):
            if (inside & places).any():
                return name
        return "other"


def read(truth, found):
    """What the faces of an IGES file say: needless loops, and what they cover."""
    grid = truth.grid
    covered = {"top": np.zeros(grid.shape, bool), "any": np.zeros(grid.shape, bool)}
    loops, wanted, faces = [], [], {"top": 0, "table": 0, "elsewhere": 0}
    for face in found:
        where = truth.where(face)
        faces[where] += 1
        own = grid.inside(face[0])
        for points in face[1]:
            inside = grid.inside(points)
            own &= ~inside
            # What is left out around the part on the table is the part and its shadow.
            if where == "table" and (inside & truth.block).sum() >= BELONGS * truth.block.sum():
                continue
            if where == "top" and (opening := truth.opening_of(inside)) is not None:
                wanted.append(opening)
                continue
            loops.append({"where": where, "inside": inside, "area_mm2": area_mm2(points),
                          "size_mm": size_mm(points), "centre_mm": points.mean(0).tolist(),
                          "cause": truth.cause(inside) if where == "top" else where})
        covered["any"] |= own
        if where == "top":
            covered["top"] |= own
    return {"loops": loops, "wanted": wanted, "covered": covered, "faces": faces}


def share(places, of):
    count = int(of.sum())
    return float((places & of).sum()) / count if count else None


def holes(truth, said):
    """Of each drilled hole how much of its mouth is open, and whether a loop runs round it."""
    found = []
    for number, (_, mouth) in enumerate(truth.of("hole")):
        is_open = 1.0 - share(said["covered"]["top"], mouth)
        found.append({"open": is_open, "kept": is_open >= KEPT, "loop": number in said["wanted"]})
    return found


def is_same(a, b):
    both = (a["inside"] & b["inside"]).sum()
    least = min(a["inside"].sum(), b["inside"].sum())
    return both > 0 and both >= SAME * least


def plain(loop):
    return {key: value for key, value in loop.items() if key != "inside"}


def judge(path, answers, most_mm):
    """All that is told of a part: `answers` has the IGES file and the report of off and, if there is one, on."""
    with open(path, encoding="utf-8") as file:
        truth = Truth(json.load(file))
    fill = None
    if "on" in answers:
        with open(answers["on"][1], encoding="utf-8") as file:
            fill = json.load(file).get("fill")
    return compare(truth, {name: faces_of(igs) for name, (igs, _) in answers.items()}, fill, most_mm)


def compare(truth, faces, fill, most_mm):
    """As `judge`, of the faces of either file and of what the command says of its filling."""
    told = {"name": truth.told["name"], "top": truth.told["top"]["kind"], "scan": truth.told["scan"],
            "holes": truth.told["holes"], "counts": {k: len(truth.told[k]) for k in ("bosses", "pockets")}}
    said = {name: read(truth, found) for name, found in faces.items()}
    for name, one in said.items():
        told[name] = {
            "holes": holes(truth, one), "loops": [plain(loop) for loop in one["loops"]], "faces": one["faces"],
            "covered": share(one["covered"]["top"], truth.face),
            "shadow_covered": share(one["covered"]["top"], truth.hidden),
        }
    if "on" in said:
        off, on = said["off"]["loops"], said["on"]["loops"]
        covered = said["on"]["covered"]
        for loop, plain_loop in zip(off, told["off"]["loops"]):
            by = covered["top" if loop["where"] == "top" else "any"]
            again = any(is_same(loop, other) for other in on)
            filled = share(by, loop["inside"])
            plain_loop["closed"] = not again and (filled is None or filled >= CLOSED)
        for loop, plain_loop in zip(on, told["on"]["loops"]):
            plain_loop["new"] = not any(is_same(loop, other) for other in off)
        told["fill"] = fill
        told["wrong"] = wrong(truth, told, said, most_mm)
    return told


def wrong(truth, told, said, most_mm):
    """What was lost or left, with what the command says of it."""
    decisions = (told["fill"] or {}).get("holes", [])

    def beside(places):
        """Decisions whose middle lies among places, or within a millimetre."""
        x, y = truth.x[places], truth.y[places]
        if not len(x):
            return []
        return [one for one in decisions
                if np.hypot(x - one["centre_mm"][0], y - one["centre_mm"][1]).min() <= 1.0]

    found = []
    for number, (hole, on) in enumerate(zip(truth.told["holes"], told["on"]["holes"])):
        if not on["kept"]:
            found.append({"what": "lost", "was_there": told["off"]["holes"][number]["kept"], "truth": hole,
                          "open": on["open"], "decisions": beside(truth.of("hole")[number][1])})
    for loop, own in zip(said["off"]["loops"], told["off"]["loops"]):
        if not own["closed"] and own["size_mm"] <= most_mm:
            found.append({"what": "left", "truth": own, "decisions": beside(loop["inside"])})
    for loop, own in zip(said["on"]["loops"], told["on"]["loops"]):
        if own["new"]:
            found.append({"what": "new", "truth": own, "decisions": beside(loop["inside"])})
    return found
