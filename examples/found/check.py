#!/usr/bin/env python3
"""Runs drt on inputs that once failed, and prints a table of what is expected and what is seen.

    cargo build --release -p drt-cli
    python3 examples/found/check.py FOLDER [NAME...]

FOLDER holds one folder an input, which this script names; it is not part of the repository, where each kind of input has a
test of its own. Every row runs in a copy of its folder. Exit code 1 when a row does not show what is expected.
"""

import argparse
import json
import math
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROWS = []


def row(folder):
    """Registers a check of a folder; it returns whether it holds, and what was seen."""

    def register(check):
        ROWS.append((folder, check))
        return check

    return register


class Trial:
    """A copy of an input's folder, in which drt is run."""

    def __init__(self, drt, folder):
        self.drt, self.folder = drt, pathlib.Path(folder)

    def run(self, *words, seconds=120, memory=None):
        """Exit code, last line of standard error, digest if there is one, seconds."""
        limit = (lambda: resource.setrlimit(resource.RLIMIT_AS, (memory, memory))) if memory else None
        start = time.monotonic()
        done = subprocess.run(
            [self.drt, *map(str, words)], cwd=self.folder, capture_output=True, text=True, timeout=seconds, preexec_fn=limit
        )
        lines = done.stderr.strip().splitlines()
        digest = json.loads(done.stdout) if done.stdout.startswith("{") else None
        return done.returncode, lines[-1] if lines else "", digest, time.monotonic() - start

    def image(self, scene, spp):
        code, said, digest, _ = self.run("render", scene, "--spp", spp, "--quiet", "-o", "o.exr", "--digest", "-")
        return (digest["image"]["mean"][0], digest["image"]["stderr"][0]) if code == 0 else said

    def derivatives(self, job, kind, *more):
        words = ["grad", job, "--quiet", "-o", "o.exr", "--digest", "-", "--set", f"estimator.kind={kind}", *more]
        code, said, digest, _ = self.run(*words, seconds=600)
        if code != 0:
            raise RuntimeError(said)
        return digest["derivatives"]

    def refused(self, *words, **limits):
        """Whether one line on standard error and exit code 2 are all that comes, within ten seconds."""
        start = time.monotonic()
        code, said, _, seconds = self.run(*words, **limits)
        return code == 2 and seconds < 10, f"exit {code}, {seconds:.1f} s: {said[:160]}"

    def accepted(self, scene, *more):
        code, said, digest, seconds = self.run("render", scene, "--spp", 4, "-o", "o.exr", "--digest", "-", *more)
        mean = f"mean {digest['image']['mean'][0]:.4f}" if digest else ""
        return code == 0, f"exit {code}, {seconds:.1f} s {mean} {said[:140]}"


def z_limit(count):
    """What the largest of so many z passes by chance once in 1000 images."""
    low, high = 0.0, 10.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if math.erfc(middle / math.sqrt(2)) > 0.001 / count else (low, middle)
    return low


def agreement(a, b):
    """Rms and largest z of two derivatives' block means, and whether they agree."""
    z = []
    for x, y, s, t in zip(*(part["blocks"][what] for what in ("mean", "stderr") for part in (a, b))):
        for p, q, u, v in zip(x, y, s, t):
            error = math.hypot(u, v)
            if error > 0:
                z.append((p - q) / error)
    rms = math.sqrt(sum(v * v for v in z) / max(len(z), 1))
    most = max((abs(v) for v in z), default=0.0)
    return rms, most, rms <= 1.3 and most <= z_limit(max(len(z), 1))


def all_agree(trial, job, kinds, *more):
    found = {kind: trial.derivatives(job, kind, *more) for kind in kinds}
    fine, seen = True, []
    for i, one in enumerate(kinds):
        for other in kinds[i + 1 :]:
            for name in found[one]:
                rms, most, agree = agreement(found[one][name], found[other][name])
                fine &= agree
                seen.append(f"{rms:.2f}/{most:.1f}")
    return fine, f"rms z / max z of {', '.join(kinds)}: {' '.join(seen)}"


THREE = ["path-space", "radiative", "warped"]


@row("warped_box_filter")
def warped_box_filter(trial):
    parts = [all_agree(trial, f"{name}.toml", THREE, "--spp", 4096) for name in ("sphere_flat_box", "sphere_r8_box")]
    return all(p[0] for p in parts), "; ".join(p[1] for p in parts)


@row("box_filter")
def box_filter(trial):
    names = ["sphere_r8_point_box", "sphere_r8_point_tent", "cam_sphere_r8_lamp_box", "sphere_flat_box", "sf_1e-12"]
    parts = [all_agree(trial, f"{name}.toml", THREE, "--spp", 8192) for name in names]
    return all(p[0] for p in parts), "; ".join(p[1] for p in parts)


@row("fog_on_floor")
def fog_on_floor(trial):
    text = (trial.folder / "s.xml").read_text()
    gap = text.replace('<translate x="0.0" y="0.0" z="0.0"/>', '<translate x="0.0" y="-1e-15" z="0.0"/>', 1)
    (trial.folder / "gap.xml").write_text(gap)
    (a, s), (b, t) = (trial.image(name, 256) for name in ("s.xml", "gap.xml"))
    fine, said = all_agree(trial, "j.toml", THREE, "--seconds", 12)
    return gap != text and abs(a - b) < 4 * math.hypot(s, t) and fine, f"{a:.5f}, with a gap {b:.5f} ± {t:.5f}; {said}"


@row("lamp_in_ceiling")
def lamp_in_ceiling(trial):
    return all_agree(trial, "j.toml", [*THREE, "finite-difference"], "--seconds", 12)


@row("grazing_camera")
def grazing_camera(trial):
    found = {}
    for name, more in {
        "path-space": ["--set", "estimator.kind=path-space"],
        "both ends": ["--set", "estimator.kind=path-space", "--set", "estimator.sampling=bidirectional"],
    }.items():
        words = ["grad", "j.toml", "--quiet", "-o", "o.exr", "--digest", "-", "--seconds", 20, *more]
        found[name] = trial.run(*words)[2]["derivatives"]["turn"]
    one, other = found.values()
    z = (one["mean"][0] - other["mean"][0]) / math.hypot(one["stderr"][0], other["stderr"][0])
    text = ", ".join(f"{n} {d['mean'][0]:.5f} ± {d['stderr'][0]:.5f}" for n, d in found.items())
    share = one["largest_sample_share"]
    return abs(z) < 4 or share > 0.1, f"{text}, z {z:.1f}, the largest sample is {share:.2f} of the second moment"


@row("negative_sigma")
def negative_sigma(trial):
    fine, said = trial.refused("grad", "fit.toml", "--set", "parameter.st.value=-6", "--spp", 1, "-o", "o.exr")
    return fine and "st" in said, said


@row("checkpoint")
def checkpoint(trial):
    base = ["optimize", "j.toml", "--quiet"]
    half = trial.run(*base, "--set", "optimize.optimizer.iterations=3")
    mesh = trial.folder / "mesh.obj"
    mesh.write_text(mesh.read_text() + "\n# changed\n")
    fine, said = trial.refused(*base)
    return fine and half[0] == 0 and "mesh.obj" in said, said


@row("far")
def far(trial):
    times = {}
    for name in ("near", "s"):
        times[name] = min(trial.run("render", f"{name}.xml", "--spp", 16, "-o", "o.exr", "--quiet")[3] for _ in range(3))
    return times["s"] < 2 * times["near"], f"{times['s']:.2f} s, near {times['near']:.2f} s"


@row("01-legacy-null")
def legacy_null(trial):
    means = {name: trial.image(f"{name}.xml", 256)[0] for name in ("old", "oldnull", "new")}
    return abs(means["old"] - 0.6898) < 0.004 and abs(means["oldnull"] - 0.6898) < 0.004, str(means)


@row("14-exr")
def channels_of_targets(trial):
    fine, said = trial.refused("grad", "job.toml", "--loss", "r.exr", "--spp", 1, "-o", "g.npy")
    grey = trial.run("grad", "job.toml", "--loss", "y.exr", "--spp", 1, "-o", "g.npy", "--quiet")
    return fine and grey[0] == 0, f"{said}; Y alone: exit {grey[0]} {grey[1][:80]}"


@row("18-manyspheres")
def many_spheres(trial):
    seconds = trial.run("info", "n100.xml")[3]
    return seconds < 2, f"info of 100 spheres: {seconds:.2f} s"


def accepts(folder, *scenes):
    @row(folder)
    def check(trial):
        parts = [trial.accepted(scene) for scene in scenes]
        return all(p[0] for p in parts), "; ".join(f"{s}: {p[1]}" for s, p in zip(scenes, parts))


accepts("20-degenmesh", "s.xml")
accepts("19-nestedref", "s.xml", "t.xml")
accepts("22-legacydefaults", *(f"{n}.xml" for n in "bb bm bump coat cu focal ldr nofov scale strict sw sw3 uv".split()))
accepts("26-trilinear", "s.xml")
accepts("28-unused", "s.xml")
accepts("13-volneg", "s.xml")
accepts("21-negeta", "s.xml", "z.xml")


@row("27-cwd")
def working_directory(trial):
    return trial.accepted("scenes/s.xml")


@row("29-milk")
def milk(trial):
    fine, said = trial.refused("render", "s.xml", "-o", "o.exr")
    return fine and "material" in said or trial.accepted("s.xml")[0], said


@row("blendphase_2_40")
def blendphase(trial):
    return trial.refused("render", "s.xml", "--threads", 1, "--spp", 1, "-o", "OUT.exr")


@row("phase8000.xml")
def phase_chain(trial):
    return trial.refused("render", "phase8000.xml", "--spp", 1, "-o", "o.exr")


def refuses(folder, *words, **limits):
    @row(folder)
    def check(trial):
        return trial.refused(*words, **limits)


refuses("png_bomb_target", "optimize", "j.toml", "--threads", 1, memory=6_000_000_000)
refuses("exr_target_header", "optimize", "j.toml", "--threads", 1, memory=6_000_000_000)
refuses("adjoint_nan", "grad", "j.toml", "--adjoint", "tn.exr", "--threads", 1, "--spp", 1, "-o", "OUT.npy")
refuses("array_too_long", "grad", "j.toml", "--threads", 1, "--spp", 1, "-o", "OUT.exr")
refuses("names_a_a_stderr", "grad", "j.toml", "--threads", 1, "--spp", 1, "-o", "OUT.exr")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--drt", default=ROOT / "target/release/drt", type=pathlib.Path)
    options = parser.parse_args()
    bad = 0
    print("| input | as expected | seen |\n|---|---|---|")
    for folder, check in ROWS:
        if options.names and folder not in options.names:
            continue
        with tempfile.TemporaryDirectory() as place:
            # All of it: some inputs use files of others.
            copy = pathlib.Path(place, "copy")
            shutil.copytree(options.folder, copy)
            for path in [copy, *copy.rglob("*")]:
                path.chmod(0o755 if path.is_dir() else 0o644)
            start = copy / folder
            try:
                fine, seen = check(Trial(options.drt.resolve(), start if start.is_dir() else copy))
            except Exception as e:  # A row that cannot be run is a row that fails.
                fine, seen = False, f"{type(e).__name__}: {e}"
        bad += not fine
        print(f"| {folder} | {'yes' if fine else 'NO'} | {seen} |", flush=True)
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
