#!/usr/bin/env python3
"""Measures time and noise of warped derivatives on these scenes, beside those of another estimator.

    python3 -m venv target/warped && target/warped/bin/pip install numpy OpenEXR
    cargo build --release -p drt-cli
    target/warped/bin/python examples/warped/compare.py [--kinds KIND,KIND...] [NAME|JOB.toml...]

One thread, 64 x 64 pixels, 64 samples a pixel, four runs of different random numbers for each row.

Times are CPU seconds of the whole process, user and system, reading and preparing included: the median over
the seeds. Variances are the mean over the seeds of the squared standard errors in the files, over pixels (or
the 8 x 8 block means of the digest) and colours.
`noise` is the root of the pixels' variance over the rms derivative; the latter is that of the mean over the
seeds, less what noise adds to it.
`claimed` is the pixels' variance over the scatter over the seeds: 1 where the standard errors are right.
`work` is variance x CPU time over that of the first kind: below 1 where this kind needs less.
`z` compares block means with those of the first kind, all seeds merged: their differences over the standard
errors of these. About 1 in rms where the two kinds agree.
"""

import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

import numpy as np
import OpenEXR

HERE = pathlib.Path(__file__).resolve().parent
SCENES = ["chess", "body", "teapot", "star-light", "chess-shadow", "in-glass", "bulb", "cube-light"]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("jobs", nargs="*", default=SCENES, help="folders beside this file, or jobs; all folders by default")
    parser.add_argument("--drt", default=HERE.parents[1] / "target/release/drt", help="the drt binary")
    parser.add_argument("--kinds", default="path-space,warped", help="kinds of estimators; the first is what others are held against")
    parser.add_argument("--size", type=int, default=64, help="width and height of the images")
    parser.add_argument("--spp", type=int, default=64, help="samples per pixel")
    parser.add_argument("--seeds", type=int, default=4, help="runs with different random numbers")
    parser.add_argument("--max-depth", type=int, help="path depth; the scene's by default")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="a key of the job, for all kinds")
    return parser.parse_args()


def run(command, job, seed, options, settings=()):
    """CPU seconds, digest and images by channel name of one run."""
    with tempfile.TemporaryDirectory() as folder:
        image, digest = pathlib.Path(folder, "image.exr"), pathlib.Path(folder, "digest.json")
        size = f"{options.size}x{options.size}"
        line = [options.drt, command, job, "--quiet", "--threads", 1, "--size", size, "--spp", options.spp]
        line += ["--seed", seed, "--output", image, "--digest", digest]
        for setting in settings:
            line += ["--set", setting]
        if options.max_depth is not None:
            line += ["--max-depth", options.max_depth]
        process = subprocess.Popen([str(word) for word in line])
        _, status, usage = os.wait4(process.pid, 0)
        if status != 0:
            sys.exit(f"{job}: drt {command} failed")
        pixels = {name: c.pixels for name, c in OpenEXR.File(str(image), separate_channels=True).channels().items()}
        return usage.ru_utime + usage.ru_stime, json.loads(digest.read_text()), pixels


def layer(pixels, name):
    return np.stack([pixels[f"{name}.{c}"] for c in "RGB"], axis=-1).astype(float)


def summary(runs, name):
    """What a row needs of all runs of one kind."""
    seconds, digests, images = zip(*runs)
    values = np.stack([layer(pixels, f"d_{name}") for pixels in images])
    variance = np.mean([layer(pixels, f"d_{name}_stderr") ** 2 for pixels in images])
    blocks = [digest["derivatives"][name]["blocks"] for digest in digests]
    errors = np.array([block["stderr"] for block in blocks]) ** 2
    seeds = len(runs)
    return {
        "seconds": statistics.median(seconds),
        "variance": variance,
        "square": np.mean(values.mean(axis=0) ** 2) - variance / seeds,
        "claimed": variance / np.var(values, axis=0, ddof=1).mean() if seeds > 1 else np.nan,
        "block variance": errors.mean(),
        "blocks": np.mean([block["mean"] for block in blocks], axis=0),
        "block errors": errors.mean(axis=0) / seeds,
    }


def row(label, kind, image, own, first):
    """Prints the row of a kind; without `first`, that of the first kind."""
    # Too noisy to know its size.
    noise = f"{np.sqrt(own['variance'] / own['square']):.2f}" if own["square"] > 0 else "–"
    beside = "– | – | – | –"
    if first:
        works = [own[key] * own["seconds"] / (first[key] * first["seconds"]) for key in ("variance", "block variance")]
        errors = own["block errors"] + first["block errors"]
        known = errors > 0
        z = (own["blocks"] - first["blocks"])[known] / np.sqrt(errors[known])
        beside = f"{works[0]:.3g} | {works[1]:.3g} | {np.sqrt(np.mean(z**2)):.2f} | {np.abs(z).max():.1f}"
    print(
        f"| {label} | {kind} | {image:.2f} | {own['seconds']:.2f} | {own['seconds'] / image:.1f} | {noise} "
        f"| {own['claimed']:.2f} | {beside} |",
        flush=True,
    )


def measure(job, label, options):
    seeds = range(options.seeds)
    image = statistics.median(run("render", job, seed, options)[0] for seed in seeds)
    first = {}
    for at, kind in enumerate(options.kinds.split(",")):
        settings = [f"estimator.kind={kind}", *options.set]
        # Seeds of its own: kinds share what they do alike.
        runs = [run("grad", job, 1000 * at + seed, options, settings) for seed in seeds]
        names = list(runs[0][1]["derivatives"])
        for name in names:
            own = summary(runs, name)
            row(label if len(names) == 1 else f"{label}, {name}", kind, image, own, first.get(name))
            first.setdefault(name, own)


def main():
    options = arguments()
    print("| scene | kind | image, CPU s | derivative, CPU s | ratio | noise | claimed | work, pixels | work, blocks "
          "| rms z | max z |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for name in options.jobs:
        folder = HERE / name
        job = folder / "job.toml" if folder.is_dir() else pathlib.Path(name)
        measure(job, job.parent.name if job.stem == "job" else f"{job.parent.name}, {job.stem}", options)


if __name__ == "__main__":
    main()
