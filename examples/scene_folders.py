#!/usr/bin/env python3
"""Loads and renders all scenes below some folders at a tiny size, and prints what becomes of each:

    cargo build --release -p drt-cli
    python3 examples/scene_folders.py FOLDER [FOLDER ...] [--drt PROGRAM] [--seconds 60] [--tsv]

A file counts as a scene when its root is <scene>, a sensor is in it, and no other one includes it. The table has the file, the outcome (renders, notes, refused,
timeout, crashed) and the first line of the message. Notes are what was passed over or mended. Exits with 1 where a scene
crashed or took too long; one that is refused is an answer.
"""
import argparse
import pathlib
import re
import subprocess
import sys
import tempfile
import time


def scenes(top):
    texts = {path: path.read_text(errors="replace") for path in sorted(top.rglob("*.xml"))}
    named = re.compile(r"<include\s[^>]*filename=\"([^\"]*)\"")
    parts = {pathlib.PurePath(name).name for text in texts.values() for name in named.findall(text)}
    for path, text in texts.items():
        # What includes a sensor need not have the word in it.
        whole = re.search(r"<scene\b", text) and ("<sensor" in text or "<include" in text)
        if whole and path.name not in parts:
            yield path


def outcome(program, top, scene, seconds, image):
    command = [program, "render", str(scene.relative_to(top)), "-o", image, "--size", "16x16", "--spp", "1", "--max-depth", "4"]
    start = time.time()
    try:
        # Scenes of others search files in the working directory, too.
        run = subprocess.run(command, cwd=top, capture_output=True, text=True, errors="replace", timeout=seconds)
    except subprocess.TimeoutExpired:
        return "timeout", f"more than {seconds} s", seconds
    lines = [line for line in run.stderr.splitlines() if line.strip()]
    error = next((line for line in lines if "error: " in line), "")
    took = time.time() - start
    if run.returncode == 2:
        return "refused", error.split("error: ", 1)[-1], took
    if run.returncode != 0:
        return "crashed", f"exit {run.returncode}: {lines[-1] if lines else ''}", took
    notes = [line.split("warning: ", 1)[1] for line in lines if "warning: " in line]
    return ("notes", f"{len(notes)}: {notes[0]}", took) if notes else ("renders", "", took)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=pathlib.Path)
    parser.add_argument("--drt", default="target/release/drt")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--tsv", action="store_true", help="tabs between columns, messages in full")
    options = parser.parse_args()
    program = str(pathlib.Path(options.drt).resolve())
    counts = {}
    with tempfile.TemporaryDirectory() as folder:
        image = str(pathlib.Path(folder) / "a.exr")
        for top in options.folders:
            for scene in scenes(top):
                kind, message, took = outcome(program, top, scene, options.seconds, image)
                counts[kind] = counts.get(kind, 0) + 1
                name = scene.relative_to(top)
                if options.tsv:
                    print(name, kind, f"{took:.1f}", message, sep="\t", flush=True)
                else:
                    print(f"{str(name):48} {kind:8} {took:5.1f} s  {message[:160]}", flush=True)
    print(", ".join(f"{n} {kind}" for kind, n in sorted(counts.items())), file=sys.stderr)
    return 1 if counts.keys() & {"crashed", "timeout"} else 0


sys.exit(main())
