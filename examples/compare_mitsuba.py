#!/usr/bin/env python3
"""Compares forward images of drt and Mitsuba 3, scene file by scene file.

    python3 -m venv target/mitsuba && target/mitsuba/bin/pip install mitsuba numpy
    cargo build --release -p drt-cli
    target/mitsuba/bin/python examples/compare_mitsuba.py
    target/mitsuba/bin/python examples/compare_mitsuba.py --sampling bidirectional --integrator ptracer star knot

Each scene is rendered by both programs from the same file. The image is cut into 8 x 8 blocks;
compared are the means of the inner 6 x 6, in standard errors: Mitsuba's film divides by the sum of
filter weights and takes samples only inside the film, so its outermost pixels mean something else.
Mitsuba's standard errors come from independent passes, those of drt from its digest.
The llvm variants need LLVM (Debian: libllvm19); --variant scalar_rgb needs nothing.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ET

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
CELLS = 8
INNER = slice(1, CELLS - 1)
# Agreement by chance fails once in 1000 images, as in `drt check`.
MAX_RMS_Z = 1.3
# Mitsuba counts in single precision, which shows where an image hardly varies.
ROUNDING = 2e-6
# Emission of media is not in Mitsuba 3; files of the others do not come with their scenes.
LEFT_OUT = {"crystal", "bunny", "python"}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("scenes", nargs="*", help="names of example scenes; all that can be compared by default")
    parser.add_argument("--drt", default=HERE.parent / "target/release/drt", help="the drt binary")
    parser.add_argument("--variant", default="llvm_ad_rgb", help="Mitsuba's variant")
    parser.add_argument("--size", type=int, default=64, help="width and height of the images")
    parser.add_argument("--spp", type=int, default=512, help="samples per pixel of drt")
    parser.add_argument("--passes", type=int, default=32, help="independent passes of Mitsuba")
    parser.add_argument("--pass-spp", type=int, default=16, help="samples per pixel and pass of Mitsuba")
    parser.add_argument("--sampling", help="how drt finds paths; as the scene has it by default")
    parser.add_argument("--integrator", help="Mitsuba's integrator in place of the scene's, such as ptracer or volpath")
    parser.add_argument("-D", action="append", default=[], metavar="NAME=VALUE", help="a <default> of the scenes")
    return parser.parse_args()


def blocks(image):
    """Means of 8 x 8 cells, row by row from the top left."""
    cuts = [[k * n // CELLS for k in range(CELLS + 1)] for n in image.shape[:2]]
    rows, columns = ([slice(a, b) for a, b in zip(c, c[1:])] for c in cuts)
    return np.array([[image[r, c].mean(axis=(0, 1)) for c in columns] for r in rows])


def by_mitsuba(mi, path, defaults, options):
    # Merging shapes would hide which one a difference belongs to.
    scene = mi.load_file(str(path), optimize=False, **defaults)
    integrator = scene.integrator()
    if options.integrator:
        root = ET.parse(path).find("integrator")
        # Versions before 2 have these names in camelCase.
        snake = {"maxDepth": "max_depth", "rrDepth": "rr_depth"}
        depths = {snake.get(i.get("name"), i.get("name")): int(i.get("value")) for i in root.findall("integer")}
        integrator = mi.load_dict({"type": options.integrator, **depths})
    passes = []
    for seed in range(options.passes):
        image = np.array(mi.render(scene, integrator=integrator, seed=seed, spp=options.pass_spp))
        passes.append(blocks(image[:, :, :3]))
    passes = np.array(passes)
    return passes.mean(axis=0), passes.std(axis=0, ddof=1) / np.sqrt(len(passes))


def digest(drt, path, defaults, options):
    """What drt says of an image it renders."""
    with tempfile.TemporaryDirectory() as folder:
        image = pathlib.Path(folder, "image.exr")
        command = [drt, "render", path, "--output", image, "--digest", "-", "--quiet", *options]
        for name, value in defaults.items():
            command += ["-D", f"{name}={value}"]
        run = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    if run.returncode != 0:
        sys.exit(f"{path}: drt failed: {run.stderr.strip()}")
    return json.loads(run.stdout)


def by_drt(path, defaults, options):
    extra = ["--sampling", options.sampling] if options.sampling else []
    grid = digest(options.drt, path, defaults, ["--spp", options.spp, *extra])["image"]["blocks"]
    return (np.array(grid[key]).reshape(CELLS, CELLS, 3) for key in ("mean", "stderr"))


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def largest_by_chance(count):
    """What the largest of `count` standard normal numbers exceeds once in 1000 times."""
    from statistics import NormalDist

    return NormalDist().inv_cdf(1 - 0.001 / (2 * count))


def compare(mi, name, options):
    path = HERE / name / "scene.xml"
    defaults = dict(d.split("=", 1) for d in options.D) | {"size": str(options.size)}
    start = time.time()
    ours, our_error = by_drt(path, defaults, options)
    middle = time.time()
    theirs, their_error = by_mitsuba(mi, path, defaults, options)
    seconds = middle - start, time.time() - middle
    ours, our_error, theirs, their_error = (a[INNER, INNER] for a in (ours, our_error, theirs, their_error))
    if not theirs.any():
        # Such as `ptracer` in a medium whose null interface is between the light's paths and the camera.
        print(f"| {name} | {ours.mean():.5f} | 0 | Mitsuba's image is black: nothing to compare with |", flush=True)
        return False
    z = (ours - theirs) / np.sqrt(our_error**2 + their_error**2 + (ROUNDING * theirs) ** 2 + 1e-300)
    agrees = rms(z) <= MAX_RMS_Z and np.abs(z).max() <= largest_by_chance(z.size)
    print(
        f"| {name} | {ours.mean():.5f} | {theirs.mean():.5f} | {100 * (ours.mean() / theirs.mean() - 1):+.2f} % "
        f"| {100 * rms(ours - theirs) / rms(theirs):.2f} % | {100 * rms(our_error) / rms(theirs):.2f} % "
        f"| {100 * rms(their_error) / rms(theirs):.2f} % | {rms(z):.2f} | {np.abs(z).max():.2f} "
        f"| {seconds[0]:.1f} / {seconds[1]:.1f} | {'agrees' if agrees else 'DISAGREES'} |",
        flush=True,
    )
    if not agrees:
        with np.printoptions(precision=1, suppress=True, linewidth=120):
            print("z, mean over the channels:", z.mean(axis=2), sep="\n")
    return agrees


def main():
    options = arguments()
    import mitsuba as mi

    mi.set_variant(options.variant)
    known = sorted(p.parent.name for p in HERE.glob("*/scene.xml"))
    names = options.scenes or [n for n in known if n not in LEFT_OUT]
    print("| scene | drt | Mitsuba | difference | rms block difference | noise drt | noise Mitsuba "
          "| rms z | max z | seconds | |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    results = [compare(mi, name, options) for name in names]
    sys.exit(0 if all(results) else 1)


if __name__ == "__main__":
    main()
