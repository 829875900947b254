#!/usr/bin/env python3
"""Holds estimators and samplers against each other on these scenes and on those of examples/warped.

    cargo build --release -p drt-cli
    python3 examples/path-space/agree.py [--seconds S] [--size N] [--kinds KIND...] [NAME|JOB.toml...]

Each estimator renders a job's derivatives by paths from the camera and by paths from both ends, until their noise is
1 % or the time is over; finite differences stand beside them.

`noise` is the rms standard error of the 8 x 8 block means of the digest over their rms. `z` holds block means against those
of the row with the least noise: differences over their standard errors, about 1 in rms where both agree. `scale` is the factor, less one, by which all
blocks together are larger than that row's, with its standard error: it knows of what blocks share long before one of them does.
Blocks have weights by what the other rows say of them.
"""

import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
SCENES = ["branches", "bust", "bumpy", "knot", "../warped/teapot-shadow", "../warped/teapot", "../warped/body"]
KINDS = [
    ("path-space", "unidirectional"),
    ("path-space", "bidirectional"),
    ("warped", "unidirectional"),
    ("warped", "bidirectional"),
    ("radiative", "unidirectional"),
    ("finite-difference", "unidirectional"),
    ("finite-difference", "bidirectional"),
]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("jobs", nargs="*", default=SCENES, help="folders beside this file, or jobs; all scenes by default")
    parser.add_argument("--drt", default=HERE.parents[1] / "target/release/drt", help="the drt binary")
    parser.add_argument("--seconds", type=float, default=60, help="time of a row at most")
    parser.add_argument("--size", type=int, default=32, help="width and height of the images")
    parser.add_argument("--kinds", nargs="+", default=[kind for kind, _ in KINDS], help="estimators; all by default")
    parser.add_argument("--noise", type=float, default=0.01, help="noise to stop at")
    return parser.parse_args()


def blocks(job, at, options):
    """Block means and variances of each derivative by an estimator, or what it is refused for."""
    kind, sampling = KINDS[at]
    with tempfile.TemporaryDirectory() as folder:
        digest = pathlib.Path(folder, "digest.json")
        line = [options.drt, "grad", job, "--quiet", "--size", f"{options.size}x{options.size}", "--seed", 100 + at]
        line += ["--set", f"estimator.kind={kind}", "--sampling", sampling, "--output", digest.with_suffix(".exr"), "--digest", digest]
        if kind == "finite-difference":
            # An image first, whose samples a pixel differences then take as well; twice as many images.
            line += ["--seconds", options.seconds / 4]
        else:
            line += ["--seconds", options.seconds, "--target-error", options.noise]
        run = subprocess.run([str(word) for word in line], capture_output=True, text=True)
        if run.returncode != 0:
            return run.stderr.strip().splitlines()[-1]
        of_all = json.loads(digest.read_text())["derivatives"]
    flat = lambda numbers: [c for block in numbers for c in block]
    return {n: (flat(d["blocks"]["mean"]), [e * e for e in flat(d["blocks"]["stderr"])]) for n, d in of_all.items()}


def rms(numbers):
    numbers = list(numbers)
    return math.sqrt(sum(x * x for x in numbers) / max(len(numbers), 1))


def noise_of(row):
    return rms(v**0.5 for v in row[1]) / (rms(row[0]) or math.inf)


def others(rows, left_out):
    """Block means of all other rows together: what these know by themselves."""
    known = [row for kind, row in rows.items() if kind not in left_out]
    return [sum(row[0][i] / row[1][i] for row in known if row[1][i] > 0) for i in range(len(known[0][0]))]


def compared(own, first, like):
    """rms and largest z, and the scale with its standard error."""
    rows = [(a, b, va + vb, w) for (a, va), (b, vb), w in zip(zip(*own), zip(*first), like) if va + vb > 0]
    z = [(a - b) / math.sqrt(v) for a, b, v, _ in rows]
    size = sum(w * b for _, b, _, w in rows)
    off = sum(w * (a - b) for a, b, _, w in rows)
    error = math.sqrt(sum(w * w * v for _, _, v, w in rows))
    return f"{rms(z):.2f} | {max(map(abs, z), default=0):.1f} | {100 * off / size:+.2f} ± {100 * error / abs(size):.2f} %"


def main():
    options = arguments()
    print("| scene | parameter | estimator | paths | noise | rms z | max z | scale |")
    print("|---|---|---|---|---|---|---|---|")
    for name in options.jobs:
        folder = HERE / name
        job = folder / "job.toml" if folder.is_dir() else pathlib.Path(name)
        scene, found = job.parent.name, {}
        for at, (kind, sampling) in enumerate(KINDS):
            if kind not in options.kinds:
                continue
            row = blocks(job, at, options)
            if isinstance(row, str):
                print(f"| {scene} | | {kind} | {sampling} | {row} | | | |", flush=True)
                continue
            for parameter, own in row.items():
                found.setdefault(parameter, {})[at] = own
        for parameter, rows in found.items():
            first = min(rows, key=lambda at: noise_of(rows[at]))
            for at, own in rows.items():
                told = len(rows) > 2 and at != first
                beside = compared(own, rows[first], others(rows, [first, at])) if told else " | | "
                kind, sampling = KINDS[at]
                print(f"| {scene} | {parameter} | {kind} | {sampling} | {100 * noise_of(own):.1f} % | {beside} |", flush=True)


if __name__ == "__main__":
    main()
