"""Binary glTF as NumPy arrays, by the rules of the specification; and what a daemon must make of a store."""

import json
import struct

import h5py
import numpy as np

NO_VERTEX = 0xFFFFFFFF
TYPES = {5126: "<f4", 5125: "<u4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


class Glb:
    def __init__(self, raw):
        magic, version, length = struct.unpack("<4sII", raw[:12])
        assert (magic, version, length) == (b"glTF", 2, len(raw)), (magic, version, length, len(raw))
        size, kind = struct.unpack("<I4s", raw[12:20])
        assert kind == b"JSON" and size % 4 == 0
        self.json = json.loads(raw[20:20 + size])
        n_binary, kind = struct.unpack("<I4s", raw[20 + size:28 + size])
        assert kind == b"BIN\0" and 28 + size + n_binary == len(raw)
        self.binary = raw[28 + size:]
        root = self.json["nodes"][self.json["scenes"][self.json["scene"]]["nodes"][0]]
        self.about = self.json["extras"]["lambert"]
        assert root["extras"]["lambert"] == self.about
        self.groups = {self.json["nodes"][k]["name"]: Group(self, self.json["nodes"][k]) for k in root["children"]}

    def array(self, k):
        accessor = self.json["accessors"][k]
        view = self.json["bufferViews"][accessor["bufferView"]]
        kind, width = TYPES[accessor["componentType"]], WIDTHS[accessor["type"]]
        start = view["byteOffset"] + accessor["byteOffset"]
        assert view.get("byteStride", 4 * width) == 4 * width
        assert accessor["byteOffset"] + 4 * width * accessor["count"] <= view["byteLength"]
        found = np.frombuffer(self.binary, kind, accessor["count"] * width, start)
        return found.reshape(-1, width) if width > 1 else found


class Group:
    def __init__(self, file, node):
        (primitive,) = file.json["meshes"][node["mesh"]]["primitives"]
        assert primitive["mode"] == 4
        self.index = node["extras"]["group"]
        self.count = node["extras"]["elements"]
        self.attributes = primitive["attributes"]
        self.position, self.normal, self.element, self.face = (file.array(self.attributes[k])
                                                               for k in ("POSITION", "NORMAL", "_ELEMENT", "_FACE"))
        self.corner = file.array(self.attributes["_CORNER"]) if "_CORNER" in self.attributes else None
        self.triangles = file.array(primitive["indices"]).reshape(-1, 3)
        self.material = file.json["materials"][primitive["material"]]

    def areas(self):
        a, b, c = (self.position[self.triangles[:, k]].astype(float) for k in range(3))
        return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2

    def emission(self):
        """The exitance: pi times the luminance, which is emissiveFactor times emissiveStrength."""
        extension = self.material.get("extensions", {}).get("KHR_materials_emissive_strength", {"emissiveStrength": 1})
        return np.pi * np.array(self.material.get("emissiveFactor", [0, 0, 0])) * extension["emissiveStrength"]


def turned(vectors, up):
    """Vectors of a scene as glTF has them."""
    x, y, z = np.asarray(vectors, dtype=float).T
    return np.stack({"x": (-y, x, z), "y": (x, y, z), "z": (x, z, -y)}[up], axis=1)


def colour(values, area):
    """The mean of [C][n] by area, as red, green and blue."""
    mean = values.astype(float) @ (area / area.sum())
    return mean if len(mean) == 3 else np.repeat(mean.mean(), 3)


def check(test, raw, store, kind=None, reflectance=None):
    """That the file has what the store has, of the operator `kind`, but for these reflectances; returns it."""
    glb = Glb(raw)
    with h5py.File(store, "r") as f:
        m = {name: f["mesh"][name][()] for name in "vertices elements area normal reflectance emission group".split()}
        face = f["mesh/face"][()].astype(float) if "mesh/face" in f else np.full(len(m["elements"]), -1.)
        names = [name.decode() for name in f["mesh/group_names"][()]]
        up = f["mesh"].attrs["up"].decode()
    if reflectance is not None:
        m["reflectance"] = reflectance
    test.assertEqual(glb.about["elements"], len(m["elements"]))
    test.assertEqual(glb.about["channels"], len(m["reflectance"]))
    test.assertEqual(list(glb.groups), [name for g, name in enumerate(names) if (m["group"] == g).any()])
    vertices = turned(m["vertices"], up).astype(np.float32)
    for name, group in glb.groups.items():
        members = np.flatnonzero(m["group"] == names.index(name))
        test.assertEqual((names[group.index], group.count), (name, len(members)))
        corners = m["elements"][members]
        used = corners != NO_VERTEX
        np.testing.assert_array_equal(group.element, np.repeat(members, used.sum(axis=1)))
        np.testing.assert_array_equal(group.face, np.repeat(np.where(face < NO_VERTEX, face, -1)[members], used.sum(axis=1)))
        np.testing.assert_array_equal(group.position, vertices[corners[used]])
        # Elements follow each other with one or two triangles, each of its own corners.
        of_triangle = group.element[group.triangles]
        np.testing.assert_array_equal(of_triangle, np.repeat(members, used.sum(axis=1) - 2)[:, None] * np.ones(3, int))
        np.testing.assert_allclose(np.linalg.norm(group.normal, axis=1), 1, atol=1e-6)
        area = m["area"][members]
        np.testing.assert_allclose(group.material["pbrMetallicRoughness"]["baseColorFactor"],
                                   [*colour(m["reflectance"][:, members], area), 1], rtol=1e-6)
        np.testing.assert_allclose(group.emission(), colour(m["emission"][:, members], area), rtol=1e-6)
        test.assertEqual(group.material["name"], name)
    return glb
