"""Shapes and files that the problems' make.py write, by Python's standard library alone."""

import math
import pathlib
import struct


def write_ply(path, points, faces):
    """Triangles as a binary PLY file."""
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


def star(arms, notch):
    """A flat star in the plane of x and y, one arm of each of the lengths, with notches in between; it looks along z."""
    points = [(0.0, 0.0, 0.0)]
    for k, length in enumerate(arms):
        for turn, reach in ((k, length), (k + 0.5, notch)):
            angle = 2 * math.pi * turn / len(arms)
            points.append((-reach * math.sin(angle), reach * math.cos(angle), 0.0))
    rim = len(points) - 1
    return points, [(0, 1 + k, 1 + (k + 1) % rim) for k in range(rim)]


def box_cage(low, high):
    """A box of twelve triangles; bit 0 of a vertex's number says which end of x it is at, bit 1 of y, bit 2 of z."""
    ends = (low, high)
    points = [(ends[k & 1][0], ends[k >> 1 & 1][1], ends[k >> 2][2]) for k in range(8)]
    sides = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    return points, [t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))]


def write_obj(path, points, faces):
    """Triangles as an OBJ file."""
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    pathlib.Path(path).write_text("\n".join(lines) + "\n")


def sheet(count, size):
    """A square of count × count vertices in the plane of x and z around the origin, x fastest; it faces up."""
    at = [size * (k / (count - 1) - 0.5) for k in range(count)]
    corners = [j * count + i for j in range(count - 1) for i in range(count - 1)]
    faces = [t for a in corners for t in ((a, a + count, a + count + 1), (a, a + count + 1, a + 1))]
    return [(x, 0.0, z) for z in at for x in at], faces


def write_vol(path, size, value):
    """A grid of size³ voxels as Mitsuba's .vol file, by their values at places from 0 to 1 in x, y and z."""
    at = [(k + 0.5) / size for k in range(size)]
    values = [value(x, y, z) for z in at for y in at for x in at]
    header = b"VOL\x03" + struct.pack("<5i6f", 1, size, size, size, 1, 0, 0, 0, 1, 1, 1)
    pathlib.Path(path).write_bytes(header + struct.pack(f"<{len(values)}f", *values))
