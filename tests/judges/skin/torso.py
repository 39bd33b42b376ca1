"""A torso by formula, limbs left out: sections as a body scanner would give them.

Nothing here is measured of a person. Widths and depths at seven heights are those of a standing
adult to within a few centimetres; bust, shoulder blades, spine and buttocks are bumps and grooves.
"""

import math
import random

# Height, half width, half depth, exponent of the superellipse, forward shift, millimetres.
STATIONS = [
    (800.0, 175.0, 125.0, 2.3, 0.0),
    (880.0, 180.0, 130.0, 2.4, -5.0),
    (1000.0, 150.0, 105.0, 2.3, 5.0),
    (1100.0, 135.0, 95.0, 2.2, 10.0),
    (1220.0, 155.0, 110.0, 2.3, 8.0),
    (1320.0, 185.0, 110.0, 2.6, 0.0),
    (1430.0, 150.0, 75.0, 2.2, -10.0),
    (1500.0, 62.0, 62.0, 2.0, -15.0),
]

# Height, its spread, angle (0 is to the left, 90 to the front), its spread, how far out, millimetres.
FEATURES = [
    (1290.0, 55.0, 62.0, 22.0, 28.0),
    (1290.0, 55.0, 118.0, 22.0, 28.0),
    (1330.0, 60.0, 240.0, 18.0, 12.0),
    (1330.0, 60.0, 300.0, 18.0, 12.0),
    (1150.0, 260.0, 270.0, 9.0, -14.0),
    (870.0, 70.0, 245.0, 20.0, 30.0),
    (870.0, 70.0, 295.0, 20.0, 30.0),
    (1030.0, 12.0, 90.0, 6.0, -6.0),
]


def at_height(z):
    """Width, depth, exponent and shift by cubic Hermite pieces."""
    k = max(0, min(len(STATIONS) - 2, sum(z >= s[0] for s in STATIONS) - 1))
    a, b = STATIONS[k], STATIONS[k + 1]
    before, after = STATIONS[max(0, k - 1)], STATIONS[min(len(STATIONS) - 1, k + 2)]
    t = (z - a[0]) / (b[0] - a[0])
    values = []
    for d in range(1, 5):
        slope = lambda p, q: (q[d] - p[d]) / (q[0] - p[0]) * (b[0] - a[0]) if p is not q else 0.0
        m0 = (slope(before, a) + slope(a, b)) / 2 if k > 0 else slope(a, b)
        m1 = (slope(a, b) + slope(b, after)) / 2 if k + 2 < len(STATIONS) else slope(a, b)
        h = 2 * t**3 - 3 * t**2 + 1, t**3 - 2 * t**2 + t, -2 * t**3 + 3 * t**2, t**3 - t**2
        values.append(h[0] * a[d] + h[1] * m0 + h[2] * b[d] + h[3] * m1)
    return values


def place(z, angle_deg):
    """A place on the skin, millimetres."""
    width, depth, exponent, shift = at_height(z)
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    power = 2.0 / exponent
    x = width * math.copysign(abs(c) ** power, c)
    y = depth * math.copysign(abs(s) ** power, s)
    out = 0.0
    for height, spread, angle, wide, by in FEATURES:
        turn = (angle_deg - angle + 180.0) % 360.0 - 180.0
        out += by * math.exp(-(((z - height) / spread) ** 2) - (turn / wide) ** 2)
    radius = math.hypot(x, y)
    return (x * (1 + out / radius), y * (1 + out / radius) + shift, z)


def sections(count, points, noise_mm, seed):
    """So many sections from hip to neck, each with so many points, at angles that are not even."""
    draw = random.Random(seed)
    found = []
    for k in range(count):
        z = 810.0 + (1490.0 - 810.0) * k / (count - 1)
        angles = [(j + draw.uniform(-0.3, 0.3)) * 360.0 / points for j in range(points)]
        ring = [place(z, angle) for angle in angles]
        ring = [(x + draw.gauss(0, noise_mm), y + draw.gauss(0, noise_mm), z) for x, y, _ in ring]
        found.append(ring)
    return found


def write(path, rings):
    with open(path, "w", encoding="utf-8") as file:
        for k, ring in enumerate(rings):
            file.write(f"section {k + 1} closed\n")
            file.writelines(f"{x:.4f} {y:.4f} {z:.4f}\n" for x, y, z in ring)
