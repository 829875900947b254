#!/usr/bin/env python3
"""Kills drt a hundred times and damages a thousand of the files that it goes on from.

    cargo build --release -p drt-cli
    python3 examples/found/trials.py [--drt BINARY] [--kills 100] [--flips 1000]

*Kills*: `render`, `grad`, `batch` and `optimize` in turn are ended by `kill -9` after random times. Nothing may be left but what
a run that ends by itself leaves, and every file that is there is whole: it is the same to the byte as that of such a run, but for times.
*Flips*: one bit of a shard or of a fit's checkpoint is flipped. `drt merge` and `drt optimize` have to refuse it in one line, without
writing anything.

Exit code 1 when one of these does not hold. Only Python's standard library is needed.
"""

import argparse
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENE = """<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="4"/></integrator>
  <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0 -4 3" target="0 0 0" up="0 0 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="64"/><rfilter type="tent"/></film></sensor>
  <shape type="cube" id="box"><transform name="to_world"><scale value="0.5"/></transform>
    <bsdf type="diffuse" id="paint"><rgb name="reflectance" value="0.5"/></bsdf></shape>
  <shape type="rectangle"><transform name="to_world"><scale value="3"/><translate z="-0.5"/></transform></shape>
  <emitter type="constant" id="sky"/>
</scene>"""
JOB = """scene = "scene.xml"
[estimator]
spp = 16
[[parameter]]
name = "x"
value = 0.1
[[parameter.effect]]
target = "box"
translate = [1, 0, 0]
[optimize]
targets = ["target.exr"]
checkpoint = "fit"
checkpoint_every = 1
optimizer = { kind = "adam", learning_rate = 0.02, iterations = 12 }
"""
COMMANDS = {
    "render": "render job.toml --quiet --spp 256 -o image.exr --digest image.json --preview image.png",
    "grad": "grad job.toml --quiet -o image.exr --digest image.json --preview image.png",
    "batch": "batch job.toml other.toml --quiet -o out --previews",
    "optimize": "optimize job.toml --quiet",
}
# Files that tell times, or show how far a fit is.
TIMED = re.compile(r"report\.html|.*\.jsonl?|(current|difference|derivative-.*)\.png")


def made(drt, parent, name):
    """A folder with the inputs."""
    folder = pathlib.Path(parent, name)
    folder.mkdir()
    (folder / "scene.xml").write_text(SCENE)
    (folder / "job.toml").write_text(JOB)
    (folder / "other.toml").write_text(JOB.replace("0.1", "-0.2"))
    run(drt, folder, "render scene.xml --quiet --spp 64 -o target.exr")
    return folder


def run(drt, folder, line):
    done = subprocess.run([drt, *line.split()], cwd=folder, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"drt {line}: {done.stderr}")


def files(folder):
    return {str(p.relative_to(folder)): p for p in folder.rglob("*") if p.is_file()}


def is_whole(drt, file, expected):
    """True for a file that is as that of a run that ended by itself, or as such a file was earlier."""
    if TIMED.fullmatch(file.name):
        return True
    if file.suffix == ".csv":
        return expected.read_text().startswith(file.read_text())
    if file.suffix == ".exr":
        # It tells times, too; what is cut cannot be shown.
        return subprocess.run([drt, "preview", file, "-o", file.with_name("shown.png")], capture_output=True).returncode == 0
    return file.read_bytes() == expected.read_bytes()


def kills(drt, parent, count, rng):
    """The number of runs that were killed, of those that ended before, and what was left that should not be there."""
    whole, before = {}, set(files(made(drt, parent, "empty")))
    for name, line in COMMANDS.items():
        folder, began = made(drt, parent, f"whole-{name}"), time.monotonic()
        run(drt, folder, line)
        whole[name] = (time.monotonic() - began, files(folder))
    killed, ended, wrong = 0, 0, []
    for k in range(count):
        name = list(COMMANDS)[k % len(COMMANDS)]
        folder = pathlib.Path(shutil.copytree(pathlib.Path(parent, "empty"), pathlib.Path(parent, f"kill-{k}")))
        seconds, expected = whole[name]
        program = subprocess.Popen([drt, *COMMANDS[name].split()], cwd=folder, stderr=subprocess.PIPE)
        try:
            program.wait(rng.uniform(0.0, 1.1 * seconds))
            ended += 1
        except subprocess.TimeoutExpired:
            program.kill()
            program.wait()
            killed += 1
        for path, file in files(folder).items():
            if path not in expected:
                wrong.append(f"{name}: {path} is left")
            elif path not in before and not is_whole(drt, file, expected[path]):
                wrong.append(f"{name}: {path} is not whole")
        # Whatever was left, the same command ends well from there.
        if k < len(COMMANDS):
            run(drt, folder, COMMANDS[name])
        shutil.rmtree(folder)
    return killed, ended, wrong


def flips(drt, parent, count, rng):
    """The number of damaged files that were refused, and those that were not."""
    folder = made(drt, parent, "flips")
    for k in (1, 2):
        run(drt, folder, f"grad job.toml --quiet --spp 8 --shard {k}/2 -o part-{k}.exr")
    run(drt, folder, "optimize job.toml --quiet --iterations 2")
    trials = [("part-1.exr", "merge part-1.exr part-2.exr --quiet -o merged.exr"), ("fit/checkpoint.json", COMMANDS["optimize"])]
    before, refused, wrong = files(folder).keys(), 0, []
    for k in range(count):
        name, line = trials[k % 2]
        file = folder / name
        good = file.read_bytes()
        bit = rng.randrange(8 * len(good))
        bad = bytearray(good)
        bad[bit // 8] ^= 1 << bit % 8
        file.write_bytes(bad)
        done = subprocess.run([drt, *line.split()], cwd=folder, capture_output=True, text=True)
        lines = done.stderr.strip().splitlines()
        if done.returncode == 2 and len(lines) == 1 and file.name in lines[0] and files(folder).keys() == before:
            refused += 1
        else:
            wrong.append(f"{name}, bit {bit}: exit code {done.returncode}, {lines}")
            for path in files(folder).keys() - before:
                (folder / path).unlink()
        file.write_bytes(good)
    return refused, wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--drt", default=ROOT / "target/release/drt", type=pathlib.Path)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--flips", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0, help="of the moments and of the bits")
    options = parser.parse_args()
    drt, rng = str(options.drt.resolve()), random.Random(options.seed)
    with tempfile.TemporaryDirectory() as parent:
        killed, ended, left = kills(drt, parent, options.kills, rng)
        print(f"{killed} killed, {ended} ended before; {len(left)} wrong", *left, sep="\n  ")
        refused, taken = flips(drt, parent, options.flips, rng)
        print(f"{refused} of {options.flips} damaged files refused; {len(taken)} wrong", *taken[:20], sep="\n  ")
    sys.exit(1 if left or taken else 0)


if __name__ == "__main__":
    main()
