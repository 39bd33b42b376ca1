"""Tables of what was judged of filled range images, and the bars."""

import json
import statistics

# The page's text ends before this line; the tables follow.
BEGIN = "## Parts\n"
# Shares that are asked for: of drilled holes that are kept, of needless loops that are closed.
KEPT_BAR, CLOSED_BAR = 1.0, 0.98
SIZES_MM = (0.0, 2.0, 5.0, 10.0, 15.0, float("inf"))
CAUSES = {"black": "a black stain", "stain": "another stain", "gloss": "gloss", "shadow": "a boss's shadow", "other": "nothing of these",
          "table": "on the table", "elsewhere": "on another face"}


def percent(value, digits=1):
    return "-" if value is None else f"{100 * value:.{digits}f}"


def table(heads, rows):
    """The first column is text, the others are numbers."""
    lines = [" | ".join(heads), " | ".join(["---"] + ["---:"] * (len(heads) - 1))]
    lines += [" | ".join(str(cell) for cell in row) for row in rows]
    return "\n".join(f"| {line} |" for line in lines)


def loops(told, name="off"):
    return [loop for part in told for loop in part[name]["loops"]]


def is_filled(told):
    return bool(told) and all("on" in part for part in told)


def line(part):
    def kept(name):
        return sum(hole["kept"] for hole in part[name]["holes"])

    said = f"part {part['name']}: {part['top']}; of {len(part['holes'])} holes {kept('off')}"
    said += f" there, {len(part['off']['loops'])} needless loops"
    if "on" in part:
        said += (f"; filled {kept('on')} there, {sum(loop['closed'] for loop in part['off']['loops'])} closed, "
                 f"{sum(loop['new'] for loop in part['on']['loops'])} new")
    names = [name for name in ("off", "on") if name in part]
    return said + "; covered " + " -> ".join(percent(part[name]["covered"]) for name in names) + " %"


def conditions(told):
    def spread(key, scale=1.0, digits=2):
        values = [scale * part["scan"][key] for part in told]
        return f"{min(values):.{digits}f} to {max(values):.{digits}f}"

    holes = [hole for part in told for hole in part["holes"]]
    sorts = ", ".join(f"{sum(hole['sort'] == sort for hole in holes)} {word}" for sort, word in
                      (("shallow", "blind and shallow"), ("deep", "blind and deep"), ("through", "through")))
    widths = [hole["diameter_mm"] for hole in holes]
    count = {key: sum(part["counts"][key] for part in told) for key in ("bosses", "pockets")}
    tops = ", ".join(f"{sum(part['top'] == kind for part in told)} {word}" for kind, word in
                     (("flat", "flat"), ("leaning", "leaning"), ("cylinder", "cylinders"), ("ball", "balls")))
    return (f"{len(told)} parts, seeds {told[0]['name']} to {told[-1]['name']}: tops {tops}; {len(holes)} drilled "
            f"holes ({sorts}) of {min(widths):.1f} to {max(widths):.1f} mm, {count['bosses']} bosses, "
            f"{count['pockets']} pockets, {sum(len(part['scan']['stains']) for part in told)} stains; the table in "
            f"view of {sum(part['scan']['table_z_mm'] is not None for part in told)}. Pitch {spread('pitch_mm')} mm, "
            f"noise {spread('noise_mm')} mm (1 sigma at normal incidence), {spread('outliers', 100)} % outliers "
            f"anywhere in the range window, {spread('mixed', 100)} % of the readings on steps mixed, "
            f"{spread('dropouts', 100)} % dropouts, glare {spread('glare')} over {spread('glare_width_deg')} degrees.")


def holes(told):
    names = ["off", "on"] if is_filled(told) else ["off"]
    rows = []
    for sort in ("shallow", "deep", "through", "all"):
        own = {name: [found for part in told for hole, found in zip(part["holes"], part[name]["holes"])
                      if sort in (hole["sort"], "all")] for name in names}
        row = [sort, len(own["off"])]
        for name in names:
            row += [sum(one["kept"] for one in own[name]), sum(one["loop"] for one in own[name]),
                    percent(min((one["open"] for one in own[name]), default=None))]
        rows.append(row)
    heads = ["drilled holes", "number"]
    for word in ("without filling", "filled")[:len(names)]:
        heads += [f"{word}: open", "with a loop", "least open, %"]
    return table(heads, rows)


def needless(told, most_mm):
    """Needless loops by what may have made them, and by size."""
    filled = is_filled(told)

    def row(name, own):
        small = [loop for loop in own if loop["size_mm"] <= most_mm]
        large = [loop for loop in own if loop["size_mm"] > most_mm]
        if not filled:
            return [name, len(small), len(large)]
        return [name, len(small), sum(loop["closed"] for loop in small), len(large),
                sum(loop["closed"] for loop in large)]

    every = loops(told)
    causes = [row(text, [loop for loop in every if loop["cause"] == cause]) for cause, text in CAUSES.items()]
    sizes = []
    for low, high in zip(SIZES_MM, SIZES_MM[1:]):
        name = f"{low:g} to {high:g} mm" if high < float("inf") else f"above {low:g} mm"
        sizes.append(row(name, [loop for loop in every if low < loop["size_mm"] <= high]))
    heads = ["needless loops", f"up to {most_mm:g} mm", "closed", "larger", "closed"]
    if not filled:
        heads = heads[:2] + heads[3:4]
    return (table(heads, [*causes, row("all", every)]) + "\n\n" + table(["size", *heads[1:]], sizes))


def covered(told):
    names = ["off", "on"] if is_filled(told) else ["off"]
    rows = []
    for kind in ("flat", "leaning", "cylinder", "ball", "all"):
        own = [part for part in told if kind in (part["top"], "all")]
        row = [kind, len(own)]
        for key in ("covered", "shadow_covered"):
            for name in names:
                values = [part[name][key] for part in own if part[name][key] is not None]
                row += [percent(statistics.mean(values)) if values else "-", percent(min(values, default=None))]
        rows.append(row)
    heads = ["top", "parts"]
    for what in ("the top", "shadows on it"):
        for name in ("", " filled")[:len(names)]:
            heads += [f"{what}{name}: mean, %", "least"]
    return table(heads, rows)


def short(value):
    if isinstance(value, float):
        return f"{value:.3g}"
    if isinstance(value, dict):
        return ", ".join(f"{key} {short(item)}" for key, item in value.items())
    if isinstance(value, list):
        return "(" + ", ".join(short(item) for item in value) + ")"
    return str(value)


def wrong(told):
    rows = []
    for part in told:
        for one in part.get("wrong", []):
            truth = one["truth"]
            if one["what"] == "lost":
                what = f"{truth['sort']} hole of {truth['diameter_mm']:.1f} mm lost, {percent(one['open'], 0)} % open"
                what += "" if one["was_there"] else "; it is not there without filling, either"
                centre = truth["centre_mm"]
            else:
                what = f"{one['what']}: loop of {truth['size_mm']:.1f} mm, {CAUSES[truth['cause']]}"
                centre = truth["centre_mm"]
            said = "; ".join(f"{own['decision']}: {own.get('why', '')}, {own['size_mm']:.1f} mm, {own['nodes']} nodes"
                             f" ({short(own.get('evidence', {}))})" for own in one["decisions"])
            rows.append([part["name"], f"{centre[0]:.1f}, {centre[1]:.1f}", what, said or "nothing is said of it"])
    if not rows:
        return "Nothing was lost, left or made anew."
    heads = ["part", "x, y, mm", "what", "what the command says"]
    return table(heads, rows).replace("---:", "---")


def figures(told, most_mm):
    small = [loop for loop in loops(told) if loop["size_mm"] <= most_mm]
    found = [hole for part in told for hole in part["on"]["holes"]]
    return {"kept": (sum(hole["kept"] for hole in found), len(found)),
            "closed": (sum(loop["closed"] for loop in small), len(small)),
            "left": len(loops(told, "on")), "new": sum(loop["new"] for loop in loops(told, "on"))}


def missed(told, most_mm=15.0):
    if not is_filled(told):
        return []
    own = figures(told, most_mm)
    bars = (("kept", "drilled holes kept", KEPT_BAR), ("closed", f"needless loops up to {most_mm:g} mm closed", CLOSED_BAR))
    return [f"{count} of {of} {what}, not {percent(bar, 0)} %" for key, what, bar in bars
            for count, of in [own[key]] if count < bar * of]


def page(told, most_mm):
    if not told:
        return BEGIN + "\nNone was judged.\n"
    parts = [BEGIN + "\n" + conditions(told), "## Drilled holes", holes(told), "## Needless loops",
             needless(told, most_mm), "## What the faces cover", covered(told)]
    if is_filled(told):
        own = figures(told, most_mm)
        modes = sorted({json.dumps({k: v for k, v in (part["fill"] or {}).items() if k in ("mode", "max_size_mm")})
                        for part in told})
        parts += ["## What went wrong", wrong(told), "## Bars",
                  f"{own['kept'][0]} of {own['kept'][1]} drilled holes kept (bar: {percent(KEPT_BAR, 0)} %); "
                  f"{own['closed'][0]} of {own['closed'][1]} needless loops up to {most_mm:g} mm closed (bar: "
                  f"{percent(CLOSED_BAR, 0)} %); {own['left']} needless loops in the filled files, {own['new']} of them "
                  f"new. Filling as reported: {'; '.join(modes)}."]
        under = missed(told, most_mm)
        parts.append("Missed:\n\n" + "\n".join(f"- {one}" for one in under) if under else "Every bar is held.")
    return "\n\n".join(parts) + "\n"
