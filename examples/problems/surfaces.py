"""How far apart two surfaces are: python3 surfaces.py ONE.ply OTHER.ply

The mean distance of the points of each surface from the other surface, both ways, by points drawn evenly over
its area. Reads binary PLY files of triangles.
"""

import math
import pathlib
import random
import struct
import sys

KINDS = {"char": "b", "uchar": "B", "int8": "b", "uint8": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I",
         "int32": "i", "uint32": "I", "float": "f", "float32": "f", "double": "d", "float64": "d"}


def read_ply(path):
    """Vertices and triangles of a binary little-endian PLY file."""
    data = pathlib.Path(path).read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    points, faces, element = [], [], None
    for line in data[:end].decode().splitlines():
        words = line.split()
        if words[0] == "element":
            element = (words[1], int(words[2]), [])
            (points if words[1] == "vertex" else faces).append(element)
        elif words[0] == "property":
            element[2].append(words)
    (_, count, properties), = points
    shape = struct.Struct("<" + "".join(KINDS[p[1]] for p in properties))
    names = [p[2] for p in properties]
    at = [names.index(c) for c in "xyz"]
    vertices = [tuple(row[i] for i in at) for row in shape.iter_unpack(data[end : end + count * shape.size])]
    (_, count, properties), = faces
    shape = struct.Struct(f"<{KINDS[properties[0][2]]}3{KINDS[properties[0][3]]}")
    end += len(vertices) * struct.Struct("<" + "".join(KINDS[p[1]] for p in points[0][2])).size
    return vertices, [row[1:4] for row in shape.iter_unpack(data[end : end + count * shape.size])]


def minus(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def squared_from_segment(p, a, b):
    along, from_a = minus(b, a), minus(p, a)
    t = max(0.0, min(1.0, dot(from_a, along) / (dot(along, along) or 1.0)))
    rest = minus(from_a, tuple(t * c for c in along))
    return dot(rest, rest)


def squared_from_triangle(p, a, b, c):
    normal = cross(minus(b, a), minus(c, a))
    edges = ((a, b), (b, c), (c, a))
    if all(dot(cross(minus(v, u), minus(p, u)), normal) >= 0 for u, v in edges):
        height = dot(minus(p, a), normal)
        return height * height / (dot(normal, normal) or 1.0)
    return min(squared_from_segment(p, u, v) for u, v in edges)


class Surface:
    """Triangles in the cells of a grid."""

    def __init__(self, points, faces):
        self.triangles = [tuple(points[i] for i in f) for f in faces]
        spans = [max(p[i] for t in self.triangles for p in t) - min(p[i] for t in self.triangles for p in t) for i in range(3)]
        self.extent = max(spans)
        self.cell = self.extent / max(4.0, math.sqrt(len(faces) / 6.0))
        self.cells = {}
        for t in self.triangles:
            low, high = (tuple(math.floor(f(p[i] for p in t) / self.cell) for i in range(3)) for f in (min, max))
            for x in range(low[0], high[0] + 1):
                for y in range(low[1], high[1] + 1):
                    for z in range(low[2], high[2] + 1):
                        self.cells.setdefault((x, y, z), []).append(t)

    def sample(self, count, seed):
        rng = random.Random(seed)
        areas = [math.sqrt(dot(n, n)) for n in (cross(minus(b, a), minus(c, a)) for a, b, c in self.triangles)]
        for a, b, c in rng.choices(self.triangles, areas, k=count):
            u, v = rng.random(), rng.random()
            if u + v > 1:
                u, v = 1 - u, 1 - v
            yield tuple(a[i] + u * (b[i] - a[i]) + v * (c[i] - a[i]) for i in range(3))

    def distance(self, p):
        """Cells are searched in growing shells, until the next shell is farther than what was found."""
        center = tuple(math.floor(c / self.cell) for c in p)
        best, shell = math.inf, 0
        while True:
            # A point is at least this far from whatever lies in the shell.
            if best <= max(0.0, (shell - 1) * self.cell) ** 2:
                return math.sqrt(best)
            for cell in self.shell(center, shell):
                for t in self.cells.get(cell, ()):
                    best = min(best, squared_from_triangle(p, *t))
            shell += 1

    @staticmethod
    def shell(center, radius):
        x, y, z = center
        span = range(-radius, radius + 1)
        for i in span:
            for j in span:
                ends = span if max(abs(i), abs(j)) == radius else ((-radius, radius) if radius else (0,))
                for k in ends:
                    yield (x + i, y + j, z + k)


def mean_distance(one, other, count=1500):
    """Both ways: the mean over points of each surface of their distance from the other surface."""
    ways = ((one, other, 1), (other, one, 2))
    return sum(to.distance(p) for a, to, seed in ways for p in a.sample(count, seed)) / (2 * count)


def main():
    one, other = (Surface(*read_ply(path)) for path in sys.argv[1:3])
    d = mean_distance(one, other)
    print(f"mean distance {d:.5g}, {100 * d / other.extent:.3g} % of the size {other.extent:.4g}")


if __name__ == "__main__":
    main()
