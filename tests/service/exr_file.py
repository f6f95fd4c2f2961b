"""Reads the OpenEXR files that tests look at: one part of scanlines, compressed by zlib in blocks of 16."""

import struct
import zlib

import numpy

TYPES = {1: "<f2", 2: "<f4"}


def text_at(data, place):
    end = data.index(b"\0", place)
    return data[place:end].decode(), end + 1


def read_value(kind, body):
    if kind == "string":
        return body.decode()
    if kind == "float":
        return struct.unpack("<f", body)[0]
    if kind == "chromaticities":
        return struct.unpack("<8f", body)
    return body


def read_header(data):
    assert data[:4] == bytes((0x76, 0x2f, 0x31, 0x01)), data[:4]
    assert data[4] == 2 and data[5:8] == b"\0\0\0", data[4:8]
    attributes, place = {}, 8
    while data[place]:
        name, place = text_at(data, place)
        kind, place = text_at(data, place)
        (length,) = struct.unpack("<i", data[place:place + 4])
        attributes[name] = read_value(kind, data[place + 4:place + 4 + length])
        place += 4 + length
    return attributes, place + 1


def read_channels(body):
    channels, place = [], 0
    while body[place]:
        name, place = text_at(body, place)
        kind, _, across, down = struct.unpack("<iB3xii", body[place:place + 16])
        assert across == down == 1
        channels.append((name, TYPES[kind]))
        place += 16
    assert [name for name, _ in channels] == sorted(name for name, _ in channels)
    return channels


def unpack(packed, size):
    """Undoes zlib, the differences of bytes and their order."""
    if len(packed) == size:
        return packed
    plain = numpy.frombuffer(zlib.decompress(packed), numpy.uint8).astype(int)
    plain[1:] -= 128
    plain = (numpy.cumsum(plain) & 255).astype(numpy.uint8)
    assert len(plain) == size
    whole = numpy.empty(size, numpy.uint8)
    whole[0::2], whole[1::2] = plain[:(size + 1) // 2], plain[(size + 1) // 2:]
    return whole.tobytes()


def decode_exr(path):
    """Channels by name, arrays [height][width], and the attributes."""
    with open(path, "rb") as file:
        data = file.read()
    attributes, place = read_header(data)
    assert attributes["compression"] == b"\3", attributes["compression"]
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    assert left == top == 0
    width, height = right + 1, bottom + 1
    channels = read_channels(attributes["channels"])
    planes = {name: numpy.full((height, width), numpy.nan, numpy.float32) for name, _ in channels}
    row_bytes = width * sum(numpy.dtype(kind).itemsize for _, kind in channels)
    blocks = (height + 15) // 16
    for offset in struct.unpack(f"<{blocks}Q", data[place:place + 8 * blocks]):
        first, length = struct.unpack("<ii", data[offset:offset + 8])
        rows = min(16, height - first)
        plain, at = unpack(data[offset + 8:offset + 8 + length], rows * row_bytes), 0
        for y in range(first, first + rows):
            for name, kind in channels:
                planes[name][y] = numpy.frombuffer(plain, kind, width, at)
                at += width * numpy.dtype(kind).itemsize
    return planes, attributes
