#!/usr/bin/env python3
"""Compares the work of the estimators with that of `auto`, which chooses one of them: python3 examples/auto_table.py [JOB.toml...]

    cargo build --release -p drt-cli

Derivative images of each job, or of all jobs of the examples, are estimated by each of path-space, radiative, warped and auto, with as many samples.
The work of an estimator is the variance of a parameter's derivative (the sum over blocks of pixels and channels) times processor time. It is
taken relative to the best of the three for each parameter, and averaged over the parameters. The processor time of auto includes its pilot. Where samples are
rare and large, one run tells little of a variance: the work is the median over several seeds.
"""

import argparse
import json
import math
import pathlib
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
KINDS = ("path-space", "radiative", "warped")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("jobs", nargs="*", type=pathlib.Path)
    parser.add_argument("--drt", default=HERE.parent / "target/release/drt", help="the drt binary")
    parser.add_argument("--spp", type=int, default=64, help="samples per pixel")
    parser.add_argument("--seeds", type=int, default=1, help="number of seeds, an odd one")
    parser.add_argument("--size", default="64x64", help="of the images")
    return parser.parse_args()


def measure(job, kind, options, folder):
    """Median work by parameter and what the plan says of the estimator, or nothing where the estimator refuses the job."""
    digest = pathlib.Path(folder) / "digest.json"
    line = [options.drt, "grad", job, "--quiet", "--threads", 1, "--spp", options.spp, "--size", options.size]
    line += ["--set", f"estimator.kind={kind}", "--output", pathlib.Path(folder) / "image.exr", "--digest", digest]
    works, taken = {}, ""
    for seed in range(options.seeds):
        if subprocess.run([str(word) for word in [*line, "--seed", seed]], capture_output=True).returncode != 0:
            return None
        report = json.loads(digest.read_text())
        taken = report["plan"].get("estimator", "")
        for name, derivative in report["derivatives"].items():
            variance = sum(error * error for block in derivative["blocks"]["stderr"] for error in block)
            works.setdefault(name, []).append(variance * report["cpu_seconds"])
    return {name: statistics.median(each) for name, each in works.items()}, taken


def row(job, options, folder):
    """The work of each relative to the best of the three, and of which estimator auto made its choice."""
    measured = {kind: measure(job, kind, options, folder) for kind in (*KINDS, "auto")}
    able = [kind for kind in KINDS if measured[kind]]
    if not able or not measured["auto"]:
        return None
    least = {name: min(measured[kind][0][name] for kind in able) for name in measured["auto"][0]}
    seen = [name for name, work in least.items() if work > 0]
    if not seen:
        return None

    def mean(kind):
        return sum(measured[kind][0][name] / least[name] for name in seen) / len(seen)

    best = min(mean(kind) for kind in able)
    return {kind: mean(kind) / best for kind in (*able, "auto")}, measured["auto"][1].split(":")[0]


def main():
    options = arguments()
    every = [path for pattern in ("*/job.toml", "path-space/*/*.toml", "warped/*/*.toml", "problems/*/job.toml") for path in sorted(HERE.glob(pattern))]
    print("| job | path-space | radiative | warped | auto | auto takes |\n|---|---|---|---|---|---|")
    ratios = []
    with tempfile.TemporaryDirectory() as folder:
        for job in options.jobs or every:
            job = job.resolve()
            found = row(job, options, folder)
            name = "/".join(job.parts[-3:-1] if job.parts[-3] != "examples" else job.parts[-2:-1])
            if found is None:
                print(f"{name}: no derivative image by auto", file=sys.stderr)
                continue
            work, taken = found
            ratios.append(work["auto"])
            cells = [f"{work[kind]:.2f}" if kind in work else "refused" for kind in (*KINDS, "auto")]
            print(f"| {name} | {' | '.join(cells)} | {taken} |", flush=True)
    if ratios:
        mean = math.exp(sum(map(math.log, ratios)) / len(ratios))
        print(f"\nauto: {mean:.2f} in the mean of {len(ratios)} jobs (geometric), at most {max(ratios):.2f}")


if __name__ == "__main__":
    main()
