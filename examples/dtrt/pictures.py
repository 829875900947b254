#!/usr/bin/env python3
"""Makes the pictures of derivatives on the scenes of dtrt in docs/radiative.md.

    cargo build --release -p drt-cli
    python3 examples/dtrt/pictures.py [--folder FOLDER] [NAME...]

One preview a job: the image, and beside it the derivative by each parameter; red is positive, blue negative,
white zero. The scenes must lie beside the jobs: see README.md.
"""

import argparse
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
PICTURES = HERE.parents[1] / "docs/images/radiative"

# Samples per pixel.
SPP = {"glass_1": 1024, "multilayer": 512, "shadow_1": 4096, "shadow_2": 1024, "camera_pose": 1024}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(SPP)}; all by default")
    parser.add_argument("--drt", default=HERE.parents[1] / "target/release/drt", help="the drt binary")
    parser.add_argument("--kind", default="radiative", help="the kind of estimator")
    parser.add_argument("--size", type=int, default=64, help="width and height of the images")
    parser.add_argument("--scale", type=float, default=1, help="factor on the numbers of samples")
    parser.add_argument("--threads", type=int, default=0, help="threads of each run; all cores by default")
    parser.add_argument("--folder", type=pathlib.Path, default=PICTURES, help="where to put NAME.png")
    return parser.parse_args()


def main():
    options = arguments()
    options.folder.mkdir(parents=True, exist_ok=True)
    for name in options.names or SPP:
        if name not in SPP:
            sys.exit(f"{name}: expected one of {', '.join(SPP)}")
        line = [options.drt, "grad", HERE / f"{name}.toml", "--set", f"estimator.kind={options.kind}", "--quiet"]
        line += ["--size", f"{options.size}x{options.size}", "--spp", max(1, round(SPP[name] * options.scale))]
        picture = options.folder / f"{name}.png"
        line += ["--threads", options.threads, "--output", picture.with_suffix(".exr"), "--preview", picture]
        if subprocess.run([str(word) for word in line]).returncode != 0:
            sys.exit(f"{name}: drt grad failed")


if __name__ == "__main__":
    main()
