#!/usr/bin/env python3
"""Times forward images of drt beside Mitsuba 3: variance times seconds, scene file by scene file.

    python3 -m venv target/mitsuba && target/mitsuba/bin/pip install mitsuba numpy
    cargo build --release -p drt-cli
    target/mitsuba/bin/python examples/bench_mitsuba.py

Both programs use all cores and take turns, so that what else the machine does hurts both. Loading is
not counted; Mitsuba's kernels are warm: each scene is rendered once before the clock starts. Work to a
given error is variance x seconds, where the variance is that of the inner 6 x 6 of 8 x 8 block means;
the ratio is drt's work over Mitsuba's, below 1 where drt is faster. The llvm variants need LLVM
(Debian: libllvm19).
"""

import argparse
import math
import statistics
import sys
import time

import numpy as np

from compare_mitsuba import CELLS, HERE, INNER, LEFT_OUT, blocks, digest, rms


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("scenes", nargs="*", help="names of example scenes; all that can be compared by default")
    parser.add_argument("--drt", default=HERE.parent / "target/release/drt", help="the drt binary")
    parser.add_argument("--variant", default="llvm_ad_rgb", help="Mitsuba's variant")
    parser.add_argument("--size", type=int, default=128, help="width and height of the images")
    parser.add_argument("--spp", type=int, default=128, help="samples per pixel of drt")
    parser.add_argument("--pass-spp", type=int, default=64, help="samples per pixel and pass of Mitsuba")
    parser.add_argument("--rounds", type=int, default=5, help="turns that each program takes; times are medians")
    parser.add_argument("--passes", type=int, default=4, help="passes of Mitsuba in each turn")
    return parser.parse_args()


def measure(mi, name, options):
    path = HERE / name / "scene.xml"
    defaults = {"size": str(options.size)}
    # Merged shapes are Mitsuba's own default, and faster.
    scene = mi.load_file(str(path), **defaults)

    def render(seed):
        return blocks(np.array(mi.render(scene, seed=seed, spp=options.pass_spp))[:, :, :3])[INNER, INNER]

    render(0)
    ours, theirs, passes, errors = [], [], [], []
    for turn in range(options.rounds):
        found = digest(options.drt, path, defaults, ["--spp", options.spp, "--seed", turn])
        ours.append(found["seconds"])
        error = np.array(found["image"]["blocks"]["stderr"]).reshape(CELLS, CELLS, 3)[INNER, INNER]
        errors.append(rms(error))
        start = time.perf_counter()
        for _ in range(options.passes):
            passes.append(render(1 + len(passes)))
        theirs.append((time.perf_counter() - start) / options.passes)
    scale = rms(np.mean(passes, axis=0))
    # Each relative to the image, over one turn of drt and one pass of Mitsuba.
    noise = rms(errors) / scale, rms(np.std(passes, axis=0, ddof=1)) / scale
    seconds = statistics.median(ours), statistics.median(theirs)
    work = [n * n * s for n, s in zip(noise, seconds)]
    ratio = work[0] / work[1]
    rate = [options.size**2 * spp / s / 1e6 for spp, s in zip((options.spp, options.pass_spp), seconds)]
    # Variance of a single sample, drt over Mitsuba.
    variance = (noise[0] / noise[1]) ** 2 * options.spp / options.pass_spp
    print(f"| {name} | {ratio:.2f} | {variance:.2f} | {rate[0]:.2f} | {rate[1]:.2f} |", flush=True)
    return ratio


def main():
    options = arguments()
    import mitsuba as mi

    mi.set_variant(options.variant)
    known = sorted(p.parent.name for p in HERE.glob("*/scene.xml"))
    names = options.scenes or [n for n in known if n not in LEFT_OUT]
    print("| scene | work, drt / Mitsuba | variance a sample, drt / Mitsuba | drt, M samples / s | Mitsuba, M samples / s |")
    print("|---|---|---|---|---|")
    ratios = [measure(mi, name, options) for name in names]
    print(f"| geometric mean | {math.exp(statistics.mean(map(math.log, ratios))):.2f} | | | |")
    sys.exit(0)


if __name__ == "__main__":
    main()
