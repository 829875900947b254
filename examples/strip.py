#!/usr/bin/env python3
"""Makes docs/images/strip.png from jobs of this repository: images with derivatives, and a fit.

    cargo build --release -p drt-cli
    python3 examples/strip.py [--drt PROGRAM] [--work FOLDER]

What is in the folder already is not rendered again; a line for each run tells its time. Needs Pillow.
"""

import argparse
import csv
import pathlib
import subprocess
import sys
import time

from PIL import Image, ImageDraw

EXAMPLES = pathlib.Path(__file__).resolve().parent
SIDE = 256
# The layout of a preview: the blank between panels and around them, and the height of a label or a bar.
BLANK, INK = (38, 38, 40), (225, 225, 225)
GAP, LINE = 6, 13

FIT = EXAMPLES / "problems" / "dodecahedron"
# A job, samples per pixel, stops of exposure (None for what the light needs), and tiles: a layer and its label.
DERIVATIVES = [
    ("cage", EXAMPLES / "cage/job.toml", 1024, None, [("image", "image"), ("d_bend", "d_bend")]),
    ("smoke", EXAMPLES / "smoke/job.toml", 768, None, [("image", "image"), ("d_sun-turn", "d_sun-turn")]),
]
FIT_SPP = 96
FIT_EXPOSURE = 2.5
TARGET = {"nod": 0.35, "turn": -0.4}


def timed(program, *arguments):
    start = time.monotonic()
    subprocess.run([program, *map(str, arguments)], check=True)
    print(f"{time.monotonic() - start:.0f} s: drt", *(a.name if isinstance(a, pathlib.Path) else a for a in arguments), flush=True)


def rendered(program, file, command, job, spp, values):
    if not file.exists():
        sets = [f"--set=parameter.{name}.value={value}" for name, value in values.items()]
        timed(program, command, job, f"--size={SIDE}x{SIDE}", f"--spp={spp}", *sets, "-o", file)
    return file


def tile(program, file, layer, label, exposure):
    """A panel of the preview of a layer, with its bar of colours, under another label."""
    sheet = file.with_suffix(".png")
    stops = [] if exposure is None else [f"--exposure={exposure}"]
    # Of two panels, since one alone has no bar.
    subprocess.run([program, "preview", file, "--layer", layer, "--layer", layer, "-o", sheet, *stops], check=True)
    height = GAP + SIDE + 2 * LINE + GAP
    panel = Image.new("RGB", (SIDE + GAP, height), BLANK)
    picture = Image.open(sheet).convert("RGB")
    panel.paste(picture.crop((GAP, 0, GAP + SIDE, min(height, picture.height))), (0, 0))
    draw = ImageDraw.Draw(panel)
    draw.rectangle((0, GAP + SIDE, SIDE, GAP + SIDE + LINE), fill=BLANK)
    draw.text((0, GAP + SIDE + 1), label, fill=INK)
    return panel


def fitted():
    """The values that the fit has reached, by name; table.py has run it."""
    with open(FIT / "run/out/params.csv", newline="") as file:
        *_, last = csv.DictReader(file)
    return {name: last[name] for name in TARGET}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--drt", type=pathlib.Path, default=EXAMPLES.parent / "target/release/drt", help="the drt binary")
    parser.add_argument("--work", type=pathlib.Path, default=EXAMPLES / "run", help="where images are kept; examples/run by default")
    options = parser.parse_args()
    program, work = options.drt.resolve(), options.work
    work.mkdir(parents=True, exist_ok=True)

    first = []
    for name, job, spp, exposure, layers in DERIVATIVES:
        file = rendered(program, work / f"{name}.exr", "grad", job, spp, {})
        first += [tile(program, file, layer, label, exposure) for layer, label in layers]

    subprocess.run([sys.executable, EXAMPLES / "problems/table.py", "--only", FIT.name, "--drt", program], check=True)
    job = FIT / "job.toml"
    start = rendered(program, work / "start.exr", "grad", job, FIT_SPP, {})
    second = [tile(program, start, "image", "before", FIT_EXPOSURE), tile(program, start, "d_turn", "d_turn", None)]
    for label, values in [("target", TARGET), ("after", fitted())]:
        file = rendered(program, work / f"{label}.exr", "render", job, FIT_SPP // 2, values)
        second.append(tile(program, file, "image", label, FIT_EXPOSURE))

    width, height = first[0].size
    strip = Image.new("RGB", (GAP + 4 * width, 2 * height), BLANK)
    for row, tiles in enumerate([first, second]):
        for column, panel in enumerate(tiles):
            strip.paste(panel, (GAP + column * width, row * height))
    strip.save(EXAMPLES.parent / "docs/images/strip.png", optimize=True)


if __name__ == "__main__":
    main()
