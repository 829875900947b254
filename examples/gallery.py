#!/usr/bin/env python3
"""Makes the pictures of docs/gallery.md from jobs of this repository, and prints the table of their times.

    cargo build --release -p drt-cli
    python3 examples/gallery.py [NAME...] [--drt PROGRAM] [--work FOLDER]

What is in the folder already is not rendered again. Needs Pillow, which makes palettes of 256 colours.
"""

import argparse
import json
import pathlib
import subprocess

from PIL import Image

EXAMPLES = pathlib.Path(__file__).resolve().parent
IMAGES = EXAMPLES.parent / "docs/images"
SIDE = 256
# The layout of a preview: the blank between panels and around them, and the height of a label or a bar.
BLANK, INK, WHITE = (38, 38, 40), (225, 225, 225), (255, 255, 255)
GAP, LINE = 6, 13
# Most colours of derivatives.
RAMP = 120
# A job and samples per pixel.
SCENES = {
    "surface-box": 192,
    "fog-inside": 96,
    "blob": 128,
    "cage": 1024,
    "orthographic": 160,
    "smoke": 768,
    "glass": 96,
    "branches": 160,
    "star": 256,
    "knot": 192,
    "crystal": 256,
    "mirror": 96,
    "tiles": 96,
    "path-space/branches": 128,
    "path-space/bust": 96,
    "path-space/bumpy": 96,
    "path-space/knot": 64,
}


def rendered(program, name, work):
    """The image with its derivatives, and the digest beside it."""
    file = work / f"{name.replace('/', '-')}.exr"
    digest = file.with_suffix(".json")
    if not digest.exists():
        job = EXAMPLES / name / "job.toml"
        size, spp = f"--size={SIDE}x{SIDE}", f"--spp={SCENES[name]}"
        subprocess.run([program, "grad", job, size, spp, "--quiet", "-o", file, "--digest", digest], check=True)
    return file, json.loads(digest.read_text())


def picture(program, file, name):
    """The preview of all layers, in 256 colours, so that the file is small."""
    path = IMAGES / f"{name}.png"
    subprocess.run([program, "preview", file, "-o", path], check=True)
    sheet = Image.open(path).convert("RGB")
    box = (GAP, GAP, GAP + SIDE, GAP + SIDE)
    image = sheet.crop(box)
    # Derivatives have the colours of the bar below the first one, which begins right of the image.
    row, start = GAP + SIDE + LINE + LINE // 2, 2 * GAP + SIDE
    bar = list(dict.fromkeys(sheet.getpixel((x, row)) for x in range(start, start + SIDE)))
    ramp = [INK, BLANK, WHITE, *bar[:: 1 + len(bar) // RAMP]]
    own = image.quantize(256 - len(ramp)).getpalette()[: 3 * (256 - len(ramp))]
    palette = Image.new("P", (1, 1))
    palette.putpalette([*own, *(value for colour in ramp for value in colour)])
    small = sheet.quantize(palette=palette, dither=Image.Dither.NONE)
    small.paste(image.quantize(palette=palette), box)
    small.save(path, optimize=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help="a folder of examples; all by default")
    parser.add_argument("--drt", type=pathlib.Path, default=EXAMPLES.parent / "target/release/drt", help="the drt binary")
    parser.add_argument("--work", type=pathlib.Path, default=EXAMPLES / "run", help="where images are kept; examples/run by default")
    options = parser.parse_args()
    program, work = options.drt.resolve(), options.work
    work.mkdir(parents=True, exist_ok=True)

    print("| scene | estimator | samples a pixel | core-seconds |\n|---|---|---|---|")
    for name in options.names or SCENES:
        file, digest = rendered(program, name, work)
        picture(program, file, name)
        estimator = digest["plan"]["estimator"].split(":")[0]
        print(f"| {name} | `{estimator}` | {digest['spp']} | {digest['cpu_seconds']:.0f} |", flush=True)


if __name__ == "__main__":
    main()
