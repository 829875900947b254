"""Meshes, grids and pictures that the problems are made of, with nothing but Python's standard library.

A problem's make.py imports this file and writes to the folder `run` beside it.
"""

import math
import os
import pathlib
import struct
import subprocess
import zlib

DRT = os.environ.get("DRT", str(pathlib.Path(__file__).resolve().parents[2] / "target/release/drt"))
"""The program that renders the pictures of problems whose target is not a value of the job's parameters."""


def icosphere(levels):
    """Vertices, on the unit sphere, and faces of an icosahedron that was subdivided `levels` times."""
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


def write_ply(path, points, faces):
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
    pathlib.Path(path).write_bytes(header.encode() + data)


def write_vol(path, size, box, values):
    """A Mitsuba grid of one channel; values with x fastest, size and box = (lower corner, upper corner) in x, y, z."""
    header = b"VOL\x03" + struct.pack("<5i", 1, *size, 1) + struct.pack("<6f", *box[0], *box[1])
    pathlib.Path(path).write_bytes(header + struct.pack(f"<{len(values)}f", *values))


def write_png(path, width, height, rgb):
    """A picture of 8 bits a channel; `rgb` has three numbers from 0 to 255 a pixel, row after row from the top."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + bytes(rgb[3 * width * y : 3 * width * (y + 1)]) for y in range(height))
    head = struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)
    png = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")
    pathlib.Path(path).write_bytes(b"\x89PNG\r\n\x1a\n" + png)


def render(scene, output, spp, defines=(), sensor=None, more=()):
    """Renders a picture to a file, unless the file is there."""
    if pathlib.Path(output).exists():
        return
    words = [DRT, "render", scene, "--quiet", "--seed", "1", "--spp", spp, "--output", output, *more]
    words += ["--sensor", sensor] if sensor else []
    words += [word for name, value in dict(defines).items() for word in ("-D", f"{name}={value}")]
    subprocess.run([str(w) for w in words], check=True)


def smooth_union(distances, width):
    """The distance from a union of bodies, with fillets of about this width where they meet."""
    nearest = min(distances)
    return nearest - width * math.log(sum(math.exp((nearest - d) / width) for d in distances))


def star_shaped(directions, body, longest):
    """Where rays from the origin leave a body, of which all points can be seen from there; `body` is negative inside."""
    points = []
    for d in directions:
        inside, outside = 0.0, longest
        for _ in range(40):
            middle = (inside + outside) / 2
            if body(*(middle * c for c in d)) < 0:
                inside = middle
            else:
                outside = middle
        points.append(tuple(inside * c for c in d))
    return points


def rotation(target, axis, degrees, pivot):
    """The effect of a job that turns a shape."""
    rotate = f"{{ axis = {list(axis)}, pivot = {list(pivot)} }}"
    return f'[[view.effect]]\ntarget = "{target}"\nrotate = {rotate}\namount = {math.radians(degrees)!r}\n'


def view(picture, effects=(), sensor=None):
    """A view of a job: its picture, and the known pose that its scene has there."""
    sees = f'sensor = "{sensor}"\n' if sensor else ""
    return f'[[view]]\ntarget = "{picture}"\n{sees}' + "".join(effects)


def write_job(source, output, views):
    """The job with its views appended."""
    pathlib.Path(output).write_text(pathlib.Path(source).read_text() + "\n" + "\n".join(views))
