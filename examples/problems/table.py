#!/usr/bin/env python3
"""Fits the inverse problems and prints how near they come, in how much time.

    cargo build --release -p drt-cli
    python3 examples/problems/table.py [--threads N] [--again] [--pictures FOLDER] [NAME...]

Renders the targets (once; another seed than any of the fits'), runs `drt optimize` on each job, and prints a
table in Markdown. What is there already is read, not run: a stopped fit goes on, a finished one only evaluates
its last image; --again begins all anew. The scenes of dtrt must lie beside their jobs: see
examples/dtrt/README.md. The bunny of the row `bunny-scan` is not part of this project either:
--bunny PATH/TO/stanford-bunny.obj.

Errors are distances between vectors of parameters, over that of the start. `core s` are processor seconds of
the whole process, user and system, reading the scene and writing pictures included.
"""

import argparse
import csv
import dataclasses
import json
import math
import pathlib
import subprocess
import sys

EXAMPLES = pathlib.Path(__file__).resolve().parents[1]


@dataclasses.dataclass
class Problem:
    job: str
    target: dict
    bound: float
    """The error that a fit must reach."""
    spp: int
    """Samples per pixel of the targets."""
    peer: float
    """Core seconds of one iteration of the papers' programs."""
    peer_iterations: int
    sensors: tuple = (None,)
    define: tuple = ()
    more: tuple = ()
    """Options of its own."""

    def folder(self, name):
        return (EXAMPLES / self.job).parent.joinpath(*self.run(name))

    def run(self, name):
        """Where results are, from the job's folder."""
        return ("run", name) if self.job.startswith("dtrt") else ("..", "run", name)


BODY = {
    "top": (0.3, -0.3, 0.2),
    "right": (-0.25, 0.3, -0.3),
    "front": (-0.3, 0.2, 0.3),
    "left": (0.3, -0.25, 0.25),
    "back": (0.25, -0.2, -0.3),
}
BODY = {f"{vertex}-{axis}": v for vertex, vs in BODY.items() for axis, v in zip("xyz", vs)}
BODY |= {"roughness": -0.4, "density": 0.4}

# Peers: the authors' program of 2019 on two cores with AVX-512 (shadow_1: scaled by samples from a run with
# fewer), and what the paper of 2021 says of its own on eight.
PROBLEMS = {
    "glass_1": Problem(
        "dtrt/glass_1.toml", {"apple-x": -5, "apple-y": -3, "apple-z": -4, "roughness": -2.5}, 0.02, 128, 13 * 60, 150
    ),
    "shadow_1": Problem("dtrt/shadow_1.toml", {"box-x": 0.7, "box-y": -0.7, "box-z": -1}, 0.02, 128, 437, 150),
    "multilayer": Problem(
        "dtrt/multilayer.toml", {"apple-x": -1, "apple-y": -2.5, "apple-z": -1}, 0.02, 64, 32 * 60, 150
    ),
    "shadow_2": Problem("dtrt/shadow_2.toml", {"turn": 1.6, "density": 1.4}, 0.02, 256, 7 * 60, 100),
    "camera_pose": Problem(
        "dtrt/camera_pose.toml", {"camera-x": -1.6, "camera-z": 1.2, "nod": -1.5}, 0.02, 128, 7 * 60, 500
    ),
    "branches": Problem("problems/branches/job.toml", {"turn": 0.5}, 0.05, 2048, 8 * 39, 100),
    "bunny": Problem("problems/bunny/job.toml", BODY, 0.05, 8192, 8 * 575, 125, ("front", "side", "corner", "behind", "above")),
}
SCAN = ("scale=10", "x=0.17", "y=-0.25")
# Four large iterations at the end instead of one, after which noise left anything from 2 to 6 %.
SCAN_STEPS = ("--iterations", 18, "--set", "optimize.spp=[[0, 256], [8, 768], [14, 3072], [18, 768]]")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(PROBLEMS)}; all by default")
    parser.add_argument("--drt", default=EXAMPLES.parent / "target/release/drt", help="the drt binary")
    parser.add_argument("--threads", type=int, default=0, help="threads of each run; all cores by default")
    parser.add_argument("--bunny", type=pathlib.Path, help="a scanned bunny, 0.15 high, for a row of its own")
    parser.add_argument("--pictures", type=pathlib.Path, help="where to put start, target and result of each as PNG")
    parser.add_argument("--again", action="store_true", help="begin fits anew")
    parser.add_argument("--seed", type=int, help="another seed of the fits; goes with --again")
    return parser.parse_args()


def drt(options, *line):
    words = [options.drt, *line, "--quiet", "--threads", options.threads]
    if subprocess.run([str(w) for w in words]).returncode != 0:
        sys.exit(f"failed: {' '.join(map(str, words))}")


def fit(name, problem, options):
    """Makes what is missing; steps taken, values by iteration, core seconds."""
    job, folder = EXAMPLES / problem.job, problem.folder(name)
    folder.mkdir(parents=True, exist_ok=True)
    defines = [word for d in problem.define for word in ("-D", d)]
    values = at(problem.target, problem.target)
    targets = []
    for sensor in problem.sensors:
        target = folder / f"{sensor or 'target'}.exr"
        targets.append("/".join([*problem.run(name), target.name]))
        if not target.exists():
            sees = ["--sensor", sensor] if sensor else []
            drt(options, "render", job, *values, *defines, *sees, "--seed", 1, "--spp", problem.spp, "--output", target)
    line = ["optimize", job, *defines, "--set", f"optimize.targets={json.dumps(targets)}"]
    line += ["--set", f"optimize.checkpoint={json.dumps('/'.join(problem.run(name)))}"]
    line += ["--seed", options.seed] if options.seed is not None else []
    drt(options, *line, *problem.more, *(["--restart"] if options.again else []))
    with open(folder / "params.csv", newline="") as file:
        rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
    seconds = json.loads((folder / "checkpoint.json").read_text())["cpu_seconds"]
    return rows, seconds


def render_pictures(name, problem, rows, options):
    """Start, target and result, by the first of the cameras."""
    options.pictures.mkdir(parents=True, exist_ok=True)
    for stage, values in (("start", rows[0]), ("target", problem.target), ("reached", rows[-1])):
        line = ["render", EXAMPLES / problem.job, *at(values, problem.target)]
        line += [word for d in problem.define for word in ("-D", d)]
        line += ["--sensor", problem.sensors[0]] if problem.sensors[0] else []
        line += ["--size", "96x96", "--spp", 64, "--seed", 2]
        drt(options, *line, "--preview", options.pictures / f"{name}-{stage}.png")


def at(values, names):
    """The options that set parameters."""
    return [word for name in names for word in ("--set", f"parameter.{name}.value={float(values[name])}")]


def distance(values, target):
    return math.dist([values[name] for name in target], list(target.values()))


def short(values, target):
    return ", ".join(f"{values[name]:.3g}" for name in target) if len(target) < 6 else "see params.csv"


def row(name, problem, options):
    rows, seconds = fit(name, problem, options)
    if options.pictures:
        render_pictures(name, problem, rows, options)
    errors = [distance(values, problem.target) / distance(rows[0], problem.target) for values in rows]
    iterations = len(rows) - 1
    # From here on it stays below the bound.
    late = [i for i, error in enumerate(errors) if error > problem.bound]
    there = late[-1] + 1 if late else 0
    reached = f"{there}" if there <= iterations else "–"
    each = seconds / iterations
    cells = [
        name,
        len(problem.target),
        short(rows[0], problem.target),
        short(problem.target, problem.target) if len(problem.target) < 6 else f"{len(problem.target)} values",
        short(rows[-1], problem.target),
        f"{100 * errors[-1]:.1f} %",
        f"{iterations} ({reached})",
        f"{each:.2g}",
        f"{seconds:.0f}",
        f"{problem.peer:.0f} × {problem.peer_iterations}",
        f"{seconds / problem.peer:.2g}",
    ]
    print("| " + " | ".join(map(str, cells)) + " |", flush=True)
    return errors[-1] <= problem.bound


def main():
    options = arguments()
    problems = dict(PROBLEMS)
    if options.bunny:
        mesh = f"mesh={options.bunny.resolve()}"
        problems["bunny-scan"] = dataclasses.replace(PROBLEMS["bunny"], define=(mesh, *SCAN), more=SCAN_STEPS)
    names = options.names or list(problems)
    for name in names:
        if name not in problems:
            sys.exit(f"{name}: expected one of {', '.join(problems)}")
    print("| problem | parameters | start | target | reached | error | iterations (within the bound from) "
          "| core s an iteration | core s | theirs, core s × iterations | core s / theirs of one iteration |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    reached = [row(name, problems[name], options) for name in names]
    sys.exit(0 if all(reached) else 1)


if __name__ == "__main__":
    main()
