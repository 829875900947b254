#!/usr/bin/env python3
"""Compares two builds of `drt` on the jobs in examples/: python3 .ci/same_pixels.py OLD NEW

Pixels must be the same bit for bit, in both kinds of estimator, forward and reverse; the exit code
tells. Of those that are not, the largest difference is printed, over the root mean square of its image.
With --rounding R differences of up to R of that pass, too. With --instructions it also counts the instructions of each run (valgrind's callgrind), and
prints those of NEW over those of OLD per sample: start-up is taken out by a run with fewer samples.
Names of jobs after the two programs choose among them.
"""
import argparse
import json
import pathlib
import re
import struct
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
KINDS = ["path-space", "radiative", "warped"]


def cases(names):
    for job in sorted(ROOT.glob("examples/*/job.toml")):
        name = job.parent.name
        # Meshes of these have to be fetched or made.
        if name in ("bunny", "python") or (names and name not in names):
            continue
        yield f"{name} render", job, ["render"], []
        for kind in KINDS:
            own = ["--set", f'estimator.kind="{kind}"']
            yield f"{name} {kind}", job, ["grad", "--terms"], own
            yield f"{name} {kind} adaptive", job, ["grad"], own + ["--set", "estimator.adaptive=true"]
            yield f"{name} {kind} reverse", job, ["grad"], own + ["--adjoint", "ADJOINT"]
        yield f"{name} finite-difference", job, ["grad"], ["--set", 'estimator.kind="finite-difference"']


def command(program, job, call, options, work, samples, size="24x24"):
    options = [str(work / "adjoint.exr") if o == "ADJOINT" else o for o in options]
    reverse = "--adjoint" in options
    out = ["-o", str(work / "gradient.npy")] if reverse else ["-o", str(work / "image.exr"), "--digest", str(work / "digest.json")]
    return [str(program), *call, str(job), "--size", size, "--spp", str(samples), "--seed", "3",
            "--threads", "1", "--quiet", *out, *options]


def numbers(data):
    """The images that a result holds, each a list of numbers."""
    if data.startswith(b"\x93NUMPY"):
        body = data[10 + struct.unpack("<H", data[8:10])[0]:]
        return [struct.unpack(f"<{len(body) // 8}d", body)]
    if data.startswith(b"exit"):
        return [[float("nan")]]
    kept = json.loads(data)
    images = [kept["image"], *(kept["derivatives"] or {}).values()]
    return [[v for block in image["blocks"]["mean"] for v in block] for image in images]


def difference(old, new):
    """The largest difference of two results, over the root mean square of what it is of."""
    if old == new:
        return 0.0
    largest = 0.0
    for a, b in zip(numbers(old), numbers(new), strict=True):
        size = (sum(x * x for x in a) / len(a)) ** 0.5
        apart = max(abs(x - y) for x, y in zip(a, b, strict=True))
        largest = max(largest, apart / size if apart > 0 else 0.0)
    return largest


def result(program, case, work):
    """What a run computes, as bytes."""
    _, job, call, options = case
    done = subprocess.run(command(program, job, call, options, work, 16), capture_output=True, text=True)
    if done.returncode != 0:
        return b"exit %d: " % done.returncode + done.stderr.encode()
    if "--adjoint" in options:
        return (work / "gradient.npy").read_bytes()
    digest = json.loads((work / "digest.json").read_text())
    kept = {k: digest.get(k) for k in ("image", "derivatives", "non_finite")}
    return json.dumps(kept).encode()


def instructions(program, case, work):
    """Instructions of the samples of a run."""
    _, job, call, options = case
    counts = []
    for samples in (2, 10):
        run = command(program, job, call, options, work, samples)
        tool = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={work}/callgrind.out"]
        done = subprocess.run([*tool, *run], capture_output=True, text=True)
        counts.append(int(re.search(r"Collected : (\d+)", done.stderr)[1]))
    return counts[1] - counts[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("old", type=pathlib.Path)
    parser.add_argument("new", type=pathlib.Path)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--instructions", action="store_true")
    parser.add_argument("--rounding", type=float, default=0.0)
    args = parser.parse_intermixed_args()
    different = 0
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        for case in cases(args.names):
            # The adjoint is the image itself.
            adjoint = [str(args.old), "render", str(case[1]), "--size", "24x24", "--spp", "4", "--quiet",
                       "-o", str(work / "adjoint.exr")]
            subprocess.run(adjoint, check=True)
            apart = difference(result(args.old, case, work), result(args.new, case, work))
            same = apart <= args.rounding
            different += not same
            line = f"{'same' if same else 'DIFFERENT':9} {case[0]:32}"
            if apart != 0.0:
                line += f" by {apart:.1e}"
            if args.instructions:
                old, new = (instructions(p, case, work) for p in (args.old, args.new))
                line += f" {new / old:.3f}"
            print(line, flush=True)
    print(f"{different} differ")
    return 1 if different else 0


sys.exit(main())
