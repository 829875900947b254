#!/usr/bin/env python3
"""Fits the inverse problems and prints how near they come, in how much time.

    cargo build --release -p drt-cli
    python3 examples/problems/table.py [--threads N] [--jobs N] [--again] [--pictures FOLDER] [--only NAME...]

Each problem is a folder beside this file. Its make.py, if it has one, makes what the scene needs; the job's pictures are rendered
(with another seed than any of the fits'), `drt optimize` runs on the job, and a row of a table in Markdown is printed. What is there
already is read, not run: a stopped fit goes on, a finished one only evaluates its last image; --again removes
all of it and begins anew.

A problem's problem.toml says of which paper it is, and what to reach:

    paper, row                 the year of the paper, and the place in its list; without them, it is beyond the papers
    about                      what is looked for
    bound                      the error to reach
    spp                        samples per pixel of the pictures to fit
    iterations, core_seconds   what the paper needs: iterations, and seconds of all its cores for one of them
    [target]                   the values that are looked for, by parameter
    [shape]                    for a mesh: the group that is fitted, and the files of its start and of its truth
    [volume]                   for a grid: the group that is fitted, the name that the scene has for the grid's file, the files of
                               its start and of its truth, and the sensors that no fit sees, with samples per pixel for these

Errors of parameters are distances between vectors, those of a shape mean distances between surfaces, those of a volume mean
squares of the differences of pictures by sensors that no fit sees, all over that of the start. Where the target is a drawing, there is no truth: the error is the loss over that of the start. Core seconds are of the
whole process, user and system, reading the scene and writing pictures included.
"""

import argparse
import concurrent.futures
import csv
import dataclasses
import json
import math
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tomllib

import pictures
import surfaces
import views

HERE = pathlib.Path(__file__).resolve().parent
HEAD = ["problem", "paper", "looked for", "unknowns", "views", "size", "start", "reached", "error", "iterations (within the bound from)",
        "core s an iteration", "core s", "the paper's core s × iterations", "core s an iteration over the paper's"]


@dataclasses.dataclass
class Fit:
    """What a fit left, iteration by iteration."""

    errors: list
    start: str
    reached: str
    unknowns: int
    core_seconds: float


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="these problems; all by default")
    parser.add_argument("--drt", type=pathlib.Path, default=HERE.parents[1] / "target/release/drt", help="the drt binary")
    parser.add_argument("--threads", type=int, default=0, help="threads of each run; all cores by default")
    parser.add_argument("--jobs", type=int, default=1, help="problems that run at the same time, 1 by default")
    parser.add_argument("--pictures", type=pathlib.Path, help="where to put start, target and result of each as PNG")
    parser.add_argument("--again", action="store_true", help="begin fits anew")
    parser.add_argument("--seed", type=int, help="another seed of the fits; goes with --again")
    return parser.parse_args()


class Problem:
    def __init__(self, name, options):
        self.name, self.options = name, options
        self.folder = HERE / name
        self.run = self.folder / "run"
        self.about = tomllib.loads((self.folder / "problem.toml").read_text())
        self.shape = self.about.get("shape")
        self.volume = self.about.get("volume")
        self.target = self.about.get("target", {})

    def drt(self, *words):
        line = [str(w) for w in (self.options.drt, *words, "--quiet", "--threads", self.options.threads)]
        if subprocess.run(line).returncode != 0:
            sys.exit(f"failed: {' '.join(line)}")

    def at(self, values):
        """The options that set parameters."""
        return [word for name in self.target for word in ("--set", f"parameter.{name}.value={float(values[name])}")]

    def make(self):
        """Assets, and pictures that are not there yet or older than what they show."""
        if self.options.again:
            shutil.rmtree(self.run, ignore_errors=True)
        self.run.mkdir(exist_ok=True)
        if (self.folder / "make.py").exists():
            environment = os.environ | {"DRT": str(self.options.drt), "DRT_THREADS": str(self.options.threads)}
            subprocess.run([sys.executable, str(self.folder / "make.py")], check=True, env=environment)
        generated = self.run / "job.toml"
        self.path = generated if generated.exists() else self.folder / "job.toml"
        self.job = tomllib.loads(self.path.read_text())
        optimize = self.job["optimize"]
        self.pictures = optimize.get("targets") or [view["target"] for view in self.job["view"]]
        self.sensors = optimize.get("sensors", [None] * len(self.pictures))
        if self.target:
            for picture, sensor in zip(self.pictures, self.sensors):
                path = self.path.parent / picture
                if not views.is_newer(path, self.folder / "scene.xml", self.folder / "problem.toml"):
                    sees = ["--sensor", sensor] if sensor else []
                    self.drt("render", self.path, *self.at(self.target), *sees, "--seed", 1, "--spp", self.about["spp"], "--output", path)

    def fit(self):
        seed = ["--seed", self.options.seed] if self.options.seed is not None else []
        self.drt("optimize", self.path, *seed, *(["--restart"] if self.options.again else []))
        out = self.path.parent / self.job["optimize"]["checkpoint"]
        with open(out / "params.csv", newline="") as file:
            rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
        seconds = json.loads((out / "checkpoint.json").read_text())["cpu_seconds"]
        if self.shape:
            start, truth, found = (surfaces.Surface(*surfaces.read_ply(path)) for path in (
                self.folder / self.shape["start"], self.folder / self.shape["truth"], out / f"{self.shape['group']}.ply"))
            before, after = (surfaces.mean_distance(s, truth) for s in (start, found))
            percent = [f"{100 * d / truth.extent:.2g} % of its size" for d in (before, after)]
            errors = [1.0] * (len(rows) - 1) + [after / before]
            unknowns = 3 * len(surfaces.read_ply(self.folder / self.shape["start"])[0])
            return Fit(errors, *percent, unknowns, seconds)
        if self.volume:
            squares = {what: self.held_out_square(what, path) for what, path in self.grids(out).items() if what != "target"}
            errors = [1.0] * (len(rows) - 1) + [squares["reached"] / squares["start"]]
            size = struct.unpack_from("<4i", (self.folder / self.volume["start"]).read_bytes(), 8)
            levels = [f"{pictures.decibels(squares[what]):.1f} dB" for what in ("start", "reached")]
            return Fit(errors, *levels, math.prod(size), seconds)
        if self.target:
            errors = [self.distance(row) / self.distance(rows[0]) for row in rows]
            return Fit(errors, self.short(rows[0]), self.short(rows[-1]), len(self.target), seconds)
        with open(out / "loss.csv", newline="") as file:
            losses = [float(row["loss"]) for row in csv.DictReader(file)]
        unknowns = len(self.job["parameter"])
        return Fit([l / losses[0] for l in losses], f"loss {losses[0]:.3g}", f"loss {losses[-1]:.3g}", unknowns, seconds)

    def grids(self, out):
        """The files of the volume at the start, as it is, and as the fit left it."""
        start, truth = (self.folder / self.volume[what] for what in ("start", "truth"))
        return {"start": start, "target": truth, "reached": out / f"{self.volume['group']}.vol"}

    def held_out(self, what, grid):
        """Pictures of a grid by sensors that no fit sees."""
        for sensor in self.volume["held_out"]:
            picture = self.run / f"{sensor}-{what}.png"
            if not views.is_newer(picture, grid, self.folder / "scene.xml"):
                words = ["-D", f"{self.volume['grid']}={grid}", "--sensor", sensor, "--spp", self.volume["spp"], "--exposure", self.volume["exposure"]]
                self.drt("render", self.folder / "scene.xml", *words, "--output", picture.with_suffix(".exr"), "--preview", picture)
            yield picture

    def held_out_square(self, what, grid):
        """The mean square difference of these to those of the grid as it is."""
        truth = self.held_out("target", self.folder / self.volume["truth"])
        squares = [pictures.mean_square(a, b) for a, b in zip(self.held_out(what, grid), truth)]
        return sum(squares) / len(squares)

    def distance(self, values):
        return math.dist([values[name] for name in self.target], list(self.target.values()))

    def short(self, values):
        return ", ".join(f"{values[name]:.3g}" for name in self.target) if len(self.target) < 6 else "see params.csv"

    def row(self):
        """The row of the table, and whether the fit arrives."""
        self.make()
        fit = self.fit()
        if self.options.pictures:
            self.copy_pictures()
        steps = len(fit.errors) - 1
        # From here on the error stays within the bound.
        late = [i for i, error in enumerate(fit.errors) if error > self.about["bound"]]
        there = late[-1] + 1 if late else 0
        reached = "not reached" if there > steps else "" if self.shape or self.volume else f"{there}"
        each, theirs = fit.core_seconds / steps, self.about.get("core_seconds")
        size = self.size()
        cells = [
            self.name,
            self.about.get("paper", ""),
            self.about["about"],
            fit.unknowns,
            len(self.pictures),
            f"{size[0]}×{size[1]}",
            fit.start,
            fit.reached,
            f"{100 * fit.errors[-1]:.2g} %",
            f"{steps} ({reached})" if reached else f"{steps}",
            f"{each:.2g}",
            f"{fit.core_seconds:.0f}",
            f"{theirs:.0f} × {self.about.get('iterations', 'not told')}" if theirs else "",
            f"1 / {theirs / each:.0f}" if theirs else "",
        ]
        return "| " + " | ".join(map(str, cells)) + " |", there <= steps

    def of_first_view(self, what):
        """A picture that the fit left of its first view, of the start, the target, or the result."""
        out = self.path.parent / self.job["optimize"]["checkpoint"]
        return next(path for path in (out / f"{what}-1.png", out / f"{what}.png") if path.exists())

    def size(self):
        """Width and height of the pictures."""
        return struct.unpack(">2I", self.of_first_view("current").read_bytes()[16:24])

    def copy_pictures(self):
        """Start, target and result, as the fit saw its first view; of a volume, as a sensor sees it that no fit saw."""
        self.options.pictures.mkdir(parents=True, exist_ok=True)
        if self.volume:
            out = self.path.parent / self.job["optimize"]["checkpoint"]
            for what, grid in self.grids(out).items():
                picture, *_ = self.held_out(what, grid)
                shutil.copy(picture, self.options.pictures / f"{self.name}-{what}.png")
            return
        for what, name in (("frame-00000", "start"), ("target", "target"), ("current", "reached")):
            (self.options.pictures / f"{self.name}-{name}.png").write_bytes(self.of_first_view(what).read_bytes())


def order(problem):
    return (problem.about.get("paper", 9999), problem.about.get("row", 0), problem.name)


def main():
    options = arguments()
    names = sorted(path.parent.name for path in HERE.glob("*/problem.toml"))
    for name in options.only or []:
        if name not in names:
            sys.exit(f"{name}: expected one of {', '.join(names)}")
    problems = sorted((Problem(name, options) for name in options.only or names), key=order)
    print("| " + " | ".join(HEAD) + " |")
    print("|" + "---|" * len(HEAD))
    arrive = True
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for row, arrives in pool.map(Problem.row, problems):
            print(row, flush=True)
            arrive &= arrives
    sys.exit(0 if arrive else 1)


if __name__ == "__main__":
    main()
