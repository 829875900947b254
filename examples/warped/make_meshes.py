#!/usr/bin/env python3
"""Writes the meshes of these scenes, as OBJ files into the folder `meshes` beside this file.

    python3 examples/warped/make_meshes.py

Needs the standard library only. Every shape is drawn here: profiles that are turned about the y axis, and
bodies that are a level set of a function. All are closed but the flat star and the squares of the board, with
normals that point outward; the script stops where one is not. There are no normals in the files: readers
make smooth ones of the faces around a vertex, and flat ones where the scene says `face_normals`.
"""

import collections
import math
import pathlib

MESHES = pathlib.Path(__file__).resolve().parent / "meshes"


# Solids of revolution.

def chaikin(points, closed=False):
    """Cuts every corner of a polyline at a quarter of its sides; the ends of an open one stay."""
    pairs = list(zip(points, points[1:] + points[:1] if closed else points[1:]))
    cut = [(a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])) for a, b in pairs for t in (0.25, 0.75)]
    return cut if closed else [points[0]] + cut[1:-1] + [points[-1]]


def arc(centre, radius, first, last, count):
    """Points of a circle in the plane of profiles, at angles in degrees from the horizontal."""
    angles = [math.radians(first + (last - first) * i / (count - 1)) for i in range(count)]
    return [(radius * math.cos(a), centre + radius * math.sin(a)) for a in angles]


def lathe(profile, segments, crown=None):
    """A profile (r, y), from the lowest point of the axis to its highest, turned about the y axis.

    `crown(r, y, angle)` displaces the points (r, y) of a ring.
    """
    rings = profile[1:-1]
    vertices = [(0.0, profile[0][1], 0.0)]
    for r, y in rings:
        for k in range(segments):
            angle = 2 * math.pi * k / segments
            s, t = crown(r, y, angle) if crown else (r, y)
            vertices.append((s * math.cos(angle), t, s * math.sin(angle)))
    vertices.append((0.0, profile[-1][1], 0.0))

    def at(ring, k):
        return 1 + ring * segments + k % segments

    faces = []
    top = len(vertices) - 1
    for k in range(segments):
        faces.append((0, at(0, k), at(0, k + 1)))
        faces.append((top, at(len(rings) - 1, k + 1), at(len(rings) - 1, k)))
        for i in range(len(rings) - 1):
            faces += strip(at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1))
    return vertices, faces


def hollow(profile, segments):
    """A closed profile (r, y) away from the axis, counterclockwise, turned about the y axis: a ring."""
    count = len(profile)
    vertices = [
        (r * math.cos(a), y, r * math.sin(a))
        for r, y in profile
        for a in (2 * math.pi * k / segments for k in range(segments))
    ]

    def at(i, k):
        return i % count * segments + k % segments

    faces = []
    for i in range(count):
        for k in range(segments):
            faces += strip(at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1))
    return vertices, faces


def strip(a, b, c, d):
    return [(a, b, c), (a, c, d)]


FOOT = [(0, 0), (0.2, 0), (0.41, 0), (0.45, 0.03), (0.45, 0.12), (0.37, 0.17), (0.37, 0.22), (0.26, 0.29)]


def pawn():
    neck = [(0.18, 0.46), (0.14, 0.68), (0.26, 0.74), (0.26, 0.8), (0.12, 0.83)]
    head = arc(1.02, 0.22, -55, 90, 11)
    return lathe(chaikin(FOOT + neck) + head, 32)


def bishop():
    neck = [(0.19, 0.5), (0.13, 0.95), (0.26, 1.02), (0.26, 1.08), (0.13, 1.12)]
    mitre = [(0.22, 1.25), (0.22, 1.42), (0.11, 1.58), (0.05, 1.62)]
    return lathe(chaikin(FOOT + neck + mitre) + arc(1.68, 0.07, -20, 90, 5), 32)


def queen():
    neck = [(0.21, 0.5), (0.14, 1.05), (0.28, 1.12), (0.28, 1.19), (0.15, 1.23)]
    cup = [(0.17, 1.4), (0.29, 1.68), (0.27, 1.74), (0.17, 1.66), (0.08, 1.7)]

    def crown(r, y, angle):
        teeth = max(0.0, min(1.0, (y - 1.45) / 0.2)) * max(0.0, min(1.0, (r - 0.15) / 0.1))
        return r * (1 + 0.05 * teeth * math.cos(8 * angle)), y + 0.07 * teeth * math.cos(8 * angle)

    return lathe(chaikin(FOOT + neck + cup) + arc(1.77, 0.09, -30, 90, 5), 32, crown)


def bulb():
    """A pear of glass, its neck up, around a lamp at the origin."""
    glass = arc(0, 0.5, -90, 35, 14)
    neck = [(0.36, 0.4), (0.26, 0.52), (0.2, 0.64), (0.2, 0.78), (0.16, 0.82), (0, 0.82)]
    return lathe([(0, -0.5)] + glass[1:] + chaikin([glass[-1]] + neck)[1:], 32)


def filament():
    """A small body that glows, round the origin."""
    return lathe(arc(0, 0.12, -90, 90, 9), 16)


def shade():
    """A cone of sheet metal, open below and above, to hang over the bulb."""
    outline = [(0.95, -0.3), (0.99, -0.3), (0.99, -0.25), (0.33, 0.9), (0.27, 0.9), (0.27, 0.85)]
    return hollow(chaikin(outline, closed=True), 40)


# Flat ones.

def star():
    """Five tips in the plane z = 0, facing +z."""
    around = []
    for k in range(10):
        angle, r = math.pi / 2 + math.pi * k / 5, (1.0, 0.42)[k % 2]
        around.append((r * math.cos(angle), r * math.sin(angle), 0.0))
    return [(0.0, 0.0, 0.0)] + around, [(0, 1 + k, 1 + (k + 1) % 10) for k in range(10)]


def cube():
    """From -1 to 1 along each axis."""
    vertices = [(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return vertices, [face for quad in quads for face in strip(*quad)]


def squares(odd, count=6, side=0.6):
    """Every other square of a board in the plane y = 0, facing up."""
    vertices, faces = [], []
    for i in range(count):
        for k in range(count):
            if (i + k) % 2 == odd:
                x, z, n = (i - count / 2) * side, (k - count / 2) * side, len(vertices)
                vertices += [(x, 0.0, z), (x, 0.0, z + side), (x + side, 0.0, z + side), (x + side, 0.0, z)]
                faces += strip(n, n + 1, n + 2, n + 3)
    return vertices, faces


# Level sets. Functions are negative inside, and of about unit slope at the surface.

def ellipsoid(p, centre, radii):
    return (math.sqrt(sum(((a - c) / r) ** 2 for a, c, r in zip(p, centre, radii))) - 1) * min(radii)


def limb(p, joints):
    """A chain of round cones through joints (centre, radius)."""
    best = math.inf
    for (a, r), (b, s) in zip(joints, joints[1:]):
        ab = [v - u for u, v in zip(a, b)]
        ap = [v - u for u, v in zip(a, p)]
        t = max(0.0, min(1.0, dot(ap, ab) / dot(ab, ab)))
        best = min(best, math.dist(ap, [t * u for u in ab]) - (r + t * (s - r)))
    return best


def turned(p, profile):
    """Distance from a solid whose outline is a closed polygon (r, y), turned about the y axis."""
    q = (math.hypot(p[0], p[2]), p[1])
    best, inside = math.inf, False
    for a, b in zip(profile, profile[1:] + profile[:1]):
        d = (b[0] - a[0], b[1] - a[1])
        w = (q[0] - a[0], q[1] - a[1])
        t = max(0.0, min(1.0, (w[0] * d[0] + w[1] * d[1]) / (d[0] ** 2 + d[1] ** 2)))
        if a[0] > 0 or b[0] > 0:
            best = min(best, math.hypot(w[0] - t * d[0], w[1] - t * d[1]))
        if (a[1] > q[1]) != (b[1] > q[1]) and q[0] < a[0] + d[0] * w[1] / d[1]:
            inside = not inside
    return -best if inside else best


def blend(width, *distances):
    """A union, rounded where two meet within `width`."""
    result = distances[0]
    for d in distances[1:]:
        h = max(width - abs(result - d), 0.0) / width
        result = min(result, d) - 0.25 * width * h * h
    return result


def teapot(p):
    """Its spout at +x, 1.2 high."""
    pot = [(0, 0), (0.42, 0), (0.46, 0.06), (0.62, 0.25), (0.68, 0.45), (0.62, 0.66), (0.45, 0.82), (0.46, 0.88),
           (0.3, 0.96), (0.12, 1.0), (0, 1.0)]
    knob = ellipsoid(p, (0, 1.1, 0), (0.15, 0.13, 0.15))
    spout = limb(p, [((0.5, 0.34, 0), 0.2), ((0.8, 0.5, 0), 0.15), ((0.95, 0.75, 0), 0.11), ((1.13, 0.92, 0), 0.1)])
    bow = [((-0.5, 0.75, 0), 0.09)]
    for k in range(9):
        angle = math.radians(70 + 20 * k)
        bow.append(((-0.72 + 0.34 * math.cos(angle), 0.48 + 0.3 * math.sin(angle), 0), 0.085))
    return blend(0.1, turned(p, pot) - 0.01, knob, spout, limb(p, bow + [((-0.5, 0.27, 0), 0.09)]))


def hare(p):
    """Sits along +z, its feet at y = 0, 1.7 high."""
    q = (abs(p[0]), p[1], p[2])
    trunk = blend(
        0.2,
        ellipsoid(p, (0, 0.44, -0.12), (0.4, 0.43, 0.5)),
        ellipsoid(p, (0, 0.5, 0.22), (0.28, 0.4, 0.27)),
        ellipsoid(p, (0, 0.98, 0.3), (0.25, 0.25, 0.31)),
        ellipsoid(q, (0.29, 0.28, -0.18), (0.18, 0.28, 0.33)),
        ellipsoid(p, (0, 0.36, -0.64), (0.16, 0.16, 0.15)),
    )
    ear = limb(q, [((0.12, 1.1, 0.24), 0.12), ((0.19, 1.4, 0.12), 0.13), ((0.27, 1.62, -0.02), 0.08)])
    feet = blend(
        0.1,
        limb(q, [((0.18, 0.4, 0.34), 0.12), ((0.2, 0.12, 0.46), 0.11), ((0.2, 0.11, 0.6), 0.11)]),
        limb(q, [((0.3, 0.11, -0.2), 0.11), ((0.37, 0.11, 0.2), 0.11)]),
    )
    # The coat is not alike on both sides.
    x, y, z = p
    coat = 0.018 * math.sin(11 * x + 3 * z) * math.sin(10 * y + 1) * math.sin(12 * z - 2 * x + 0.5)
    return blend(0.15, trunk, ear, feet) + coat


def net(f, low, high, cell):
    """The level set f = 0 as triangles: one vertex in each cell that it passes (Gibson 1998, "Constrained
    elastic surface nets"), evened out along the surface and drawn onto it."""
    counts = [math.ceil((h - l) / cell) for l, h in zip(low, high)]

    def point(i):
        return tuple(l + cell * n for l, n in zip(low, i))

    grid = [range(n + 1) for n in counts]
    values = {(i, j, k): f(point((i, j, k))) for i in grid[0] for j in grid[1] for k in grid[2]}
    crossings, quads = collections.defaultdict(list), []
    for i, value in values.items():
        for axis in range(3):
            other = moved(i, axis, 1)
            if other not in values or (value < 0) == (values[other] < 0):
                continue
            t = value / (value - values[other])
            u, v = (axis + 1) % 3, (axis + 2) % 3
            cells = [i, moved(i, u, -1), moved(moved(i, u, -1), v, -1), moved(i, v, -1)]
            for c in cells:
                crossings[c].append(lerp(point(i), point(other), t))
            quads.append(cells if value < 0 else cells[::-1])
    index = {c: n for n, c in enumerate(crossings)}
    vertices = [mean(at) for at in crossings.values()]
    quads = [[index[c] for c in quad] for quad in quads]

    beside = collections.defaultdict(set)
    for quad in quads:
        for n in range(4):
            beside[quad[n]].update((quad[n - 1], quad[(n + 1) % 4]))
    for _ in range(6):
        means = [mean([vertices[m] for m in beside[n]]) for n in range(len(vertices))]
        vertices = [drawn(f, lerp(v, m, 0.5)) for v, m in zip(vertices, means)]

    faces = []
    for a, b, c, d in quads:
        short = math.dist(vertices[a], vertices[c]) < math.dist(vertices[b], vertices[d])
        faces += strip(a, b, c, d) if short else strip(b, c, d, a)
    return vertices, faces


def moved(i, axis, by):
    return tuple(n + by * (k == axis) for k, n in enumerate(i))


def mean(points):
    return tuple(sum(x) / len(points) for x in zip(*points))


def lerp(a, b, t):
    return tuple(u + t * (v - u) for u, v in zip(a, b))


def drawn(f, p):
    """A step of Newton's method, of at most 0.03."""
    h = 1e-4
    value = f(p)
    slope = [(f(moved_by(p, k, h)) - f(moved_by(p, k, -h))) / (2 * h) for k in range(3)]
    step = value / max(dot(slope, slope), 0.1)
    step *= min(1.0, 0.03 / max(abs(step) * math.sqrt(dot(slope, slope)), 1e-12))
    return tuple(x - step * s for x, s in zip(p, slope))


def moved_by(p, axis, h):
    return tuple(x + h * (k == axis) for k, x in enumerate(p))


# Checks and files.

def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def check(name, vertices, faces, handles):
    """Closed, without an edge or a vertex where more than one sheet meets, turned outward."""
    halves = collections.Counter((f[n], f[(n + 1) % 3]) for f in faces for n in range(3))
    assert max(halves.values()) == 1 and all((b, a) in halves for a, b in halves), f"{name}: an edge"
    assert len(vertices) - len(halves) // 2 + len(faces) == 2 - 2 * handles, f"{name}: handles"
    around = collections.defaultdict(dict)
    for f in faces:
        for n in range(3):
            around[f[n]][f[(n + 1) % 3]] = f[(n + 2) % 3]
    for v, fan in around.items():
        first = at = next(iter(fan))
        for _ in range(len(fan) - 1):
            at = fan[at]
            assert at != first, f"{name}: vertex {v}"
    volume = sum(dot(vertices[a], cross(vertices[b], vertices[c])) for a, b, c in faces) / 6
    assert volume > 0, f"{name}: inside out"


def write(name, mesh, handles=0):
    vertices, faces = mesh
    if handles is not None:
        check(name, vertices, faces, handles)
    lines = ["v " + " ".join(f"{x + 0.0:.4f}".replace("-0.0000", "0.0000") for x in v) for v in vertices]
    lines += ["f " + " ".join(str(n + 1) for n in f) for f in faces]
    MESHES.mkdir(exist_ok=True)
    (MESHES / f"{name}.obj").write_text("\n".join(lines) + "\n")
    print(f"{name}: {len(vertices)} vertices, {len(faces)} triangles")


def main():
    write("pawn", pawn())
    write("bishop", bishop())
    write("queen", queen())
    write("bulb", bulb())
    write("filament", filament())
    write("shade", shade(), handles=1)
    write("star", star(), handles=None)
    write("cube", cube())
    write("light-squares", squares(0), handles=None)
    write("dark-squares", squares(1), handles=None)
    write("teapot", net(teapot, (-1.25, -0.15, -0.85), (1.4, 1.4, 0.85), 0.09), handles=1)
    write("hare", net(hare, (-0.65, -0.15, -0.95), (0.65, 1.85, 0.85), 0.08))


if __name__ == "__main__":
    main()
