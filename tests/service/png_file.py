"""Reads the pictures that tests look at."""

import struct
import zlib

import numpy


def decode_png(path):
    """A PNG of 8 or 16 bits a channel as an array [height][width][channels], by the specification alone."""
    with open(path, "rb") as file:
        return decode_png_bytes(file.read(), path)


def decode_png_bytes(data, path):
    """The same of its bytes."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n", path
    place, packed = 8, b""
    while place < len(data):
        length, kind = struct.unpack(">I4s", data[place:place + 8])
        body = data[place + 8:place + 8 + length]
        assert struct.unpack(">I", data[place + 8 + length:place + 12 + length])[0] == zlib.crc32(kind + body)
        place += 12 + length
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
            assert depth in (8, 16)
        elif kind == b"IDAT":
            packed += body
    assert kind == b"IEND"
    channels = {0: 1, 2: 3}[colour] * depth // 8  # bytes: filters know no more
    rows = numpy.frombuffer(zlib.decompress(packed), numpy.uint8).reshape(height, 1 + width * channels)
    pixels = numpy.zeros((height, width, channels), int)
    above = numpy.zeros((width, channels), int)
    for y in range(height):
        row = rows[y, 1:].reshape(width, channels).astype(int)
        method = rows[y, 0]
        if method == 1:
            row = numpy.cumsum(row, axis=0) & 255
        elif method == 2:
            row = (row + above) & 255
        elif method in (3, 4):
            left, corner = numpy.zeros(channels, int), numpy.zeros(channels, int)
            for x in range(width):
                up = above[x]
                if method == 3:
                    guess = (left + up) // 2
                else:
                    to_left, to_up = abs(up - corner), abs(left - corner)
                    to_corner = abs(left + up - 2 * corner)
                    guess = numpy.where((to_left <= to_up) & (to_left <= to_corner), left,
                                        numpy.where(to_up <= to_corner, up, corner))
                row[x] = (row[x] + guess) & 255
                left, corner = row[x], up
        pixels[y] = above = row
    return pixels if depth == 8 else 256 * pixels[..., ::2] + pixels[..., 1::2]
