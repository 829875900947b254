"""Renders Mitsuba's test scenes by Mitsuba as it is now, for `scene_table --again`.

    pip install mitsuba numpy
    python3 scene_table_again.py SCENES FOLDER [--only PART] [--samples N]

Writes eight images of other seeds for each scene that has a reference, as FOLDER/PARENT_NAME.SEED.exr: the names, and
the number, that the table reads. Scenes that Mitsuba does not load are left out with a message.
"""

import argparse
import pathlib

import mitsuba as mi
import numpy as np

PARTS = 8


def render(scene, output, samples):
    for seed in range(PARTS):
        image = np.array(mi.render(scene, spp=max(1, samples // PARTS), seed=seed))
        # The moments behind the colours are left out.
        mi.Bitmap(np.ascontiguousarray(image[..., :3])).write(str(output(seed)))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("scenes", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--only", default="", help="scenes whose path holds this")
    parser.add_argument("--samples", type=int, default=16000, help="a pixel, in all images")
    arguments = parser.parse_args()

    mi.set_variant("scalar_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    arguments.folder.mkdir(parents=True, exist_ok=True)
    for path in sorted(arguments.scenes.rglob("*.xml")):
        name, _, integrator = path.stem.rpartition("_")
        reference = path.parent / "refs" / f"{name}_ref_rgb.exr"
        if arguments.only not in str(path) or not reference.exists():
            continue
        try:
            scene = mi.load_file(str(path), integrator=integrator)
        except RuntimeError as error:
            print(f"{path}: {str(error).strip().splitlines()[-1]}")
            continue
        start = arguments.folder / f"{path.parent.name}_{path.stem}"
        render(scene, lambda seed, start=start: f"{start}.{seed}.exr", arguments.samples)
        print(path)


if __name__ == "__main__":
    main()
