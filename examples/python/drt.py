"""Calls `drt` from Python, and reads and writes its files with NumPy alone.

    image(scene_or_job, ...)        the image, rows x columns x 3, linear
    gradient(job, adjoint, ...)     dLoss/dparameters, from dLoss/dimage
    read_exr(path), write_exr(path, image)

Set DRT to the program where it is not on the PATH.
"""

import os
import struct
import subprocess
import tempfile
import zlib
from pathlib import Path

import numpy as np


def run(*arguments):
    """Runs `drt`; its one message is the error where it fails."""
    program = os.environ.get("DRT", "drt")
    done = subprocess.run([program, *map(str, arguments)], stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip() or f"drt ended with {done.returncode}")


def image(path, spp, seed=0, options=()):
    """The image of a scene or job."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "image.exr"
        run("render", path, "-o", out, "--spp", spp, "--seed", seed, "--quiet", *options)
        return read_exr(out)[""]


def gradient(job, adjoint, spp, seed=0, options=()):
    """The derivatives of a loss by a job's parameters, and then by those of its groups, in its order: `adjoint` holds those of the loss by
    the image. The image that they come of must have had another seed, or its noise and that of the gradient would have to do with each other."""
    with tempfile.TemporaryDirectory() as folder:
        given, out = Path(folder) / "adjoint.npy", Path(folder) / "gradient.npy"
        np.save(given, np.ascontiguousarray(adjoint, dtype="<f8"))
        run("grad", job, "--adjoint", given, "-o", out, "--spp", spp, "--seed", seed, "--quiet", *options)
        return np.load(out)


# OpenEXR, version 2: one part of scan lines, not compressed or by ZIP, which is all that drt writes.
NONE, ZIP_LINE, ZIP_BLOCK = 0, 2, 3
LINES = {NONE: 1, ZIP_LINE: 1, ZIP_BLOCK: 16}
# Unsigned, half and single precision.
TYPES = [np.dtype("<u4"), np.dtype("<f2"), np.dtype("<f4")]


def read_exr(path):
    """The layers of an image by name, rows x columns x 3; the image itself is the one without a name."""
    data = Path(path).read_bytes()
    magic, version = struct.unpack_from("<II", data)
    if magic != 20000630 or version != 2 and version != 2 | 1 << 10:
        raise ValueError(f"{path}: no OpenEXR file of one part of scan lines")
    attributes, at = {}, 8
    while data[at]:
        name, at = _text(data, at)
        _, at = _text(data, at)
        (size,) = struct.unpack_from("<I", data, at)
        attributes[name] = data[at + 4 : at + 4 + size]
        at += 4 + size
    channels, end = [], 0
    listed = attributes["channels"]
    while listed[end]:
        name, end = _text(listed, end)
        channels.append((name, TYPES[struct.unpack_from("<I", listed, end)[0]]))
        end += 16
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    compression = attributes["compression"][0]
    lines = LINES.get(compression)
    if lines is None:
        raise ValueError(f"{path}: its compression {compression} is not read here")
    planes = {name: np.empty((height, width), np.float32) for name, _ in channels}
    bytes_per_line = width * sum(kind.itemsize for _, kind in channels)
    chunks = -(-height // lines)
    for offset in struct.unpack_from(f"<{chunks}Q", data, at + 1):
        y, size = struct.unpack_from("<iI", data, offset)
        rows = min(lines, bottom + 1 - y)
        block = data[offset + 8 : offset + 8 + size]
        # Blocks that would not get smaller are stored as they are.
        if compression != NONE and size < rows * bytes_per_line:
            block = _unzip(block)
        start = 0
        for row in range(y - top, y - top + rows):
            for name, kind in channels:
                planes[name][row] = np.frombuffer(block, kind, width, start)
                start += width * kind.itemsize
    layers = {}
    for name, _ in channels:
        layer, dot, channel = name.rpartition(".")
        if channel in "RGB":
            pixels = layers.setdefault(layer, np.zeros((height, width, 3), np.float32))
            pixels[..., "RGB".index(channel)] = planes[name]
    return layers


def write_exr(path, pixels):
    """Writes an image, rows x columns x 3, as single precision without compression."""
    pixels = np.ascontiguousarray(pixels, dtype="<f4")
    height, width, _ = pixels.shape
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    listed = b"".join(c + b"\0" + struct.pack("<IIii", 2, 0, 1, 1) for c in (b"B", b"G", b"R"))
    head = b"".join(
        name + b"\0" + kind + b"\0" + struct.pack("<I", len(value)) + value
        for name, kind, value in (
            (b"channels", b"chlist", listed + b"\0"),
            (b"compression", b"compression", bytes([NONE])),
            (b"dataWindow", b"box2i", box),
            (b"displayWindow", b"box2i", box),
            (b"lineOrder", b"lineOrder", b"\0"),
            (b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
            (b"screenWindowCenter", b"v2f", struct.pack("<ff", 0, 0)),
            (b"screenWindowWidth", b"float", struct.pack("<f", 1)),
        )
    )
    head = struct.pack("<II", 20000630, 2) + head + b"\0"
    size = 12 * width
    first = len(head) + 8 * height
    offsets = struct.pack(f"<{height}Q", *(first + y * (8 + size) for y in range(height)))
    lines = (
        struct.pack("<iI", y, size) + pixels[y].T[::-1].tobytes() for y in range(height)
    )
    Path(path).write_bytes(head + offsets + b"".join(lines))


def write_png(path, pixels):
    """Writes linear colours from 0 to 1 as a picture to look at."""
    v = np.clip(pixels, 0, 1)
    v = np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055)
    codes = np.round(255 * v).astype(np.uint8)
    height, width, _ = codes.shape
    rows = b"".join(b"\0" + row.tobytes() for row in codes)

    def chunk(kind, content):
        check = zlib.crc32(kind + content)
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", check)

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    Path(path).write_bytes(b"\x89PNG\r\n\x1a\n" + body)


def _text(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def _unzip(block):
    """Bytes were stored as differences, first those at even places, then those at odd ones."""
    coded = np.frombuffer(zlib.decompress(block), np.uint8).astype(np.int64)
    coded[1:] -= 128
    plain = np.cumsum(coded).astype(np.uint8)
    out = np.empty_like(plain)
    half = (len(plain) + 1) // 2
    out[0::2], out[1::2] = plain[:half], plain[half:]
    return out.tobytes()
