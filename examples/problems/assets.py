"""Meshes, grids and pictures of the problems: shapes as (points, faces), grids as functions of points, and the files that hold them.

Uses only Python's standard library. Each problem's make.py imports it from the folder above.
"""

import math
import pathlib
import struct
import zlib


def run_folder(script):
    """The folder `run` beside a script, for the files that it makes."""
    folder = pathlib.Path(script).resolve().parent / "run"
    folder.mkdir(exist_ok=True)
    return folder


def unit(p):
    length = math.sqrt(sum(c * c for c in p))
    return tuple(c / length for c in p)


def icosphere(levels):
    """Unit vertices, and the faces of an icosahedron divided in four `levels` times."""
    t = (1 + 5**0.5) / 2
    points = [(-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t), (0, -1, -t), (0, 1, -t),
              (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
             (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10),
             (8, 6, 7), (9, 8, 1)]
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


def dodecahedron():
    """Unit vertices, and faces that cut each pentagon into the five triangles about its middle."""
    corners, triangles = icosphere(0)
    points = [unit([sum(corners[i][k] for i in t) for k in range(3)]) for t in triangles]
    faces = []
    for middle, corner in enumerate(corners):
        side = [n for n, t in enumerate(triangles) if middle in t]
        first = points[side[0]]
        u = unit([first[k] - corner[k] * sum(a * b for a, b in zip(first, corner)) for k in range(3)])
        v = (corner[1] * u[2] - corner[2] * u[1], corner[2] * u[0] - corner[0] * u[2], corner[0] * u[1] - corner[1] * u[0])
        side.sort(key=lambda n: math.atan2(sum(a * b for a, b in zip(points[n], v)), sum(a * b for a, b in zip(points[n], u))))
        points.append(tuple(sum(points[n][k] for n in side) / 5 for k in range(3)))
        faces += [(len(points) - 1, side[n], side[(n + 1) % 5]) for n in range(5)]
    return points, faces


def revolve(profile, around):
    """The closed surface that a profile of (radius, height) makes about the y axis, from its lower end to its upper end.

    Both ends of the profile have a radius of zero. `around` is the number of meridians."""
    inner = profile[1:-1]
    points = [(0.0, profile[0][1], 0.0)]
    for radius, height in inner:
        for k in range(around):
            angle = 2 * math.pi * k / around
            points.append((radius * math.cos(angle), height, -radius * math.sin(angle)))
    points.append((0.0, profile[-1][1], 0.0))
    top, faces = len(points) - 1, []
    for k in range(around):
        k1 = (k + 1) % around
        faces.append((0, 1 + k1, 1 + k))
        for ring in range(len(inner) - 1):
            a, b = 1 + ring * around + k, 1 + ring * around + k1
            faces += [(a, b, b + around), (a, b + around, a + around)]
        last = 1 + (len(inner) - 1) * around
        faces.append((last + k, last + k1, top))
    return points, faces


def apple(around=96, along=64):
    """An apple of radius 1 about the origin, with a dimple at its top and a smaller one below; its top leans to one side."""
    profile = []
    for k in range(along + 1):
        turn = math.pi * k / along
        radius = math.sin(turn) * (1 + 0.08 * math.cos(turn)) ** -1
        height = -0.9 * math.cos(turn) - 0.38 * math.exp(-((math.pi - turn) / 0.42) ** 2) + 0.2 * math.exp(-((turn / 0.4) ** 2))
        profile.append((radius if 0 < k < along else 0.0, height))
    points, faces = revolve(profile, around)
    lobes = [1 + 0.035 * math.cos(5 * math.atan2(z, x)) * (1 - y) / 2 for x, y, z in points]
    return [(x * m + 0.08 * y * y, y, z * m) for (x, y, z), m in zip(points, lobes)], faces


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


def write_vol(path, size, channels, value):
    """A grid of `size`³ voxels of the unit cube; `value` takes the middle of a voxel and returns a tuple of `channels` numbers."""
    middles = [(i + 0.5) / size for i in range(size)]
    data = [c for z in middles for y in middles for x in middles for c in value(x, y, z)]
    header = struct.pack("<3sBiiiii6f", b"VOL", 3, 1, size, size, size, channels, 0, 0, 0, 1, 1, 1)
    pathlib.Path(path).write_bytes(header + struct.pack(f"<{len(data)}f", *data))


def write_png(path, width, height, colour):
    """A picture; `colour` takes column and row from the top left and returns red, green and blue from 0 to 1 as sRGB has them."""
    rows = b""
    for row in range(height):
        rows += b"\0" + bytes(round(255 * min(max(c, 0), 1)) for column in range(width) for c in colour(column, row))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")
    pathlib.Path(path).write_bytes(b"\x89PNG\r\n\x1a\n" + data)


def smoothstep(a, b, x):
    t = min(max((x - a) / (b - a), 0), 1)
    return t * t * (3 - 2 * t)


def lattice(i, j, k):
    """A number from 0 to 1 that looks random, at a point with whole coordinates."""
    n = (i * 374761393 + j * 668265263 + k * 2147483647) & 0xFFFFFFFF
    n = ((n ^ (n >> 13)) * 1274126177) & 0xFFFFFFFF
    return ((n ^ (n >> 16)) & 0xFFFF) / 0xFFFF


def noise(x, y, z):
    """A smooth function that takes the values of `lattice` where all coordinates are whole."""
    i, j, k = math.floor(x), math.floor(y), math.floor(z)
    u, v, w = (t * t * (3 - 2 * t) for t in (x - i, y - j, z - k))
    total = 0.0
    for a, p in ((0, 1 - u), (1, u)):
        for b, q in ((0, 1 - v), (1, v)):
            for c, r in ((0, 1 - w), (1, w)):
                total += p * q * r * lattice(i + a, j + b, k + c)
    return total


def billows(x, y, z, octaves=4):
    """Noise of several scales, each half as coarse and half as strong as the one before; from 0 to 1, 0.5 in the mean."""
    total = sum(0.5**n * noise(x * 2**n + 17 * n, y * 2**n, z * 2**n + 5 * n) for n in range(octaves))
    return total / (2 - 0.5 ** (octaves - 1))


def smoke(x, y, z):
    """The density, from 0 to 1, of a plume in the unit cube: it rises from the middle of the bottom, bends, widens and curls."""
    curl = 0.35 * smoothstep(0, 0.5, y)
    u = x + curl * (billows(3 * x, 3 * y - 1, 3 * z, 3) - 0.5)
    w = z + curl * (billows(3 * x + 40, 3 * y, 3 * z, 3) - 0.5)
    bend_u = 0.5 + 0.17 * math.sin(4.2 * y + 0.5) * y
    bend_w = 0.5 + 0.15 * math.sin(5.5 * y + 2.1) * y
    radius = 0.05 + 0.3 * smoothstep(-0.1, 0.8, y)
    away = math.hypot(u - bend_u, w - bend_w) / radius
    puff = 1.6 * (billows(6 * u, 6 * y - 3, 6 * w) - 0.5)
    top = 4 * max(0, y - 0.74)
    inside = smoothstep(0, 0.6, 1 - away - top + puff)
    border = min(x, 1 - x, y, 1 - y, z, 1 - z)
    return inside * smoothstep(0.0, 0.08, border)


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
