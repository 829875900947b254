#!/usr/bin/env python3
"""Makes fifty clusters of translucent grains, in ten columns and five rows, the picture that they are to look like, the scene and the job.

Each cluster has a mesh of nine grains, a medium, and two unknowns: its albedo, which goes from blue to orange, and the size of its grains.
The last unknown is the brightness of the lamp.
"""

import pathlib
import random
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import assets

LETTERS = """
..#.......
..#....#..
###.##.###
#.#.#..#..
###.#..##.
""".split()
COLUMNS, ROWS, CELL, RADIUS = 10, 5, 12, 0.1
BLUE, ORANGE = (0.25, 0.5, 0.9), (0.95, 0.55, 0.15)
NAMES = [f"{row}{column}" for row in range(ROWS) for column in range(COLUMNS)]

run = assets.run_folder(__file__)
random.seed(2)
ball, ball_faces = assets.icosphere(1)


def write_cluster(name):
    """Writes the mesh of a cluster, and the velocities of its points when the grains grow by their own size."""
    points, faces, velocities = [], [], []
    for n in range(9):
        middle = (
            int(name[1:]) - (COLUMNS - 1) / 2 + 0.32 * (n % 3 - 1) + random.uniform(-0.015, 0.015),
            (ROWS - 1) / 2 - int(name[0]) + 0.32 * (n // 3 - 1) + random.uniform(-0.015, 0.015),
            random.uniform(-0.15, 0.15),
        )
        radius = RADIUS * random.uniform(0.8, 1)
        faces += [tuple(i + len(points) for i in f) for f in ball_faces]
        points += [tuple(c + radius * x for c, x in zip(middle, p)) for p in ball]
        velocities += [tuple(radius * x for x in p) for p in ball]
    assets.write_ply(run / f"{name}.ply", points, faces)
    (run / f"{name}.txt").write_text("".join("{:.9f} {:.9f} {:.9f}\n".format(*v) for v in velocities))


def drawing(column, row):
    """Orange letters on dark blue."""
    return (0.68, 0.44, 0.2) if LETTERS[row // CELL][column // CELL] == "#" else (0.2, 0.28, 0.44)


def numbers(values):
    return ", ".join(f"{v:.4g}" for v in values)


def grains(name):
    middle = [(a + b) / 2 for a, b in zip(BLUE, ORANGE)]
    return f"""
    <medium type="homogeneous" id="inside-{name}">
        <float name="sigma_t" value="25"/>
        <rgb name="albedo" value="{numbers(middle)}"/>
    </medium>
    <shape type="ply" id="grains-{name}">
        <string name="filename" value="{name}.ply"/>
        <boolean name="face_normals" value="true"/>
        <bsdf type="null"/>
        <ref name="interior" id="inside-{name}"/>
    </shape>"""


def unknowns(name):
    half = [(b - a) / 2 for a, b in zip(BLUE, ORANGE)]
    return f"""
[[parameter]]
name = "albedo-{name}"         # -1 is blue, 1 is orange
effect = [{{ target = "inside-{name}", property = "albedo", add = [{numbers(half)}] }}]
[[parameter]]
name = "size-{name}"
effect = [{{ target = "grains-{name}", vertex_velocity = "{name}.txt" }}]
"""


for name in NAMES:
    write_cluster(name)
assets.write_png(run / "target.png", COLUMNS * CELL, ROWS * CELL, drawing)

(run / "scene.xml").write_text(f"""<scene version="3.0.0">
    <integrator type="volpath">
        <integer name="max_depth" value="6"/>
        <integer name="rr_depth" value="100"/>
    </integrator>

    <sensor type="perspective" id="camera">
        <float name="fov" value="18.92"/>
        <transform name="to_world">
            <lookat origin="0, 0, 30" target="0, 0, 0" up="0, 1, 0"/>
        </transform>
        <film type="hdrfilm">
            <integer name="width" value="{COLUMNS * CELL}"/>
            <integer name="height" value="{ROWS * CELL}"/>
            <rfilter type="tent"/>
        </film>
    </sensor>
{"".join(grains(name) for name in NAMES)}

    <shape type="rectangle" id="ground">
        <transform name="to_world">
            <scale x="8" y="5"/>
            <translate z="-0.5"/>
        </transform>
        <bsdf type="diffuse">
            <rgb name="reflectance" value="0.006"/>
        </bsdf>
    </shape>
    <shape type="rectangle" id="lamp">
        <transform name="to_world">
            <scale value="4"/>
            <lookat origin="-5, 6, 16" target="0, 0, 0" up="0, 1, 0"/>
        </transform>
        <emitter type="area">
            <rgb name="radiance" value="20"/>
        </emitter>
    </shape>
    <emitter type="constant" id="sky">
        <rgb name="radiance" value="0.2"/>
    </emitter>
</scene>
""")

albedos = "\n".join(f"albedo-{name} = [-1, 1]\nsize-{name} = [-0.7, 0.45]" for name in NAMES)
(run / "job.toml").write_text(f"""# Fifty clusters of grains are to look like a drawing: their colours, their sizes, and the brightness of the lamp.
scene = "scene.xml"

[estimator]
kind = "path-space"
{"".join(unknowns(name) for name in NAMES)}
[[parameter]]
name = "brightness"
effect = [{{ target = "lamp", property = "radiance", multiply = 1.0, log = true }}]

[optimize]
targets = ["target.png"]
loss = {{ pyramid-l2 = {{ levels = 4, weight = 16 }} }}
optimizer = {{ kind = "gauss-newton", learning_rate = 0.2, iterations = 14 }}
spp = [[0, 16], [9, 64]]
checkpoint = "out"

[optimize.bounds]
{albedos}
""")
