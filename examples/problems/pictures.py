"""Pictures in PNG files, and how much they differ. Uses only Python's standard library."""

import math
import pathlib
import struct
import zlib


def read_png(path):
    """Width, height and the bytes of a picture of 8 bits a channel, red, green and blue side by side, row by row."""
    data = pathlib.Path(path).read_bytes()
    at, packed, head = 8, b"", None
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            head = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed += body
        at += 12 + length
    width, height, depth, colour, *_, interlaced = head
    if (depth, colour, interlaced) != (8, 2, 0):
        raise ValueError(f"{path}: expected 8 bits of red, green and blue")
    rows = zlib.decompress(packed)
    above, pixels = bytearray(3 * width), bytearray()
    for y in range(height):
        start = y * (3 * width + 1)
        above = unfiltered(rows[start], bytearray(rows[start + 1 : start + 1 + 3 * width]), above)
        pixels += above
    return width, height, bytes(pixels)


def unfiltered(kind, row, above):
    """A row as it was before PNG's filter."""
    for i in range(len(row)):
        left, corner = (row[i - 3], above[i - 3]) if i >= 3 else (0, 0)
        if kind == 1:
            row[i] = row[i] + left & 255
        elif kind == 2:
            row[i] = row[i] + above[i] & 255
        elif kind == 3:
            row[i] = row[i] + (left + above[i]) // 2 & 255
        elif kind == 4:
            guess = left + above[i] - corner
            row[i] = row[i] + min((left, above[i], corner), key=lambda v: abs(guess - v)) & 255
    return row


def mean_square(one, other):
    """The mean square difference of the bytes of two pictures, in units of the largest byte."""
    (*size, a), (*other_size, b) = read_png(one), read_png(other)
    if size != other_size:
        raise ValueError(f"{one} and {other} are not of one size")
    return sum((p - q) ** 2 for p, q in zip(a, b)) / len(a) / 255**2


def decibels(square):
    """The peak signal-to-noise ratio of a mean square difference."""
    return -10 * math.log10(square) if square > 0 else math.inf
