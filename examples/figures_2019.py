#!/usr/bin/env python3
"""Rebuilds Figs. 8 and 10 of the 2019 paper: parts of a derivative, and finite differences in equal time.

    python3 -m venv target/figures && target/figures/bin/pip install numpy OpenEXR pillow
    cargo build --release -p drt-cli
    target/figures/bin/python examples/figures_2019.py

Writes components.png, missing.png and equal-time.png to docs/images/radiative, and prints two tables in
Markdown. What is under target/figures-2019 is read, not run again; --again begins anew.

Every derivative image is shown with white for zero, red for positive and blue for negative, all of a row on
one scale. Errors are those of pixels: the root of the mean over pixels and colours of the squared difference
from the reference, over that of the reference itself, whose own error is subtracted. The reference of a derivative
is the mean of long runs by both estimators. CPU seconds are user and system of the whole process.
"""

import argparse
import dataclasses
import json
import pathlib
import shutil
import subprocess
import sys

import numpy as np
import OpenEXR
from PIL import Image, ImageDraw, ImageFont

HERE = pathlib.Path(__file__).resolve().parent
# Spacings of finite differences, as in the paper, and that of the long ones.
STEPS = (0.1, 0.01)
FINE = 0.02
# Layers of `drt grad --terms`, and what they are in the 2019 form.
TERMS = {
    "interior": "interior",
    "flux": "medium boundary",
    "primary": "edges seen by camera",
    "direct": "edges, first vertex",
    "indirect": "edges, later vertices",
}
CELLS = 8


@dataclasses.dataclass
class Row:
    job: str
    parameter: str

    def label(self):
        return f"{self.job}: {self.parameter}"


ROWS = [Row("fog-box", "up"), Row("fog-box", "sideways"), Row("blob", "blob-y")]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--drt", default=HERE.parent / "target/release/drt", help="the drt binary")
    parser.add_argument("--size", type=int, default=80, help="width and height of the images")
    parser.add_argument("--seconds", type=float, default=8, help="CPU seconds of each image of equal time")
    parser.add_argument("--long", type=float, default=12, help="reference runs take this many times as long")
    parser.add_argument("--threads", type=int, default=1, help="threads of each run")
    parser.add_argument("--folder", type=pathlib.Path, default=HERE.parent / "docs/images/radiative", help="where pictures go")
    parser.add_argument("--work", type=pathlib.Path, default=HERE.parent / "target/figures-2019", help="where images are kept")
    parser.add_argument("--again", action="store_true", help="forget what was rendered")
    return parser.parse_args()


class Run:
    """A finished image file: its layers by name, samples and CPU seconds."""

    def __init__(self, path):
        self.facts = json.loads(path.with_suffix(".json").read_text())
        channels = OpenEXR.File(str(path), separate_channels=True).channels()
        self.pixels = {name: c.pixels.astype(float) for name, c in channels.items()}

    def layer(self, name):
        dot = f"{name}." if name else ""
        return np.stack([self.pixels[f"{dot}{c}"] for c in "RGB"], axis=-1)

    def terms(self, name):
        """The terms of a derivative that there are."""
        return {t: self.layer(f"{name}.{t}") for t in TERMS if f"{name}.{t}.R" in self.pixels}

    def block_errors(self, parameter):
        """Standard errors of 8 x 8 block means of a derivative."""
        return np.array(self.facts["derivatives"][parameter]["blocks"]["stderr"]).reshape(CELLS, CELLS, 3)


class Renderer:
    def __init__(self, options):
        self.options = options
        options.work.mkdir(parents=True, exist_ok=True)

    def job(self, name, parameters):
        """A copy of a job with some of its parameters."""
        source = HERE / name / "job.toml"
        head, *blocks = source.read_text().split("[[parameter]]\n")
        head = head.replace('"scene.xml"', json.dumps(str(source.with_name("scene.xml"))))
        kept = [b for b in blocks if any(b.startswith(f'name = "{p}"\n') for p in parameters)]
        path = self.options.work / f"{'-'.join([name, *parameters])}.toml"
        path.write_text("[[parameter]]\n".join([head, *kept]))
        return path

    def run(self, name, command, job, spp, seed, *more):
        """Runs drt, unless the image is there already."""
        path = self.options.work / f"{name}.exr"
        if not path.exists():
            size = f"{self.options.size}x{self.options.size}"
            line = [self.options.drt, command, job, "--quiet", "--size", size, "--spp", spp]
            line += ["--seed", seed, "--threads", self.options.threads, *more]
            line += ["--output", path, "--digest", path.with_suffix(".json")]
            if subprocess.run([str(word) for word in line]).returncode != 0:
                sys.exit(f"failed: {' '.join(map(str, line))}")
        return Run(path)

    def timed(self, name, command, job, seconds, seed, *more):
        """As `run`, with as many samples as fit into a time."""
        known = self.options.work / f"{name}.json"
        if known.exists():
            return self.run(name, command, job, json.loads(known.read_text())["spp"], seed, *more)
        spp, taken = 4, 0.0
        # Long enough for preparing not to count.
        while taken < 0.05 * seconds:
            trial = self.options.work / "trial.exr"
            trial.unlink(missing_ok=True)
            spp *= 2
            taken = self.run("trial", command, job, spp, seed, *more).facts["cpu_seconds"]
        return self.run(name, command, job, max(2, round(spp * seconds / taken / 2) * 2), seed, *more)

    def derivatives(self, name, row, kind, seconds, seed):
        """By all parameters of a job that are in the figures, at once."""
        job = self.job(row.job, [r.parameter for r in ROWS if r.job == row.job])
        more = ["--terms", "--set", f"estimator.kind={kind}"]
        return self.timed(f"{row.job}-{name}", "grad", job, seconds, seed, *more)

    def common(self, name, row, step, seconds, seed):
        """Central differences with common random numbers, and their CPU seconds."""
        job = self.job(row.job, [row.parameter])
        more = ["--set", "estimator.kind=finite-difference", "--set", f"estimator.step={step}"]
        # The file holds the image as well, which no difference needs.
        run = self.timed(f"{row.job}-{row.parameter}-{name}", "grad", job, seconds * 3 / 2, seed, *more)
        return run, run.facts["cpu_seconds"] * 2 / 3

    def independent(self, row, step, seconds):
        """A central difference of two images that have no random numbers in common, and its CPU seconds."""
        job = self.job(row.job, [row.parameter])
        runs = [
            self.timed(
                f"{row.job}-{row.parameter}-{side}{step}", "render", job, seconds / 2, seed,
                "--set", f"parameter.{row.parameter}.value={float(side + str(step))}",
            )
            for seed, side in ((11, "-"), (12, "+"))
        ]
        below, above = runs
        difference = (above.layer("") - below.layer("")) / (2 * step)
        return difference, sum(r.facts["cpu_seconds"] for r in runs), above.facts["spp"]


def rms(image):
    return float(np.sqrt(np.mean(np.square(image))))


def blocks(image):
    cuts = [[k * n // CELLS for k in range(CELLS + 1)] for n in image.shape[:2]]
    rows, columns = ([slice(a, b) for a, b in zip(c, c[1:])] for c in cuts)
    return np.array([[image[r, c].mean(axis=(0, 1)) for c in columns] for r in rows])


class Reference:
    """The mean of long runs by both estimators, weighted by their variances, and its standard error."""

    def __init__(self, runs, parameter):
        means = [run.layer(f"d_{parameter}") for run in runs]
        errors = [rms(run.layer(f"d_{parameter}_stderr")) for run in runs]
        weights = np.array([1 / e**2 for e in errors])
        weights /= weights.sum()
        self.image = sum(w * m for w, m in zip(weights, means))
        self.error = float(np.sqrt(sum((w * e) ** 2 for w, e in zip(weights, errors))))
        self.gap = rms(means[0] - means[1]) / np.hypot(*errors)

    def error_of(self, image):
        square = rms(image - self.image) ** 2 - self.error**2
        return np.sqrt(max(square, 0.0)) / rms(self.image)


# Pictures: the colours of `drt grad --preview`.
NEGATIVE, POSITIVE = np.array([0.02, 0.12, 0.55]), np.array([0.55, 0.03, 0.04])
BACKGROUND, INK = (38, 38, 40), (225, 225, 225)
GAP, LABEL, LEFT = 4, 30, 20


def encode(linear):
    linear = np.clip(linear, 0, 1)
    curve = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return (255 * curve + 0.5).astype(np.uint8)


def exposed(image):
    return encode(image / np.quantile(image.max(axis=2), 0.99))


def diverging(image, scale):
    value = np.clip(image.mean(axis=2, keepdims=True) / scale, -1, 1)
    end = np.where(value < 0, NEGATIVE, POSITIVE)
    return encode(1 - np.abs(value) * (1 - end))


def scale_of(image):
    return np.quantile(np.abs(image.mean(axis=2)), 0.98)


def sheet(path, rows, titles, zoom):
    """A table of pictures with a title above each column and a label left of each row."""
    side = rows[0][1][0].shape[0] * zoom
    width = LEFT + len(titles) * (side + GAP)
    canvas = Image.new("RGB", (width, LABEL + len(rows) * (side + GAP)), BACKGROUND)
    draw, font = ImageDraw.Draw(canvas), ImageFont.load_default(11)
    for column, title in enumerate(titles):
        draw.multiline_text((LEFT + column * (side + GAP) + 2, 1), title, INK, font, spacing=2)
    for row, (label, pictures) in enumerate(rows):
        top = LABEL + row * (side + GAP)
        text = Image.new("RGB", (side, LEFT), BACKGROUND)
        ImageDraw.Draw(text).text((2, 2), label, INK, font)
        canvas.paste(text.rotate(90, expand=True), (0, top))
        for column, picture in enumerate(pictures):
            if picture is None:
                continue
            tile = Image.fromarray(picture).resize((side, side), Image.Resampling.NEAREST)
            canvas.paste(tile, (LEFT + column * (side + GAP), top))
    canvas.save(path, optimize=True)


def wrapped(text):
    return text.replace(", ", ",\n")


def components(renderer, options):
    """Fig. 8: a derivative and what it is the sum of; and what is missing without the boundary terms."""
    rows, without = [], []
    print("| job | parameter | left out | rms difference from finite differences | rms z | max z |")
    print("|---|---|---|---|---|---|")
    for row in ROWS:
        name = f"d_{row.parameter}"
        long = renderer.derivatives("radiative-long", row, "radiative", options.seconds * options.long, 1)
        total = long.layer(name)
        terms = long.terms(name)
        if rms(total - sum(terms.values())) > 1e-5 * rms(total):
            sys.exit(f"{row.job}: the terms of {row.parameter} do not add up to it")
        scale = scale_of(total)
        shown = [diverging(terms[t], scale) if t in terms else None for t in TERMS]
        rows.append((row.label(), [exposed(long.layer("")), diverging(total, scale), *shown]))
        seconds = options.seconds * options.long / 2
        differences, _ = renderer.common("differences-long", row, FINE, seconds, 2)
        judge, interior = differences.layer(name), terms["interior"]
        pictures = [diverging(image, scale) for image in (judge, total, interior, interior - judge)]
        pictures += [diverging(total - terms[t], scale) if t in terms else None for t in TERMS if t != "interior"]
        without.append((row.label(), pictures))
        error = np.hypot(differences.block_errors(row.parameter), long.block_errors(row.parameter))
        cases = {"nothing": [], "all boundary terms": [t for t in terms if t != "interior"]}
        cases |= {TERMS[t]: [t] for t in terms if t != "interior"}
        for label, left_out in cases.items():
            image = total - sum((terms[t] for t in left_out), np.zeros_like(total))
            difference = blocks(image) - blocks(judge)
            z = difference / error
            print(
                f"| {row.job} | {row.parameter} | {label} | {100 * rms(difference) / rms(blocks(judge)):.1f} % "
                f"| {rms(z):.2f} | {np.abs(z).max():.1f} |",
                flush=True,
            )
    titles = ["image", "derivative:\nthe sum of", *(wrapped(t) for t in TERMS.values())]
    sheet(options.folder / "components.png", rows, titles, 2)
    titles = [f"finite differences,\n+-{FINE}, long", "radiative", "without any\nboundary term", "its error"]
    titles += ["without medium\nboundary", "without edges\nseen by camera", "without edges,\nfirst vertex", "without edges,\nlater vertices"]
    sheet(options.folder / "missing.png", without, titles, 2)


def equal_time(renderer, references, options):
    """Fig. 10: derivatives beside finite differences of the same time."""
    rows = []
    print("| job | parameter | estimate | samples | CPU s | error |")
    print("|---|---|---|---|---|---|")
    for row in ROWS:
        name, reference = f"d_{row.parameter}", references(row)
        estimates = {}
        for kind in ("radiative", "path-space"):
            run = renderer.derivatives(kind, row, kind, options.seconds, 3)
            estimates[kind] = run.layer(name), run.facts["cpu_seconds"], run.facts["spp"]
        for step in STEPS:
            run, seconds = renderer.common(f"common-{step}", row, step, options.seconds, 4)
            estimates[f"common, ±{step}"] = run.layer(name), seconds, run.facts["spp"]
        for step in STEPS:
            estimates[f"independent, ±{step}"] = renderer.independent(row, step, options.seconds)
        for label, (image, seconds, spp) in estimates.items():
            print(
                f"| {row.job} | {row.parameter} | {label} | {spp} | {seconds:.1f} | {100 * reference.error_of(image):.0f} % |",
                flush=True,
            )
        own = 100 * reference.error / rms(reference.image)
        print(f"| {row.job} | {row.parameter} | the reference itself; its two halves differ by | | | {own:.1f} %; {reference.gap:.2f} standard errors |", flush=True)
        scale = scale_of(reference.image)
        images = [reference.image, *(image for image, _, _ in estimates.values())]
        rows.append((row.label(), [diverging(image, scale) for image in images]))
    titles = ["reference", "radiative", "path-space", *(f"common random\nnumbers, +-{s}" for s in STEPS)]
    titles += [f"independent,\n+-{s}" for s in STEPS]
    sheet(options.folder / "equal-time.png", rows, titles, 2)


def main():
    options = arguments()
    if options.again:
        shutil.rmtree(options.work, ignore_errors=True)
    options.folder.mkdir(parents=True, exist_ok=True)
    renderer = Renderer(options)

    def references(row):
        kinds = {"radiative": 1, "path-space": 5}
        seconds = options.seconds * options.long
        runs = [renderer.derivatives(f"{kind}-long", row, kind, seconds, seed) for kind, seed in kinds.items()]
        return Reference(runs, row.parameter)

    components(renderer, options)
    print()
    equal_time(renderer, references, options)


if __name__ == "__main__":
    main()
