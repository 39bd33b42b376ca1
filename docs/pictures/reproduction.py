"""Draws the figures of Shim & Lee 1995 from our own data.

    python reproduction.py DATA OUT

DATA is the folder that `study-reproduction --data` leaves. Needs the packages cadquery-ocp,
matplotlib and pillow. The figures have the paper's numbers and its order of panels.
"""

import argparse
import io
import json
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap
from PIL import Image

import render_iges

SUBJECTS = ("cylinder", "house")
# Nothing, regions 1 to 4, and any further one.
REGION_COLOURS = ["#202428", "#e8c35a", "#6fa8dc", "#d9776a", "#7cb87c", "#b08cc4"]
# Colours that a small palette must not lose among the greys.
ACCENTS = REGION_COLOURS + ["#c0392b", "#d62728", "#1f5fd6", "#ff5a3c", "#fbe3a6", "#dfe7ee"]
GREYS = 128
# Empty nodes around a whole image.
MARGIN = 5
# An error of this many tenths of a millimetre is black in the difference images.
DIFFERENCE_COUNTS = 2.0
BORDER = {"color": "white", "linewidth": 1.1}


class Road:
    """One object on one road; images have [row, column], rows upwards."""

    def __init__(self, data, iges):
        self.data, self.iges = data, iges
        self.pitch = data["pitch_mm"]
        self.z = self.grid("z_mm")
        self.restored = self.grid("restored_mm")
        self.labels = self.grid("labels").astype(int)
        low, high = np.nanmin(self.z), np.nanmax(self.z)
        self.middle = (low + high) / 2

    def grid(self, name):
        values = np.array(self.data[name], dtype=float)
        nothing = np.nan if name in ("z_mm", "restored_mm", "light") else 0
        values = values.reshape(self.data["columns"], self.data["rows"]).T
        return np.pad(values, MARGIN, constant_values=nothing)

    def range(self, z):
        """R of a height, as the page defines it."""
        return 7500 + 10 * (z - self.middle)

    def to_nodes(self, points):
        points = np.asarray(points, dtype=float)
        origin = np.array([self.data["x_mm"], self.data["y_mm"]])
        return (points - origin) / self.pitch + MARGIN

    def face(self, number):
        return next(face for face in self.data["faces"] if face["number"] == number)

    def way(self, number, name):
        return Rectangle(next(w for w in self.data["ways"] if w["number"] == number)[name])


class Rectangle:
    """Values over a rectangle of nodes."""

    def __init__(self, data):
        self.left, self.bottom = data["column"] + MARGIN, data["row"] + MARGIN
        self.width, self.height = data["columns"], data["rows"]
        self.z = self.of(data["z_mm"])
        self.given = self.of(data["given_mm"]) if "given_mm" in data else None

    def of(self, values):
        return np.array(values, dtype=float).reshape(self.width, self.height).T

    def within(self, image):
        return image[self.bottom : self.bottom + self.height, self.left : self.left + self.width]

    def extent(self):
        left, bottom = self.left - 0.5, self.bottom - 0.5
        return (left, left + self.width, bottom, bottom + self.height)


def load(folder):
    roads = {}
    for subject in SUBJECTS:
        with open(folder / f"{subject}.json") as file:
            data = json.load(file)
        for name, road in data["roads"].items():
            roads[subject, name] = Road(road, folder / f"{subject}-{name}.igs")
    return roads


def panel(axes, text):
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_xlabel(text, fontsize=9)


def grey(axes, image, text, extent=None, low=None, high=None):
    """A range image: nearer is brighter, nothing is black."""
    low = np.nanmin(image) if low is None else low
    high = np.nanmax(image) if high is None else high
    colours = plt.get_cmap("gray").copy()
    colours.set_bad("black")
    # The farthest node is still brighter than nothing.
    below = low - 0.35 * (high - low)
    axes.imshow(image, cmap=colours, vmin=below, vmax=high, origin="lower", extent=extent, interpolation="nearest")
    panel(axes, text)


def segmentation(axes, road, text):
    labels = np.minimum(road.labels, len(REGION_COLOURS) - 1)
    axes.imshow(
        labels,
        cmap=ListedColormap(REGION_COLOURS),
        vmin=-0.5,
        vmax=len(REGION_COLOURS) - 0.5,
        origin="lower",
        interpolation="nearest",
    )
    for number in np.unique(labels[labels > 0]):
        rows, columns = np.nonzero(labels == number)
        axes.text(columns.mean(), rows.mean(), str(number), ha="center", va="center", fontsize=13, weight="bold")
    panel(axes, text)


def borders(axes, road, text):
    for edge in road.data["edges"]:
        points = road.to_nodes(edge["points_mm"])
        axes.plot(points[:, 0], points[:, 1], color="black", linewidth=1.0)
    vertices = road.to_nodes(road.data["vertices_mm"])
    axes.plot(vertices[:, 0], vertices[:, 1], "o", color="#c0392b", markersize=4.5)
    rows, columns = road.z.shape
    axes.set(xlim=(-0.5, columns - 0.5), ylim=(-0.5, rows - 0.5), aspect="equal")
    panel(axes, text)


def surface(axes, road, number, text):
    """The surface of a face beyond its border, and the border."""
    face = road.face(number)
    rectangle = Rectangle(face["surface"])
    grey(axes, rectangle.z, text, rectangle.extent())
    outline(axes, road, face)


def outline(axes, road, face, **style):
    for loop in face["loops"]:
        points = road.to_nodes(loop + loop[:1])
        axes.plot(points[:, 0], points[:, 1], **{**BORDER, **style})


def alone(road, number):
    return np.where(road.labels == number, road.z, np.nan)


def sheet(rows, columns, width=9.0, ratio=1.09):
    figure, axes = plt.subplots(rows, columns, figsize=(width, width / columns * rows * ratio), squeeze=False)
    return figure, axes


def save(figure, folder, number):
    figure.tight_layout(pad=0.4, w_pad=0.6, h_pad=0.8)
    keep(figure, folder, number, greys_and_accents())


def keep(figure, folder, number, palette=None):
    """Writes the figure in the colours of a palette, or in the best 128."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=100)
    plt.close(figure)
    picture = Image.open(buffer).convert("RGB")
    if palette is None:
        picture = picture.quantize(128, dither=Image.Dither.NONE)
    else:
        picture = in_colours(picture, palette)
    picture.save(folder / f"figure-{number:02}.png", optimize=True)


def in_colours(picture, palette):
    """Each pixel in the nearest colour; pillow's own search is coarse, and white not white."""
    pixels = np.asarray(picture, dtype=np.int32)
    seen, which = np.unique(pixels.reshape(-1, 3), axis=0, return_inverse=True)
    off = ((seen[:, None, :] - palette[None]) ** 2).sum(axis=2)
    nearest = off.argmin(axis=1).astype(np.uint8)[which.reshape(-1)]
    drawn = Image.fromarray(nearest.reshape(pixels.shape[:2]), "P")
    drawn.putpalette(palette.astype(np.uint8).tobytes())
    return drawn


def greys_and_accents():
    """Greys, and each accent pure and mixed with black and white."""
    colours = [(k * 255 // (GREYS - 1),) * 3 for k in range(GREYS)]
    for accent in ACCENTS:
        accent = np.array(matplotlib.colors.to_rgb(accent)) * 255
        for share, other in ((1.0, 0), (0.5, 0), (0.5, 255)):
            colours.append(tuple(int(c) for c in share * accent + (1 - share) * other))
    return np.array(colours)


def figure_3(roads, folder):
    figure, axes = sheet(2, 3)
    for row, subject in zip(axes, SUBJECTS):
        road = roads[subject, "shim-lee"]
        grey(row[0], road.z, "(a) range image")
        grey(row[1], road.grid("light"), "(b) pseudo-intensity", low=0.0, high=1.0)
        segmentation(row[2], road, "(c) segmentation")
    save(figure, folder, 3)


def figure_4(roads, folder):
    road = roads["cylinder", "shim-lee"]
    way = road.way(2, "naik")
    panels = [
        (road.range(way.given), "(a) region 2, R"),
        (road.range(way.z), "(b) restoration, R'"),
        (np.abs(way.z - way.given) * 10, "(c) error, |R - R'|"),
    ]
    figure = plt.figure(figsize=(10, 3.7))
    for k, (heights, text) in enumerate(panels):
        axes = figure.add_subplot(1, 3, k + 1, projection="3d", proj_type="ortho")
        columns, rows = np.meshgrid(np.arange(way.width), np.arange(way.height))
        axes.plot_surface(
            columns, rows, heights, rcount=56, ccount=56, color="white", edgecolor="#30404c", linewidth=0.25, shade=False
        )
        axes.set(zlim=(-500, 9500), zticks=[0, 4000, 8000], xticks=[], yticks=[])
        axes.tick_params(labelsize=7, pad=0)
        axes.view_init(elev=38, azim=62)
        axes.set_box_aspect((way.width, way.height, 130), zoom=1.0)
        axes.set_title(text, fontsize=10, y=-0.04)
    figure.subplots_adjust(0.03, 0.03, 1.0, 1.02, 0.08)
    keep(figure, folder, 4)


def figure_5(roads, folder):
    road = roads["cylinder", "shim-lee"]
    way = road.way(2, "extension")
    member = way.within(road.labels) == 2
    low, high = np.nanmin(way.given), np.nanmax(way.given)
    figure, axes = plt.subplots(1, 3, figsize=(10.5, 3.5), width_ratios=(1, 1, 1.35))
    grey(axes[0], np.where(member, way.given, np.nan), "(a) range image of region 2", way.extent(), low, high)
    grey(axes[1], way.given, "(b) its extension", way.extent(), low, high)
    axes[1].contour(
        np.arange(way.left, way.left + way.width),
        np.arange(way.bottom, way.bottom + way.height),
        member,
        levels=[0.5],
        colors="white",
        linewidths=1.0,
    )
    # A place where the lower border runs at about half a right angle.
    across, up = 11, 9
    lowest = np.argmax(member, axis=0)
    column = int(0.86 * way.width)
    row = int(lowest[column])
    left, bottom = column - across // 2, row - up // 2
    square = plt.Rectangle(
        (way.left + left - 0.5, way.bottom + bottom - 0.5), across, up, fill=False, edgecolor="#ff5a3c", linewidth=1.6
    )
    axes[1].add_patch(square)
    enlarged(axes[2], road, way, member, (left, bottom, across, up))
    save(figure, folder, 5)


def enlarged(axes, road, way, member, window):
    left, bottom, across, up = window
    padded = np.pad(member, 1)
    inner = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
    for j in range(up):
        for i in range(across):
            r, c = bottom + j, left + i
            inside, on_border = member[r, c], member[r, c] and not inner[r, c]
            axes.add_patch(
                plt.Rectangle(
                    (i, j),
                    1,
                    1,
                    facecolor="#fbe3a6" if inside else "white",
                    edgecolor="#8a939b",
                    linewidth=0.6,
                    hatch="...." if on_border else None,
                )
            )
            box = {"facecolor": "#fbe3a6" if inside else "white", "edgecolor": "none", "pad": 0.6}
            text = f"{road.range(way.given[r, c]):.0f}"
            axes.text(i + 0.5, j + 0.5, text, ha="center", va="center", fontsize=7.5, bbox=box if on_border else None)
    axes.set(xlim=(0, across), ylim=(0, up))
    panel(axes, "(c) the square in (b), R of each node")


def figure_6(roads, folder):
    cases = (("house", 1), ("cylinder", 2))
    sizes = [roads[subject, "shim-lee"].way(number, "naik") for subject, number in cases]
    ratios = [way.height / way.width + 0.15 for way in sizes]
    figure, axes = plt.subplots(2, 5, figsize=(11, 2.15 * sum(ratios)), height_ratios=ratios, layout="constrained")
    for row, (subject, number) in zip(axes, cases):
        road = roads[subject, "shim-lee"]
        naik, extension = road.way(number, "naik"), road.way(number, "extension")
        member = naik.within(road.labels) == number
        given = np.where(member, naik.given, np.nan)
        low, high = np.nanmin(given), np.nanmax(given)
        grey(row[0], given, f"(a) {subject}, region {number}", naik.extent(), low, high)
        grey(row[1], naik.z, "(b) Naik & Jain", naik.extent(), low, high)
        error(figure, row[2], naik, np.abs(naik.z - naik.given) * 10, "(c) its error", 3000, True)
        grey(row[3], np.where(member, extension.z, np.nan), "(d) extension, trimmed", naik.extent(), low, high)
        off = np.where(member, np.abs(extension.z - naik.given) * 10, np.nan)
        error(figure, row[4], naik, off, "(e) its error", 3, False)
    keep(figure, folder, 6, greys_and_accents())


def error(figure, axes, way, off, text, most, whole):
    colours = plt.get_cmap("gray_r").copy()
    colours.set_bad("#dfe7ee")
    shown = axes.imshow(
        off, cmap=colours, vmin=0, vmax=most, origin="lower", extent=way.extent(), interpolation="nearest"
    )
    bar = figure.colorbar(shown, ax=axes, shrink=0.7, aspect=16, pad=0.03, ticks=[0, most])
    bar.ax.tick_params(labelsize=7)
    bar.set_label("0.1 mm", fontsize=7, labelpad=-8)
    panel(axes, text)


def figure_7(roads, folder):
    figure, axes = sheet(2, 3)
    for row, subject in zip(axes, SUBJECTS):
        road = roads[subject, "shim-lee"]
        segmentation(row[0], road, "(a) segmentation")
        row[1].imshow(road.grid("residue"), cmap="gray_r", origin="lower", interpolation="nearest")
        panel(row[1], "(b) border image")
        borders(row[2], road, "(c) vertices")
    save(figure, folder, 7)


def figure_9(roads, folder):
    road = roads["cylinder", "relief"]
    figure, axes = sheet(2, 3)
    grey(axes[0, 0], road.z, "(a) range image")
    segmentation(axes[0, 1], road, "(b) segmentation")
    surface(axes[0, 2], road, 1, "(c) region 1")
    borders(axes[1, 0], road, "(d) edges and vertices")
    grey(axes[1, 1], road.restored, "(e) restored image")
    surface(axes[1, 2], road, 2, "(f) region 2")
    save(figure, folder, 9)


def figure_10(roads, folder):
    road = roads["house", "relief"]
    figure, axes = sheet(2, 4, width=10.5)
    grey(axes[0, 0], road.z, "(a) range image")
    segmentation(axes[0, 1], road, "(b) segmentation")
    borders(axes[0, 2], road, "(c) edges and vertices")
    grey(axes[0, 3], road.restored, "(d) restored image")
    for number, (place, letter) in enumerate(zip(axes[1], "efgh"), start=1):
        surface(place, road, number, f"({letter}) region {number}")
    save(figure, folder, 10)


def figure_11(roads, folder):
    figure, axes = sheet(4, 3, width=9.0, ratio=1.06)
    cases = [(subject, name) for subject in SUBJECTS for name in ("shim-lee", "relief")]
    for row, case in zip(axes, cases):
        road = roads[case]
        low, high = np.nanmin(road.z), np.nanmax(road.z)
        grey(row[0], road.z, f"{case[0]}, {case[1]}: range image", None, low, high)
        grey(row[1], road.restored, "restored", None, low, high)
        # Steps of an eighth: finer ones only make a large file.
        off = np.round(np.abs(road.restored - road.z) * 10 / DIFFERENCE_COUNTS * 8) / 8 * DIFFERENCE_COUNTS
        colours = plt.get_cmap("gray_r").copy()
        colours.set_bad("white")
        row[2].imshow(off, cmap=colours, vmin=0, vmax=DIFFERENCE_COUNTS, origin="lower", interpolation="nearest")
        there, drawn = ~np.isnan(road.z), ~np.isnan(road.restored)
        for nodes, colour in ((there & ~drawn, "#d62728"), (drawn & ~there, "#1f5fd6")):
            rows, columns = np.nonzero(nodes)
            row[2].plot(columns, rows, "s", color=colour, markersize=2.4, markeredgewidth=0)
        panel(row[2], f"difference: white 0, black {DIFFERENCE_COUNTS / 10:g} mm or more")
    save(figure, folder, 11)


def figure_12(roads, folder):
    figure = plt.figure(figsize=(8.4, 3.7))
    for k, (subject, azimuth) in enumerate((("cylinder", -72), ("house", -108))):
        road = roads[subject, "relief"]
        colours = [REGION_COLOURS[face["number"]] for face in road.data["faces"]]
        axes = figure.add_subplot(1, 2, k + 1, projection="3d", proj_type="ortho")
        render_iges.draw(axes, render_iges.load(str(road.iges)), False, colours)
        axes.view_init(elev=8, azim=azimuth)
        axes.set_axis_off()
        axes.set_title(f"({'ab'[k]}) {subject}", fontsize=10, y=-0.02)
    figure.subplots_adjust(0.0, 0.06, 1.0, 1.08, 0.0)
    keep(figure, folder, 12)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    roads = load(options.data)
    drawings = (figure_3, figure_4, figure_5, figure_6, figure_7, figure_9, figure_10, figure_11, figure_12)
    for draw in drawings:
        draw(roads, options.out)


if __name__ == "__main__":
    main()
