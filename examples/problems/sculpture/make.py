#!/usr/bin/env python3
"""Makes the sculpture's meshes, scenes and pictures: python3 make.py [--drt BINARY] [--views 24] [--size 128] [--levels 5]

A body is to be found from pictures of it, by all vertices of a sphere. All files are written to the folder run: sphere.ply, body.ply,
scene.xml (with the sphere), target.xml (with the body), the pictures target-NN.exr, and job.toml for

    drt optimize run/job.toml

whose result is run/out/body.ply. The last picture is of a view that the fit does not see.
"""

import argparse
import math
import pathlib
import struct
import subprocess

HERE = pathlib.Path(__file__).resolve().parent
RUN = HERE / "run"
SPP = 256


def icosphere(levels):
    """Unit vertices and faces."""
    t = (1 + 5**0.5) / 2
    points = [(-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t), (0, -1, -t), (0, 1, -t),
              (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
             (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10),
             (8, 6, 7), (9, 8, 1)]
    def unit(p):
        length = math.sqrt(sum(c * c for c in p))
        return tuple(c / length for c in p)

    points = [unit(p) for p in points]
    for _ in range(levels):
        middles, finer = {}, []

        def middle(a, b):
            key = (min(a, b), max(a, b))
            if key not in middles:
                middles[key] = len(points)
                points.append(unit([x + y for x, y in zip(points[a], points[b])]))
            return middles[key]

        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = finer
    return points, faces


def body(p):
    """Where a point of the unit sphere is on the sculpture: a twisted body with a waist, a head and three ridges."""
    x, y, z = p
    turn = 0.9 * y
    x, z = x * math.cos(turn) + z * math.sin(turn), z * math.cos(turn) - x * math.sin(turn)
    around = math.atan2(z, x)
    wide = 0.75 + 0.22 * math.cos(3.2 * y + 0.6) + 0.1 * math.cos(3 * around) * (1 - y * y)
    return (x * wide, 1.05 * y + 0.08 * math.sin(4 * x), z * wide)


def ply(path, points, faces):
    header = f"""ply
format binary_little_endian 1.0
element vertex {len(points)}
property double x
property double y
property double z
element face {len(faces)}
property list uchar uint vertex_indices
end_header
"""
    data = b"".join(struct.pack("<3d", *p) for p in points) + b"".join(struct.pack("<B3I", 3, *f) for f in faces)
    path.write_bytes(header.encode() + data)


def sensor(k, views, size):
    """A camera on a sphere around the body; a golden angle apart from the one before."""
    height = 0.85 - 1.5 * (k + 0.5) / views
    around = k * math.pi * (3 - 5**0.5)
    ring = math.sqrt(1 - height * height)
    origin = ", ".join(f"{4.2 * c:.6f}" for c in (ring * math.cos(around), height, ring * math.sin(around)))
    return f"""
    <sensor type="perspective" id="view-{k:02}">
        <float name="fov" value="36"/>
        <transform name="to_world">
            <lookat origin="{origin}" target="0, 0, 0" up="0, 1, 0"/>
        </transform>
        <film type="hdrfilm">
            <integer name="width" value="{size}"/>
            <integer name="height" value="{size}"/>
            <rfilter type="tent"/>
        </film>
    </sensor>"""


def scene(mesh, views, size):
    sensors = "".join(sensor(k, views + 1, size) for k in range(views + 1))
    return f"""<scene version="3.0.0">
    <integrator type="path">
        <integer name="max_depth" value="3"/>
    </integrator>{sensors}

    <shape type="ply" id="body">
        <string name="filename" value="{mesh}"/>
        <boolean name="face_normals" value="true"/>
        <bsdf type="diffuse">
            <rgb name="reflectance" value="0.7, 0.6, 0.5"/>
        </bsdf>
    </shape>

    <shape type="rectangle">
        <transform name="to_world">
            <scale value="1.2"/>
            <rotate x="1" angle="90"/>
            <translate x="1.5" y="3.5" z="1"/>
        </transform>
        <emitter type="area">
            <rgb name="radiance" value="12, 11, 10"/>
        </emitter>
    </shape>
    <shape type="rectangle">
        <transform name="to_world">
            <scale value="1.5"/>
            <rotate x="1" angle="-90"/>
            <translate x="-1.5" y="-3.5" z="-1"/>
        </transform>
        <emitter type="area">
            <rgb name="radiance" value="3, 4, 5"/>
        </emitter>
    </shape>
    <emitter type="constant">
        <rgb name="radiance" value="0.25"/>
    </emitter>
</scene>
"""


def job(views):
    sensors = ", ".join(f'"view-{k:02}"' for k in range(views))
    targets = ", ".join(f'"target-{k:02}.exr"' for k in range(views))
    return f"""# Made by make.py: a body from pictures of it, by all vertices of a sphere. The last camera is not used.
scene = "scene.xml"

[estimator]
spp = 16
max_depth = 3

[optimize]
targets = [{targets}]
sensors = [{sensors}]
optimizer = {{ kind = "adam", learning_rate = 0.02, iterations = 100 }}
views_per_iteration = 6
checkpoint = "out"

[[parameter_group]]
name = "body"
target = "body"
vertices = "all"
laplacian = 25.0
learning_rate = [[0, 0.3], [40, 0.1], [80, 0.03]]
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--drt", default=HERE.parents[2] / "target/release/drt")
    parser.add_argument("--views", type=int, default=24)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--levels", type=int, default=5)
    options = parser.parse_args()
    RUN.mkdir(exist_ok=True)
    points, faces = icosphere(options.levels)
    ply(RUN / "sphere.ply", [tuple(0.8 * c for c in p) for p in points], faces)
    ply(RUN / "body.ply", [body(p) for p in points], faces)
    for name, mesh in [("scene", "sphere.ply"), ("target", "body.ply")]:
        (RUN / f"{name}.xml").write_text(scene(mesh, options.views, options.size))
    (RUN / "job.toml").write_text(job(options.views))
    for k in range(options.views + 1):
        call = [str(options.drt), "render", str(RUN / "target.xml"), "--sensor", f"view-{k:02}", "--spp", str(SPP), "--quiet"]
        subprocess.run([*call, "-o", str(RUN / f"target-{k:02}.exr")], check=True)


main()
