"""Least median of squares by NumPy, against what our bench's textbook answers.

Reads lines of JSON from the file that it is told: samples (x, y, z), planes, seed, and the answer: plane (a, b, c) and median.
Draws by a generator of its own (Blackman & Vigna 2021, xoshiro256++), so that nothing of the
product's is taken on trust but the way from random bits to indices, which is told in
`benches/src/mlms/textbook.rs`.
"""

import json
import sys

import numpy as np

MASK = (1 << 64) - 1
LEAST_SINE = 0.02
DRAWS = 8
TOLERANCE = 1e-9


def mix(key):
    key = (key + 0x9E3779B97F4A7C15) & MASK
    key = ((key ^ (key >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    key = ((key ^ (key >> 27)) * 0x94D049BB133111EB) & MASK
    return key ^ (key >> 31)


def rotated(value, bits):
    return ((value << bits) | (value >> (64 - bits))) & MASK


def xoshiro(seed):
    """64 random bits after the other; seeded by SplitMix64."""
    state = [mix((seed + k * 0x9E3779B97F4A7C15) & MASK) for k in range(4)]
    while True:
        a, b, c, d = state
        yield (rotated((a + d) & MASK, 23) + a) & MASK
        c ^= a
        d ^= b
        state = [a ^ d, b ^ c, c ^ ((b << 17) & MASK), rotated(d, 45)]


def triple(bits, number):
    below = lambda shift, limit: (((bits >> shift) & ((1 << 21) - 1)) * limit) >> 21
    first = below(0, number)
    second = below(21, number - 1)
    second += second >= first
    third = below(42, number - 2)
    third += third >= min(first, second)
    third += third >= max(first, second)
    return [first, second, third]


def least_median(samples, planes, seed):
    random = xoshiro(mix(mix(seed ^ mix(0))))
    middle = (len(samples) - 1) // 2
    ones = np.column_stack([samples[:, :2], np.ones(len(samples))])
    best, least, tried = None, np.inf, 0
    for _ in range(planes * DRAWS):
        if tried == planes:
            break
        rows = triple(next(random), len(samples))
        (qx, qy), (rx, ry) = samples[rows[1:], :2] - samples[rows[0], :2]
        if abs(qx * ry - rx * qy) <= LEAST_SINE * np.hypot(qx, qy) * np.hypot(rx, ry):
            continue
        tried += 1
        plane = np.linalg.solve(ones[rows], samples[rows, 2])
        median = np.partition((ones @ plane - samples[:, 2]) ** 2, middle)[middle]
        if median < least:
            best, least = plane, median
    return best, least


def main():
    number, worst = 0, 0.0
    for line in open(sys.argv[1], encoding="utf-8"):
        told = json.loads(line)
        plane, median = least_median(np.array(told["samples"]), told["planes"], told["seed"])
        off = np.abs(np.append(plane, median) - np.append(told["plane"], told["median"]))
        worst = max(worst, float(np.max(off / (1.0 + np.abs(np.append(plane, median))))))
        number += 1
    print(f"{number} windows, farthest apart by {worst:.1e} (allowed {TOLERANCE:.0e})")
    return 0 if number > 0 and worst <= TOLERANCE else 1


if __name__ == "__main__":
    sys.exit(main())
