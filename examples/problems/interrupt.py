#!/usr/bin/env python3
"""Kills a fit ten times at random moments, lets it go on each time, and compares it with one left alone.

    python3 examples/problems/interrupt.py [--drt BINARY] [--kills 10] JOB.toml [options of drt optimize]

Runs the job in two folders of a temporary one, the second time with `kill -9` after random times, and compares
parameters, losses, pictures and the state of the optimiser byte for byte. Exit code 1 when they differ.
The targets must be there.
"""

import argparse
import json
import pathlib
import random
import subprocess
import sys
import tempfile
import time

# These tell times, which differ.
TIMED = {"report.html"}


def state(folder):
    """Every file by name, the checkpoint without its times."""
    files = {p.name: p.read_bytes() for p in folder.iterdir() if p.name not in TIMED}
    checkpoint = json.loads(files.pop("checkpoint.json"))
    # The checksum is of the times, too.
    checkpoint = {k: v for k, v in checkpoint.items() if "seconds" not in k and k != "crc32"}
    return files | {"checkpoint.json": json.dumps(checkpoint).encode()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--drt", default=pathlib.Path(__file__).resolve().parents[2] / "target/release/drt")
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0, help="of the moments")
    parser.add_argument("job")
    options, rest = parser.parse_known_args()
    rng = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as folder:
        alone, killed = pathlib.Path(folder, "alone"), pathlib.Path(folder, "killed")

        def start(checkpoint):
            place = f"optimize.checkpoint={json.dumps(str(checkpoint))}"
            return subprocess.Popen([str(options.drt), "optimize", options.job, "--quiet", "--set", place, *rest])

        began = time.monotonic()
        if start(alone).wait() != 0:
            sys.exit("the fit failed")
        whole = time.monotonic() - began
        kills = []
        while len(kills) < options.kills:
            run, patience = start(killed), rng.uniform(0.0, 2.0 * whole / options.kills)
            try:
                if run.wait(patience) == 0:
                    break
                sys.exit("the fit failed")
            except subprocess.TimeoutExpired:
                run.kill()
                run.wait()
                # Only whole lines of a whole file are ever seen.
                table = killed / "params.csv"
                steps = len(table.read_text().splitlines()) - 2 if table.exists() else 0
                kills.append(f"{patience:.1f} s, at step {steps} of what is stored")
        print(f"{len(kills)} kills in a run of {whole:.1f} s:", *kills, sep="\n  ")
        if start(killed).wait() != 0:
            sys.exit("the fit failed to go on")
        a, b = state(alone), state(killed)
        differ = sorted(name for name in a.keys() | b.keys() if a.get(name) != b.get(name))
        print(f"{len(a)} files,", "all the same" if not differ else f"these differ: {', '.join(differ)}")
        sys.exit(1 if differ or len(kills) < options.kills else 0)


if __name__ == "__main__":
    main()
