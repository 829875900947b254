#!/usr/bin/env python3
"""Derivatives of media beside those of Sample Matching (Yu et al., ACM TOG 2026): python3 examples/sample_matching.py FOLDER [CELL...]

    cargo build --release -p drt-cli

FOLDER has the grids, the torus and the figures of its public suite: sigma_blob.npy, albedo_ramp.npy, torus.obj and figures.json. A cell is a
boundary, a light and what is differentiated, such as torus_point_galbedo, or zeros_gones, which has empty voxels. Its number is the derivative of the
sum over an image of 64 x 64 pixels and three channels, of 8 samples a pixel by each of 48 seeds, as in the suite. The table has it with its standard error
by the seeds, that of the best of Sample Matching's three variants, that of Mitsuba's prbvolpath, and how far the first two are apart.
"""

import argparse
import ast
import json
import math
import pathlib
import shutil
import statistics
import struct
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
CUBE = '<translate x="-0.5" y="-0.5" z="-0.5"/><scale value="2"/>'
EMPTIED = 0.6
SHAPES = {
    "box": '<shape type="cube">',
    "sphere": '<shape type="sphere"><float name="radius" value="1.15"/>',
    "torus": '<shape type="obj"><string name="filename" value="torus.obj"/><transform name="to_world"><scale value="1.4"/></transform>',
}
LIGHTS = {
    "constant": '<emitter type="constant"><rgb name="radiance" value="1"/></emitter>',
    "area_out": '<shape type="rectangle"><transform name="to_world"><scale value="1.2"/><rotate x="1" angle="90"/><translate y="2.5"/></transform>'
    '<emitter type="area"><rgb name="radiance" value="6"/></emitter></shape>',
    "area_in": '<shape type="rectangle"><transform name="to_world"><scale value="0.25"/><translate z="-0.5"/></transform>'
    '<emitter type="area"><rgb name="radiance" value="25"/></emitter></shape>'
    '<emitter type="constant"><rgb name="radiance" value="0.05"/></emitter>',
    "point": '<emitter type="point"><point name="position" x="2.5" y="2.5" z="2.5"/><rgb name="intensity" value="40"/></emitter>'
    '<emitter type="constant"><rgb name="radiance" value="0.02"/></emitter>',
}
LIGHTS["envmap"] = LIGHTS["constant"]
SCENE = """<scene version="3.0.0">
    <integrator type="volpath"><integer name="max_depth" value="32"/><integer name="rr_depth" value="64"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="45"/>
        <transform name="to_world"><lookat origin="0, 0, 4.2" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="64"/><rfilter type="box"/></film>
    </sensor>
    <medium type="heterogeneous" id="smoke">
        <float name="scale" value="2"/>
        <volume name="sigma_t" type="gridvolume"><string name="filename" value="sigma_t.vol"/><transform name="to_world">{cube}</transform></volume>
        <volume name="albedo" type="gridvolume"><string name="filename" value="albedo.vol"/><boolean name="raw" value="true"/><transform name="to_world">{cube}</transform></volume>
        <phase type="isotropic"/>
    </medium>
    {shape}<bsdf type="null"/><ref name="interior" id="smoke"/></shape>
    {light}
</scene>
"""
EFFECTS = {
    "gsigma": 'property = "sigma_t", multiply = 1.0',
    "galbedo": 'property = "albedo", multiply = 1.0',
    "gones": 'property = "sigma_t", add = [2.0, 2.0, 2.0]',
}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path, help="of the suite")
    parser.add_argument("cells", nargs="*", help="all of figures.json without any")
    parser.add_argument("--drt", default=HERE.parent / "target/release/drt", help="the drt binary")
    parser.add_argument("--kind", default="path-space", help="the estimator")
    parser.add_argument("--sampling", default="unidirectional", help="unidirectional or bidirectional")
    parser.add_argument("--spp", type=int, default=8, help="samples per pixel and seed")
    parser.add_argument("--seeds", type=int, default=48)
    return parser.parse_args()


def read_npy(path):
    """The shape and the numbers of a file of NumPy's."""
    data = path.read_bytes()
    length = struct.unpack_from("<H", data, 8)[0]
    head = ast.literal_eval(data[10 : 10 + length].decode())
    count = math.prod(head["shape"])
    kind = {"<f4": "f", "<f8": "d"}[head["descr"]]
    return head["shape"], list(struct.unpack_from(f"<{count}{kind}", data, 10 + length))


def write_vol(path, shape, values):
    size = (*reversed(shape[:3]), shape[3] if len(shape) > 3 else 1)
    head = b"VOL\x03" + struct.pack("<5i6f", 1, *size, 0, 0, 0, 1, 1, 1)
    path.write_bytes(head + struct.pack(f"<{len(values)}f", *values))


def write_cell(cell, options, folder):
    """Writes the scene and the job of a cell."""
    empties = cell.startswith("zeros_")
    boundary, light, by = ("box", "constant", cell[6:]) if empties else (cell.split("_")[0], "_".join(cell.split("_")[1:-1]), cell.split("_")[-1])
    shape, density = read_npy(options.folder / "sigma_blob.npy")
    write_vol(folder / "sigma_t.vol", shape, [0.0 if empties and v < EMPTIED else v for v in density])
    write_vol(folder / "albedo.vol", *read_npy(options.folder / "albedo_ramp.npy"))
    shutil.copy(options.folder / "torus.obj", folder)
    (folder / "scene.xml").write_text(SCENE.format(cube=CUBE, shape=SHAPES[boundary], light=LIGHTS[light]))
    job = f"""scene = "scene.xml"
[estimator]
kind = "{options.kind}"
sampling = "{options.sampling}"
spp = {options.spp}
[[parameter]]
name = "p"
effect = [{{ target = "smoke", {EFFECTS[by]} }}]
"""
    (folder / "job.toml").write_text(job)


def run(options, folder, seed):
    """The sum over the image and its channels by one seed, and the processor time that it took."""
    digest = folder / "digest.json"
    line = [options.drt, "grad", folder / "job.toml", "--quiet", "--seed", seed, "--output", folder / "image.exr", "--digest", digest]
    done = subprocess.run([str(word) for word in line], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stderr)
    report = json.loads(digest.read_text())
    return sum(report["derivatives"]["p"]["mean"]) * 64 * 64, report["cpu_seconds"]


def main():
    options = arguments()
    theirs = json.loads((options.folder / "figures.json").read_text())
    unknown = [cell for cell in options.cells if cell not in theirs]
    if unknown:
        sys.exit(f"no such cell: {', '.join(unknown)}; expected one of {', '.join(theirs)}")
    print("| cell | drt | se | Sample Matching | se | prbvolpath | se | their difference | apart, in se | se over theirs | s |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for cell in options.cells or theirs:
        with tempfile.TemporaryDirectory() as folder:
            write_cell(cell, options, pathlib.Path(folder))
            sums, seconds = zip(*[run(options, pathlib.Path(folder), seed) for seed in range(options.seeds)])
        value, error = statistics.mean(sums), statistics.stdev(sums) / math.sqrt(len(sums))
        figures = theirs[cell]
        best = min((figures[k] for k in ("quad", "lin", "k4")), key=lambda f: f["se"])
        prb = figures["prb"]
        apart = (value - best["ad"]) / math.hypot(error, best["se"])
        row = [f"{value:.6g}", f"{error:.3g}", best["ad"], best["se"], prb["ad"], prb["se"], best["fd"], f"{apart:.1f}", f"{error / best['se']:.2f}"]
        print(f"| {cell} | " + " | ".join(str(v) for v in row) + f" | {sum(seconds):.1f} |", flush=True)


main()
