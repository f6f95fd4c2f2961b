#!/usr/bin/env python3
"""Makes tests/fixtures/textures: a small picture as JPEG and WebP, and what their own tools decode them to, as PNG.
Needs cjpeg, djpeg (libjpeg-turbo-progs), cwebp and dwebp (webp). The tests need none of them."""

import pathlib
import struct
import subprocess
import zlib

import numpy as np

folder = pathlib.Path(__file__).resolve().parents[1] / "fixtures" / "textures"


def png_bytes(pixels):
    """An array [height][width][3] or [4] of bytes as a PNG."""
    height, width, channels = pixels.shape
    rows = b"".join(b"\0" + row.tobytes() for row in pixels.astype(np.uint8))

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    head = struct.pack(">2I5B", width, height, 8, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


def picture():
    """40 x 24 pixels: a gradient, a red disc and dark stripes."""
    y, x = np.mgrid[0:24, 0:40]
    pixels = np.stack([x * 6, y * 10, 250 - x * 5], axis=-1)
    pixels[(x - 12) ** 2 + (y - 12) ** 2 < 60] = (200, 30, 20)
    pixels[(x > 28) & (x % 4 < 2)] = (12, 14, 10)
    return pixels


def tool(*command, given):
    return subprocess.run(command, input=given, capture_output=True, check=True).stdout


def main():
    pixels = picture()
    folder.mkdir(exist_ok=True)
    raw = b"P6 40 24 255\n" + pixels.astype(np.uint8).tobytes()
    jpeg = tool("cjpeg", "-quality", "85", "-sample", "2x2", given=raw)
    webp = tool("cwebp", "-quiet", "-q", "80", "-o", "-", "--", "-", given=png_bytes(pixels))
    for name, data, decoded in (("tile.jpg", jpeg, tool("djpeg", "-dct", "int", "-pnm", given=jpeg)),
                                ("tile.webp", webp, tool("dwebp", "-quiet", "-ppm", "-o", "-", "--", "-", given=webp))):
        (folder / name).write_bytes(data)
        body = np.frombuffer(decoded[-40 * 24 * 3:], np.uint8).reshape(24, 40, 3)
        (folder / f"{name}.png").write_bytes(png_bytes(body))


if __name__ == "__main__":
    main()
