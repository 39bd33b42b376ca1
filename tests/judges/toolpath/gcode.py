"""A reader of NC code that knows nothing of who wrote it: moves of the tool's tip, in order.

It takes what LinuxCNC's and Fanuc's controls take of ISO 6983: G0 to G3 with I, J and K from the
start, G17 to G19, absolute millimetres, one work offset, length offsets that put the tip where the
words say. Any other word is an error.
"""

import math
import re

WORD = re.compile(r"([A-Z])([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))")
COMMENT = re.compile(r"\([^)]*\)")
# First and second axis of a plane.
PLANES = {17: (0, 1), 18: (2, 0), 19: (1, 2)}
# Codes that change nothing about where the tip goes.
SILENT = {21, 40, 43, 49, 54, 55, 56, 57, 58, 59, 64, 80, 90, 94}
# As far up as the machine goes.
ALOFT = 1e6


def words_of(line):
    """Letters with their numbers; raises where a character belongs to none."""
    text = COMMENT.sub("", line).strip().upper().replace(" ", "")
    if text in ("", "%"):
        return []
    if "".join(letter + number for letter, number in WORD.findall(text)) != text:
        raise ValueError(f"not understood: {line!r}")
    return [(letter, float(number)) for letter, number in WORD.findall(text)]


def arc_points(start, end, plane, centre, clockwise, chord_mm):
    """Points of an arc, the last included, chords within `chord_mm` of it."""
    first, second = plane
    across = 3 - first - second
    a = math.atan2(start[second] - centre[second], start[first] - centre[first])
    b = math.atan2(end[second] - centre[second], end[first] - centre[first])
    turn = (a - b) if clockwise else (b - a)
    turn %= 2 * math.pi
    turn = turn or 2 * math.pi
    radius = math.hypot(start[first] - centre[first], start[second] - centre[second])
    count = max(1, math.ceil(turn / math.sqrt(8 * chord_mm / radius)))
    for k in range(1, count):
        angle = a + (-turn if clockwise else turn) * k / count
        point = [0.0] * 3
        point[first] = centre[first] + radius * math.cos(angle)
        point[second] = centre[second] + radius * math.sin(angle)
        point[across] = start[across] + (end[across] - start[across]) * k / count
        yield point
    yield list(end)


def strokes(text, chord_mm):
    """Straight moves as (is rapid, from, to); arcs are chords within `chord_mm`."""
    at, motion, plane, moves = [None, None, ALOFT], 0, PLANES[17], []
    for line in text.splitlines():
        target, offset, aloft, absolute = list(at), [0.0] * 3, False, True
        is_move = False
        for letter, number in words_of(line):
            if letter == "G":
                code = int(number)
                if code in (0, 1, 2, 3):
                    motion = code
                elif code in PLANES:
                    plane = PLANES[code]
                elif code in (28, 53):
                    aloft = True
                elif code == 91:
                    absolute = False
                elif code not in SILENT:
                    raise ValueError(f"G{number}: {line!r}")
            elif letter in "XYZ":
                target["XYZ".index(letter)] = number
                is_move = True
            elif letter in "IJK":
                offset["IJK".index(letter)] = number
            elif letter not in "FSTMHPO":
                raise ValueError(f"{letter}: {line!r}")
        if aloft:
            target = [at[0], at[1], ALOFT]
        elif not absolute:
            raise ValueError(f"an incremental move: {line!r}")
        if is_move:
            if None not in at:
                if motion in (2, 3) and not aloft:
                    centre = [a + b for a, b in zip(at, offset)]
                    ends = arc_points(at, target, plane, centre, motion == 2, chord_mm)
                else:
                    ends = [target]
                for end in ends:
                    moves.append((motion == 0 or aloft, tuple(at), tuple(end)))
                    at = end
            at = list(target)
    return moves
