#!/usr/bin/env python3
"""Puts images and derivatives out of previews side by side, as in docs/images/strip.png.

    python3 examples/strip.py docs/images/strip.png PREVIEW.png:TILE...

A tile is an image of a preview, counted from 0 (the forward image) row by row. Needs Pillow.
"""

import sys

from PIL import Image

# The layout of a preview: the blank between panels and around them, and the height of a label.
BLANK = (38, 38, 40)
GAP, LABEL = 6, 13


def tile(path, index):
    sheet = Image.open(path).convert("RGB")
    is_blank = [all(sheet.getpixel((x, GAP + y)) == BLANK for y in range(40)) for x in range(sheet.width)]
    side = is_blank.index(True, GAP) - GAP
    columns = (sheet.width - GAP) // (side + GAP)
    left = GAP + index % columns * (side + GAP)
    top = GAP + index // columns * (side + GAP + LABEL)
    return sheet.crop((left, top, left + side, top + side))


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    tiles = [tile(path, int(index)) for path, index in (a.rsplit(":", 1) for a in sys.argv[2:])]
    strip = Image.new("RGB", (sum(t.width for t in tiles), max(t.height for t in tiles)))
    left = 0
    for t in tiles:
        strip.paste(t, (left, 0))
        left += t.width
    strip.save(sys.argv[1], optimize=True)


if __name__ == "__main__":
    main()
