"""Values at the corners that elements share: POST .../radiosity with "at": "corners", and the mesh that fits."""

import io
import json
import unittest

import h5py
import numpy as np

from codings import unzstd
from command import must
from daemon import Daemon
from daemon_case import Case
from glb import Glb

QUICK = "--quiet", "--probes", 0
SINGLE = 2.0**-24


class Corners(Case):
    def scene(self, *generate, name="scene", options=()):
        """The store of a generated scene."""
        path = self.folder / f"{name}.h5"
        must("generate", *generate, "-o", self.folder / f"{name}.obj")
        must("precompute", self.folder / f"{name}.obj", "-o", path, *QUICK, *options)
        return path

    @staticmethod
    def ask(daemon, accept="application/json", status=200, scene="scene", **body):
        answer = daemon.radiosity(scene, json.dumps({"emission": {"groups": {"lamp": 5}}, **body}), headers={"Accept": accept})
        assert answer.status == status, answer
        return answer.json() if accept == "application/json" or status != 200 else np.load(io.BytesIO(answer.body))

    @staticmethod
    def mesh(daemon, query, scene="scene"):
        answer = daemon.get(f"/v1/scenes/{scene}/mesh?{query}")
        assert answer.status == 200, answer
        return Glb(answer.body)

    def test_the_mesh_fits(self):
        path = self.scene("cornell", "--elements", 400)
        with h5py.File(path, "r") as f:
            area, n = f["mesh/area"][()], len(f["mesh/area"])
        with Daemon(path) as daemon:
            values = np.array(self.ask(daemon, at="corners")["radiosity"])
            shared, own = self.mesh(daemon, "corners"), self.mesh(daemon, "corners=elements")
        count = shared.about["corners"]["count"]
        self.assertEqual(values.shape, (3, count))
        # Vertex v of all groups together is corner v.
        np.testing.assert_array_equal(np.concatenate([g.corner for g in shared.groups.values()]), np.arange(count))
        self.assertLess(count, 2 * n)
        for found in shared, own:
            # Triangles cover the elements; corners are single floats of some metres, and edges of 1 cm and more.
            self.assertAlmostEqual(sum(g.areas().sum() for g in found.groups.values()) / area.sum(), 1, places=6)
            self.assertGreater(min(g.areas().min() for g in found.groups.values()), 0)
        of_element = np.zeros(n)
        positions = np.concatenate([g.position for g in shared.groups.values()])
        for group in own.groups.values():
            np.add.at(of_element, group.element[group.triangles[:, 0]].astype(int), group.areas())
            np.testing.assert_allclose(group.position, positions[group.corner.astype(int)], atol=1e-5)
        np.testing.assert_allclose(of_element, area, rtol=1e-4)
        self.no_cracks(shared)

    def no_cracks(self, found):
        """No corner is inside an edge of a triangle of any group: all that meet there have it."""
        positions = np.concatenate([g.position for g in found.groups.values()]).astype(float)
        hanging = 0
        for group in found.groups.values():
            for k in range(3):
                a, b = (group.position[group.triangles[:, j]].astype(float) for j in (k, (k + 1) % 3))
                way = b - a
                square = (way**2).sum(axis=1)
                for begin, along, size in zip(a, way, square):
                    apart = positions - begin
                    t = apart @ along / size
                    off = np.linalg.norm(apart - t[:, None] * along, axis=1)
                    hanging += ((off < 1e-5) & (t > 1e-3) & (t < 1 - 1e-3)).sum()
        self.assertEqual(hanging, 0)

    def test_values_are_those_of_smooth_pictures(self):
        """Of lambert solve --smooth, which keeps emission apart: irradiance has none."""
        path = self.scene("cornell", "--elements", 300, "--closed")
        light = self.folder / "light.glb"
        must("solve", path, "--emit", "lamp=5", "--quantity", "irradiance", "--smooth", "-o", light)
        with Daemon(path) as daemon:
            values = np.array(self.ask(daemon, at="corners", quantity="irradiance")["irradiance"])
            own = self.mesh(daemon, "corners=elements")
        drawn = Glb(light.read_bytes())
        compared = 0
        for name, group in drawn.groups.items():
            ours = own.groups[name]
            places = {(e, *p): int(c) for e, p, c in zip(ours.element, ours.position.tolist(), ours.corner)}
            columns = [drawn.array(group.attributes[f"_IRRADIANCE_{c}"]) for c in "RGB"]
            for element, place, *wanted in zip(group.element, group.position.tolist(), *columns):
                np.testing.assert_allclose(values[:, places[(element, *place)]], wanted, rtol=2 * SINGLE)
                compared += 1
        self.assertGreater(compared, 1000)

    def test_weights_of_the_mesh_give_the_values(self):
        path = self.scene("cornell", "--elements", 300)
        with Daemon(path) as daemon:
            at_elements, at_corners = (np.array(self.ask(daemon, at=at)["radiosity"]) for at in ("elements", "corners"))
            raw = self.mesh(daemon, "corners=elements")
        rows = raw.about["corners"]
        parts, first, elements, weights = (np.frombuffer(raw.binary, kind, view["byteLength"] // 4, view["byteOffset"]) for kind, view in zip(
            ("<u4", "<u4", "<u4", "<f4"), (raw.json["bufferViews"][rows[k]] for k in ("parts", "first", "elements", "weights"))))
        self.assertEqual((len(parts), parts[0], parts[-1]), (rows["count"] + 1, 0, len(first) - 1))
        self.assertEqual((first[0], first[-1]), (0, len(elements)))
        self.assertGreater(parts[-1], rows["count"])  # of corners inside edges, which have those of the ends
        sums = np.add.reduceat(np.add.reduceat(weights.astype(float), first[:-1]), parts[:-1])
        np.testing.assert_allclose(sums, 1, atol=2e-5)  # of tens of weights, of which those below 1e-6 are left out
        bounds = 0
        for c in range(3):
            found = np.add.reduceat(weights.astype(float) * at_elements[c][elements], first[:-1])
            bounds += (found < 0).sum()
            found = np.add.reduceat(np.maximum(found, 0), parts[:-1])
            # Single precision, of weights up to some 3 and light up to the greatest around.
            np.testing.assert_allclose(found, at_corners[c], rtol=1e-4, atol=1e-5 * at_elements[c].max())
        self.assertGreater(bounds, 0)

    def test_every_format_and_batch(self):
        path = self.scene("cornell", "--elements", 300, "--closed", options=("--sky", "none"))
        with Daemon(path) as daemon:
            for quantity in "radiosity", "irradiance", "indirect":
                answer = self.ask(daemon, at="corners", quantity=quantity)
                self.assertEqual((answer["at"], answer["quantity"]), ("corners", quantity))
                values = np.array(answer[quantity], np.float32)
                single = self.ask(daemon, "application/x-npy", at="corners", quantity=quantity)
                np.testing.assert_array_equal(single, values)
                half = self.ask(daemon, "application/x-npy; dtype=f2", at="corners", quantity=quantity)
                self.assertEqual(half.dtype, np.float16)
                np.testing.assert_array_equal(half, values.astype(np.float16))
            lights = [{"groups": {"lamp": k + 1}} for k in range(7)]
            whole = daemon.radiosity("scene", json.dumps({"emissions": lights, "at": "corners"}), headers={"Accept": "application/x-npy"})
            alone = [self.ask(daemon, "application/x-npy", at="corners", emission=light) for light in lights]
            np.testing.assert_array_equal(np.load(io.BytesIO(whole.body)), alone)
            # Light below 0 stays so, where its elements are.
            dark, least = (np.array(self.ask(daemon, at=at, emission={"groups": {"lamp": -1}})["radiosity"]) for at in ("corners", "elements"))
            wanted = np.maximum(-alone[0], least.min(axis=1, keepdims=True))
            free = alone[0] > 0
            np.testing.assert_allclose(dark[free], wanted[free], atol=1e-6 * alone[0].max())

    def test_refusals(self):
        path = self.scene("cornell", "--elements", 300, options=("--keep-form-factors",))
        with Daemon(path) as daemon:
            for words, body in (("select", {"select": {"groups": ["floor"]}}), ("tolerance", {"tolerance": 1e-3}),
                                ("reduce", {"reduce": {"groups": ["floor"], "with": ["mean"]}})):
                detail = self.ask(daemon, status=422, at="corners", **body)["detail"]
                self.assertIn(words, detail)
                self.assertIn("corners", detail)
            self.assertIn("must be elements, faces or corners", self.ask(daemon, status=422, at="corner")["detail"])
            for query, words in (("corner", "may have corners alone"), ("corners=3", "be elements"), ("corners&corners", "a second time")):
                answer = daemon.get(f"/v1/scenes/scene/mesh?{query}")
                self.assertEqual((answer.status, words in answer.json()["detail"]), (422, True), answer)

    def test_tags_and_variants(self):
        path = self.scene("cornell", "--elements", 300, options=("--method", "low-rank", "--keep-factors"))
        with Daemon(path) as daemon:
            tags = {query: daemon.get(f"/v1/scenes/scene/mesh{query}").headers["ETag"] for query in ("", "?corners", "?corners=elements")}
            self.assertEqual(len(set(tags.values())), 3)
            for query, tag in tags.items():
                again = daemon.get(f"/v1/scenes/scene/mesh{query}", headers={"If-None-Match": tag})
                self.assertEqual((again.status, again.body), (304, b""))
            packed = daemon.get("/v1/scenes/scene/mesh?corners", headers={"Accept-Encoding": "zstd"})
            self.assertEqual(Glb(unzstd(packed.body)).about["corners"], self.mesh(daemon, "corners").about["corners"])
        (self.folder / "token").write_text("secret")
        access = {"Authorization": "Bearer secret", "Content-Type": "application/json"}
        with Daemon(path, "--max-variants", 1, "--token-file", self.folder / "token") as daemon:
            made = daemon.ask("PUT", "/v1/scenes/scene/reflectance", json.dumps({"variant": "red", "groups": {"floor": .1}}),
                              access)
            self.assertEqual(made.status, 202, made)
            daemon.wait_until(lambda: daemon.get("/v1/scenes/scene@red", headers=access).status == 200, "scene@red")
            body = json.dumps({"emission": {"groups": {"lamp": 5}}, "at": "corners"})
            variant, base = (np.array(daemon.radiosity(name, body, headers=access).json()["radiosity"]) for name in ("scene@red", "scene"))
            self.assertEqual(variant.shape, base.shape)
            self.assertGreater(np.abs(variant - base).max(), 1e-3)


if __name__ == "__main__":
    unittest.main()
