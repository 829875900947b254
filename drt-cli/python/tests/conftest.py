"""Small scenes for tests."""

import signal
import struct
from pathlib import Path

import numpy as np
import pytest

import drt

ROOT = Path(__file__).resolve().parents[3]

BOX = """<scene version="3.0.0">
  <default name="power" value="1"/>
  <integrator type="volpath"><integer name="max_depth" value="3"/></integrator>
  <sensor type="perspective" id="front">
    <float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, 0.6, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="10"/><integer name="height" value="8"/><rfilter type="box"/></film>
  </sensor>
  <sensor type="perspective" id="above">
    <float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, 4, 0" target="0, 0, 0" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="6"/><integer name="height" value="6"/><rfilter type="box"/></film>
  </sensor>
  <bsdf type="diffuse" id="white"><rgb name="reflectance" value="0.7"/></bsdf>
  <shape type="rectangle" id="floor">
    <transform name="to_world"><scale value="2"/><rotate x="1" angle="-90"/><translate y="-1"/></transform>
    <bsdf type="diffuse" id="painted">
      <texture name="reflectance" type="bitmap">
        <string name="filename" value="painting.exr"/><boolean name="raw" value="true"/>
      </texture>
    </bsdf>
  </shape>
  <shape type="cube" id="cube">
    <transform name="to_world"><scale value="0.5"/><rotate y="1" angle="30"/></transform>
    <ref id="white"/>
  </shape>
  <emitter type="point" id="lamp">
    <point name="position" x="1" y="2.5" z="2"/><rgb name="intensity" value="$power"/>
  </emitter>
  <emitter type="constant" id="sky"><rgb name="radiance" value="0.4"/></emitter>
</scene>
"""

CLOUD = """<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="3"/></integrator>
  <sensor type="perspective" id="front">
    <float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0.5, 0.5, 4" target="0.5, 0.5, 0.5" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/></film>
  </sensor>
  <medium type="heterogeneous" id="smoke">
    <volume name="sigma_t" type="gridvolume"><string name="filename" value="smoke.vol"/></volume>
    <volume name="albedo" type="constvolume"><float name="value" value="0.8"/></volume>
    <float name="scale" value="2"/>
  </medium>
  <shape type="cube" id="bounds">
    <transform name="to_world"><scale value="0.5"/><translate x="0.5" y="0.5" z="0.5"/></transform>
    <bsdf type="null"/><ref name="interior" id="smoke"/>
  </shape>
  <emitter type="constant" id="sky"><rgb name="radiance" value="1"/></emitter>
</scene>
"""


def volume(values):
    """The bytes of a `.vol` file of the unit cube, from z × y × x values."""
    z, y, x = values.shape
    head = struct.pack("<3sBiiiii6f", b"VOL", 3, 1, x, y, z, 1, 0, 0, 0, 1, 1, 1)
    return head + np.ascontiguousarray(values, "<f4").tobytes()


@pytest.fixture
def interrupts():
    """Ctrl-C is heard, also where a shell has started this in the background and so made it deaf."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def box(tmp_path):
    """The path of a scene of a cube above a painted floor, seen by two sensors."""
    painting = np.linspace(0.2, 0.8, 2 * 3 * 3).reshape(2, 3, 3)
    drt.write_exr(tmp_path / "painting.exr", painting)
    path = tmp_path / "box.xml"
    path.write_text(BOX)
    return path


@pytest.fixture
def cloud(tmp_path):
    """The path of a scene of smoke of 4 x 3 x 2 voxels."""
    values = np.random.default_rng(1).random((2, 3, 4)) + 0.1
    (tmp_path / "smoke.vol").write_bytes(volume(values))
    path = tmp_path / "cloud.xml"
    path.write_text(CLOUD)
    return path
