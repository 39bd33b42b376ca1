"""Puts pictures side by side at one height.

    python beside.py OUT.png LEFT.png [...] [--height PIXELS] [--colours NUMBER]

Needs the package pillow.
"""

import argparse

from PIL import Image


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out")
    parser.add_argument("pictures", nargs="+")
    parser.add_argument("--height", type=int, default=480)
    parser.add_argument("--colours", type=int, help="as few as these make a small file")
    options = parser.parse_args()
    pictures = [Image.open(path).convert("RGB") for path in options.pictures]
    scaled = [p.resize((round(p.width * options.height / p.height), options.height)) for p in pictures]
    sheet = Image.new("RGB", (sum(p.width for p in scaled), options.height), "white")
    x = 0
    for picture in scaled:
        sheet.paste(picture, (x, 0))
        x += picture.width
    if options.colours:
        sheet = sheet.quantize(options.colours, dither=Image.Dither.NONE)
    sheet.save(options.out, optimize=True)


if __name__ == "__main__":
    main()
