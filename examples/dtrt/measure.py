#!/usr/bin/env python3
"""Measures time and noise of derivatives on the scenes of dtrt, beside those of that program.

    python3 -m venv target/dtrt && target/dtrt/bin/pip install numpy OpenEXR
    cargo build --release -p drt-cli
    target/dtrt/bin/python examples/dtrt/measure.py [--kind KIND] [JOB.toml...]

The scenes must lie beside the jobs: see README.md. One thread, 64 x 64 pixels, 16 samples a pixel.

Times are CPU seconds of the whole process, user and system, reading and preparing included: the median
over the seeds. Variances are those of single pixels: the scatter over the seeds, averaged over pixels and
colours, times the samples a pixel; the error behind ± is that of this average, from its own scatter over
pixels. `claimed` is what the standard errors in the files say of the same, over the scatter.
`work` is variance x CPU time, drt over dtrt: below 1 where drt needs less.
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

# dtrt on two cores with AVX-512, one thread, the same pixels and samples; ten samples of secondary edges a
# vertex and 32 x 16 of primary edges per pixel of their length. CPU seconds of the derivative, and
# variance x samples of each parameter.
DTRT = {
    "glass_1": (0.764, (0.139, 0.109, 0.120, 0.022)),
    "shadow_1": (0.427, (5.8, 0.38, 6.8)),
    "multilayer": (2.352, (0.024, 0.0005, 0.023)),
}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    jobs = [HERE / f"{name}.toml" for name in DTRT]
    parser.add_argument("jobs", nargs="*", type=pathlib.Path, default=jobs, help="glass_1, shadow_1, multilayer by default")
    parser.add_argument("--drt", default=HERE.parents[1] / "target/release/drt", help="the drt binary")
    parser.add_argument("--kind", default="path-space", help="the kind of estimator")
    parser.add_argument("--size", type=int, default=64, help="width and height of the images")
    parser.add_argument("--spp", type=int, default=16, help="samples per pixel")
    parser.add_argument("--boundary-spp", type=int, help="boundary samples per pixel; as many as --spp by default")
    parser.add_argument("--adaptive", action="store_true", help="noisier pixels take more samples")
    parser.add_argument("--alone", action="store_true", help="each parameter in a run of its own")
    parser.add_argument("--seeds", type=int, default=16, help="runs with different random numbers")
    parser.add_argument("--max-depth", type=int, help="path depth; the job's by default")
    return parser.parse_args()


def run(command, job, seed, options):
    """CPU seconds, digest and images by channel name of one run."""
    with tempfile.TemporaryDirectory() as folder:
        image, digest = pathlib.Path(folder, "image.exr"), pathlib.Path(folder, "digest.json")
        size = f"{options.size}x{options.size}"
        line = [options.drt, command, job, "--quiet", "--threads", 1, "--size", size, "--spp", options.spp]
        line += ["--seed", seed, "--output", image, "--digest", digest]
        if command == "grad":
            line += ["--set", f"estimator.kind={options.kind}"]
            line += ["--set", f"estimator.adaptive={str(options.adaptive).lower()}"]
            if options.boundary_spp is not None:
                line += ["--set", f"estimator.boundary_spp={options.boundary_spp}"]
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


def variances(runs, name, spp):
    """Variance x samples of a pixel's derivative, its error, and what the files claim over it."""
    scatter = np.var([layer(pixels, f"d_{name}") for pixels in runs], axis=0, ddof=1).mean(axis=2)
    claimed = np.mean([layer(pixels, f"d_{name}_stderr") ** 2 for pixels in runs])
    mean = scatter.mean()
    error = scatter.std(ddof=1) / np.sqrt(scatter.size)
    return mean * spp, error * spp, claimed / mean


def alone(job):
    """Jobs of one parameter each, for as long as they are used; beside the whole one, as it names its scene from there."""
    head, *parameters = job.read_text().split("[[parameter]]")
    # What comes after the parameters is of no use without all of them.
    parameters = [text.split("\n[optimize]")[0] for text in parameters]
    for parameter in parameters:
        with tempfile.NamedTemporaryFile("w", suffix=".toml", prefix=f".{job.stem}-", dir=job.parent) as one:
            one.write(f"{head}[[parameter]]{parameter}")
            one.flush()
            yield pathlib.Path(one.name)


def measure(job, options):
    forward = [run("render", job, seed, options)[0] for seed in range(options.seeds)]
    forward = statistics.median(forward)
    # A run of one parameter has no peer: dtrt's times are for all.
    peer = DTRT.get(job.stem) if options.size == 64 and not options.alone else None
    for part in alone(job) if options.alone else [job]:
        seconds, digests, runs = zip(*(run("grad", part, seed, options) for seed in range(options.seeds)))
        report(job, forward, statistics.median(seconds), digests[0]["derivatives"], runs, peer, options)


def report(job, forward, seconds, names, runs, peer, options):
    """Prints a row for each parameter of these runs."""
    samples = options.size**2 * options.spp
    for at, name in enumerate(names):
        variance, error, claimed = variances(runs, name, options.spp)
        work = "–"
        if peer and at < len(peer[1]):
            work = f"{variance * seconds / samples / (peer[1][at] * peer[0] / (64 * 64 * 16)):.2f}"
        print(
            f"| {job.parent.name if job.stem == 'job' else job.stem} | {name} | {forward:.3f} | {seconds:.3f} | {seconds / forward:.1f} "
            f"| {1e6 * seconds / samples:.1f} | {variance:.3g} ± {error:.2g} | {claimed:.2f} | {work} |",
            flush=True,
        )


def main():
    options = arguments()
    print("| scene | parameter | image, CPU s | derivatives, CPU s | ratio | CPU µs a sample | variance × samples "
          "| claimed | work, drt / dtrt |")
    print("|---|---|---|---|---|---|---|---|---|")
    for job in options.jobs:
        measure(job, options)


if __name__ == "__main__":
    main()
