#!/usr/bin/env python3
"""Bias of warped derivatives against the number of auxiliary samples, as published in 2023 and 2020.

    python3 -m venv target/warped && target/warped/bin/pip install numpy
    cargo build --release -p drt-cli
    target/warped/bin/python examples/warped/bias.py [NAME|JOB.toml...]

A table for each job, by default of `chess-shadow` and `star-light`, at 16 x 16 pixels and depth 3. The reference
is by path-space, which has no bias. Each row takes as many samples a pixel, a power of two, as
fit `--seconds` of CPU time; a short run beforehand tells how many.

All numbers are of 8 x 8 block means, over colours, and of the job's first parameter. `bias` is the rms difference from
the reference, less what the standard errors of both add to it, over the rms of the reference; with `<`, it is lost in
the noise, and this is what would show at two standard errors. `scale` is the regression of the estimate on the
reference, minus 1: 0 without bias. `noise` is the rms standard error over the rms of the reference, z the difference
over the standard errors of both, about 1 without bias.
"""

import argparse
import json
import math
import os
import pathlib
import subprocess
import tempfile

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("jobs", nargs="*", default=["chess-shadow", "star-light"], help="folders beside this file, or jobs")
    parser.add_argument("--drt", default=HERE.parents[1] / "target/release/drt", help="the drt binary")
    parser.add_argument("--size", type=int, default=16, help="width and height of the images")
    parser.add_argument("--max-depth", type=int, default=3, help="path depth")
    parser.add_argument("--seconds", type=float, default=4, help="CPU time of a row, about")
    parser.add_argument("--reference-seconds", type=float, default=30, help="CPU time of the reference, about")
    parser.add_argument("--samples", default="1,2,4,8,16,32,64", help="numbers of auxiliary samples")
    parser.add_argument("--by", default="points,directions", help="what auxiliary samples are")
    parser.add_argument("--kernels", default="corrected,year-2023,year-2020", help="weights of auxiliary samples")
    parser.add_argument("--seed", type=int, default=1, help="that of the rows; the reference has another")
    return parser.parse_args()


class Refused(Exception):
    """What the program says of a job that it does not take."""


def run(job, settings, spp, seed, options):
    """CPU seconds, block means and their standard errors of one run."""
    with tempfile.TemporaryDirectory() as folder:
        digest, said = pathlib.Path(folder, "digest.json"), pathlib.Path(folder, "said")
        line = [options.drt, "grad", job, "--quiet", "--threads", 1, "--size", f"{options.size}x{options.size}"]
        line += ["--max-depth", options.max_depth, "--spp", spp, "--seed", seed, "--output", digest.with_suffix(".exr"), "--digest", digest]
        for setting in settings:
            line += ["--set", setting]
        with said.open("w") as errors:
            process = subprocess.Popen([str(word) for word in line], stderr=errors)
            _, status, usage = os.wait4(process.pid, 0)
        if status != 0:
            raise Refused(said.read_text().strip().replace("\n", " "))
        blocks = next(iter(json.loads(digest.read_text())["derivatives"].values()))["blocks"]
        return usage.ru_utime + usage.ru_stime, np.array(blocks["mean"]), np.array(blocks["stderr"])


def timed(job, settings, seconds, seed, options):
    """A run of about so many CPU seconds, and its samples per pixel."""
    pilot = 64
    while True:
        least = run(job, settings, 1, seed, options)[0]
        used = run(job, settings, pilot, seed, options)[0]
        # Shorter ones tell of the preparation only.
        if used > 1.5 * least + 0.1 or used > seconds / 4:
            break
        pilot *= 4
    spp = 2 ** max(round(math.log2(pilot * max(seconds - least, 0.1) / max(used - least, 0.01))), 0)
    return spp, run(job, settings, spp, seed, options)


def together(variances):
    """Standard error of the mean of all, where the colours of a block err together."""
    per_block = variances.mean(axis=1)
    return np.sqrt(np.sum(per_block**2)) / len(per_block)


def row(label, settings, reference, job, options):
    try:
        spp, (seconds, value, error) = timed(job, settings, options.seconds, options.seed, options)
    except Refused as refused:
        print(f"| {label} | {refused} | | | | | |", flush=True)
        return
    _, true, true_error = reference
    square = np.mean(true**2) - np.mean(true_error**2)
    variance = error**2 + true_error**2
    difference = value - true
    bias = np.mean(difference**2 - variance)
    # Of a sum of squares of normal numbers of these variances.
    doubt = math.sqrt(2) * together(variance)
    if bias > 2 * doubt:
        bias = f"{math.sqrt(bias / square):.4f}"
    else:
        bias = f"< {math.sqrt((max(bias, 0) + 2 * doubt) / square):.4f}"
    power = np.sum(true**2 - true_error**2)
    scale = np.sum(value * true) / power - 1
    slack = np.sqrt(np.sum(np.sum(np.abs(true) * np.sqrt(variance), axis=1) ** 2)) / power
    noise = math.sqrt(np.mean(error**2) / square)
    known = variance > 0
    z = math.sqrt(np.mean(difference[known] ** 2 / variance[known]))
    print(f"| {label} | {spp} | {bias} | {scale:+.4f} ± {slack:.4f} | {noise:.4f} | {z:.2f} | {seconds:.1f} |", flush=True)


def table(job, options):
    spp, reference = timed(job, ["estimator.kind=path-space"], options.reference_seconds, 1000 + options.seed, options)
    seconds, true, error = reference
    noise = math.sqrt(np.mean(error**2) / (np.mean(true**2) - np.mean(error**2)))
    print(f"\n`{job.parent.name}`, reference of {spp} samples a pixel, noise {noise:.4f}, {seconds:.0f} CPU s:\n")
    print("| by | kernel | samples | spp | bias | scale | noise | rms z | CPU s |")
    print("|---|---|---|---|---|---|---|---|---|", flush=True)
    warped = ["estimator.kind=warped"]
    row("edges | – | –", [*warped, "estimator.warp.by=edges"], reference, job, options)
    for by in options.by.split(","):
        chosen = [*warped, f"estimator.warp.by={by}"]
        for kernel in options.kernels.split(","):
            for samples in options.samples.split(","):
                settings = [*chosen, f"estimator.warp.kernel={kernel}", f"estimator.warp.samples={samples}"]
                row(f"{by} | {kernel} | {samples}", settings, reference, job, options)
        settings = [*chosen, "estimator.warp.kernel=corrected", "estimator.warp.samples=8", "estimator.warp.debiased=true"]
        row(f"{by} | corrected, debiased | 8", settings, reference, job, options)


def main():
    options = arguments()
    for name in options.jobs:
        folder = HERE / name
        table(folder / "job.toml" if folder.is_dir() else pathlib.Path(name), options)


if __name__ == "__main__":
    main()
