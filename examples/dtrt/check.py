#!/usr/bin/env python3
"""Compares derivatives on the scenes of dtrt with finite differences, and prints a table in Markdown.

    python3 -m venv target/dtrt && target/dtrt/bin/pip install numpy OpenEXR
    cargo build --release -p drt-cli
    target/dtrt/bin/python examples/dtrt/check.py [--kind KIND...] [NAME...]

Runs `drt check` on each job by each kind of estimator: derivatives on 8 x 8 block means beside finite
differences with common random numbers at a step (mostly the job's) and at half of it. `difference` is the rms difference
of these block means from the finer differences, over their rms; noise is that of the derivative alone. Where they
disagree, the block that differs most is told. Exit code 1 when any disagrees. The scenes must lie
beside the jobs: see README.md.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import OpenEXR

HERE = pathlib.Path(__file__).resolve().parent

# Samples per pixel: what takes each job a few minutes on one core.
SPP = {"glass_1": 512, "multilayer": 512, "shadow_1": 2048, "shadow_2": 512, "camera_pose": 512}
# Steps that differ from the jobs': differences over theirs would be all noise.
STEP = {"glass_1": 0.2, "shadow_2": 0.2, "camera_pose": 0.2}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(SPP)}; all by default")
    parser.add_argument("--drt", default=HERE.parents[1] / "target/release/drt", help="the drt binary")
    parser.add_argument("--kind", nargs="+", default=["radiative", "path-space"], help="kinds of estimators; both by default")
    parser.add_argument("--size", type=int, default=64, help="width and height of the images")
    parser.add_argument("--scale", type=float, default=1, help="factor on the numbers of samples")
    parser.add_argument("--seed", type=int, default=0, help="of the random numbers")
    parser.add_argument("--threads", type=int, default=0, help="threads of each run; all cores by default")
    return parser.parse_args()


def check(name, kind, options):
    """What `drt check` says of a job, as its digest, and what it leaves as images."""
    with tempfile.TemporaryDirectory() as folder:
        image = pathlib.Path(folder, "image.exr")
        line = [options.drt, "check", HERE / f"{name}.toml", "--set", f"estimator.kind={kind}", "--quiet"]
        line += ["--size", f"{options.size}x{options.size}", "--spp", max(1, round(SPP[name] * options.scale))]
        line += ["--set", f"estimator.step={STEP[name]}"] if name in STEP else []
        line += ["--seed", options.seed, "--threads", options.threads, "--digest", "-", "--output", image]
        run = subprocess.run([str(word) for word in line], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        # 1 is a disagreement, which the digest tells in full.
        if run.returncode not in (0, 1):
            sys.exit(f"{name}: drt check failed: {run.stderr.strip()}")
        channels = OpenEXR.File(str(image), separate_channels=True).channels()
        return json.loads(run.stdout), {name: c.pixels.astype(float) for name, c in channels.items()}


def blocks(pixels, name):
    """Means of 8 x 8 cells of a layer."""
    layer = np.stack([pixels[f"{name}.{c}"] for c in "RGB"], axis=-1)
    cuts = [[k * n // 8 for k in range(9)] for n in layer.shape[:2]]
    rows, columns = ([slice(a, b) for a, b in zip(c, c[1:])] for c in cuts)
    return np.array([[layer[r, c].mean(axis=(0, 1)) for c in columns] for r in rows])


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def main():
    options = arguments()
    for name in options.names:
        if name not in SPP:
            sys.exit(f"{name}: expected one of {', '.join(SPP)}")
    print("| job | parameter | estimator | samples | rms z | max z | noise | difference | verdict | core s of the job |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    agree = True
    for name in options.names or SPP:
        for kind in options.kind:
            digest, pixels = check(name, kind, options)
            for row in digest["checks"]:
                ours, theirs = (blocks(pixels, f"{of}_{row['parameter']}") for of in ("d", "fd"))
                verdict = "agrees"
                if not row["agrees"]:
                    agree = False
                    at = np.unravel_index(np.argmax(np.abs(ours - theirs).max(axis=2)), (8, 8))
                    verdict = f"DISAGREES, most at row {at[0]}, column {at[1]}"
                print(
                    f"| {name} | {row['parameter']} | {kind} | {digest['spp']} | {row['rms_z']:.2f} | {row['max_z']:.2f} "
                    f"| {100 * row['relative_noise']:.1f} % | {100 * rms(ours - theirs) / rms(theirs):.1f} % "
                    f"| {verdict} | {digest['cpu_seconds']:.0f} |",
                    flush=True,
                )
            limit = digest["checks"][0]["limit"]
    print(f"\nThe limit of max z is {limit:.2f}, that of rms z 1.3.")
    sys.exit(0 if agree else 1)


if __name__ == "__main__":
    main()
