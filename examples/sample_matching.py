#!/usr/bin/env python3
"""Derivatives of media beside those of Sample Matching (Yu et al., ACM TOG 2026): python3 examples/sample_matching.py FOLDER [CELL...]

    cargo build --release -p drt-cli

FOLDER has the grids, the torus and the figures of its public suite: sigma_blob.npy, albedo_ramp.npy, torus.obj and figures.json. A cell is a
boundary, a light and what is differentiated, such as torus_point_galbedo, or zeros_gones, which has empty voxels. Its number is the derivative of the
sum over an image of 64 x 64 pixels and three channels, of 8 samples a pixel by each of 48 seeds, as in the suite. The table has it with its standard error
by the seeds, that of the best of Sample Matching's three variants, that of Mitsuba's prbvolpath, and how far the first two are apart.

With --peer PYTHON, a Python that has mitsuba, both programs are run in turns on this machine, both in reverse mode: the gradient by all voxels at once,
times the direction. The table then has variance times processor seconds of either. Mitsuba's kernels are
warm and its scene is loaded; the whole program counts for drt.
"""

import argparse
import ast
import json
import math
import pathlib
import resource
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
# Of the sum over the image, by seed, in the units of the files, with the processor seconds of each.
PEER = """
import json, sys, time
import drjit as dr, mitsuba as mi, numpy as np
scene, key, direction, spp, seeds, variant = json.loads(sys.argv[1])
mi.set_variant(variant)
scene = mi.load_file(scene)
params = mi.traverse(scene)
key = next(k for k in params.keys() if k.endswith(key))
direction = np.array(direction)
integrator = mi.load_dict({"type": "prbvolpath", "max_depth": 32, "rr_depth": 64})
found = []
for seed in range(seeds + 1):
    start = time.process_time()
    dr.enable_grad(params[key])
    params.update()
    dr.backward(dr.sum(mi.render(scene, params, integrator=integrator, seed=seed, spp=spp), axis=None))
    gradient = np.array(dr.grad(params[key]), dtype=float).ravel()
    dr.set_grad(params[key], 0)
    found.append([float(gradient @ direction), time.process_time() - start])
print(json.dumps(found[1:]))
"""
PROPERTIES = {"gsigma": ("sigma_t", "sigma_t.data"), "galbedo": ("albedo", "albedo.data"), "gones": ("sigma_t", "sigma_t.data")}
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
    parser.add_argument("--peer", metavar="PYTHON", help="a Python with mitsuba, whose prbvolpath is run as well")
    parser.add_argument("--variant", default="llvm_ad_rgb", help="Mitsuba's variant")
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
    property = PROPERTIES[by][0]
    group = f'[[parameter_group]]\nname = "p"\ntarget = "smoke"\nproperty = "{property}"\nvoxels = "all"\n'
    (folder / "reverse.toml").write_text(job.split("[[parameter]]")[0] + group)
    head = repr({"descr": "<f8", "fortran_order": False, "shape": (64, 64, 3)}).ljust(117) + "\n"
    ones = struct.pack("<12288d", *[1.0] * 12288)
    (folder / "ones.npy").write_bytes(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode() + ones)


def run(options, folder, seed):
    """The sum over the image and its channels by one seed, and the processor time that it took."""
    digest = folder / "digest.json"
    line = [options.drt, "grad", folder / "job.toml", "--quiet", "--seed", seed, "--output", folder / "image.exr", "--digest", digest]
    done = subprocess.run([str(word) for word in line], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stderr)
    report = json.loads(digest.read_text())
    return sum(report["derivatives"]["p"]["mean"]) * 64 * 64, report["cpu_seconds"]


def direction(cell, folder):
    """The change of each number of the file that is differentiated."""
    by = cell.split("_")[-1]
    data = (folder / f"{PROPERTIES[by][0]}.vol").read_bytes()[48:]
    values = struct.unpack(f"<{len(data) // 4}f", data)
    return [1.0] * len(values) if by == "gones" else list(values)


def run_reverse(options, folder, seed, along):
    """As run, by the gradient with respect to all voxels."""
    gradient = folder / "gradient.npy"
    line = [options.drt, "grad", folder / "reverse.toml", "--adjoint", folder / "ones.npy", "--quiet", "--seed", seed, "--output", gradient]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([str(word) for word in line], capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit(done.stderr)
    seconds = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return sum(g * d for g, d in zip(read_npy(gradient)[1], along)), seconds


def mean_and_error(runs):
    """Of the sums of runs, and their variance by one times the processor seconds of one."""
    sums, seconds = zip(*runs)
    variance = statistics.variance(sums)
    return statistics.mean(sums), math.sqrt(variance / len(sums)), variance * statistics.mean(seconds)


def beside_peer(options, cell):
    """A row of the table of both programs."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        write_cell(cell, options, folder)
        along = direction(cell, folder)
        ours = [run_reverse(options, folder, seed, along) for seed in range(options.seeds)]
        asked = json.dumps([str(folder / "scene.xml"), PROPERTIES[cell.split("_")[-1]][1], along, options.spp, options.seeds, options.variant])
        done = subprocess.run([options.peer, "-c", PEER, asked], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(done.stderr)
    (value, error, work), (peer, peer_error, peer_work) = mean_and_error(ours), mean_and_error(json.loads(done.stdout.splitlines()[-1]))
    apart = (value - peer) / math.hypot(error, peer_error)
    row = [f"{value:.6g}", f"{error:.3g}", f"{peer:.6g}", f"{peer_error:.3g}", f"{apart:.1f}", f"{work:.3g}", f"{peer_work:.3g}", f"{peer_work / work:.2f}"]
    print(f"| {cell} | " + " | ".join(row) + " |", flush=True)


def main():
    options = arguments()
    theirs = json.loads((options.folder / "figures.json").read_text())
    unknown = [cell for cell in options.cells if cell not in theirs]
    if unknown:
        sys.exit(f"no such cell: {', '.join(unknown)}; expected one of {', '.join(theirs)}")
    if options.peer:
        print("| cell | drt | se | prbvolpath | se | apart, in se | drt, variance x s | prbvolpath, variance x s | ratio |")
        print("|---|---|---|---|---|---|---|---|---|")
        for cell in options.cells or theirs:
            beside_peer(options, cell)
        return
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
