"""Black box: answers of `lambert solve` in every format, and the emissions that it reads."""

import csv
import json
import os
import unittest
import xml.etree.ElementTree

import h5py
import numpy

from case import Case
from command import lambert, must
from glb import Glb, turned


class Answers(Case):
    def solve(self, name, *arguments):
        must("solve", self.store, "-o", self.path(name), *arguments)
        return self.path(name)

    def glow(self):
        return [word for group in ("floor", "ceiling", "wall-x0", "wall-x1", "wall-y0", "wall-y1")
                for word in ("--emit", group + "=1")]

    def test_furnace(self):
        # In a closed box of one reflectance rho and one emission E, B = E / (1 - rho) exactly.
        B = numpy.load(self.solve("a.npy", *self.glow()))
        self.assertEqual((B.shape, B.dtype.str), ((96,), "<f4"))
        numpy.testing.assert_allclose(B, 2, rtol=1e-4)
        H = numpy.load(self.solve("h.npy", "--quantity", "irradiance", *self.glow()))
        numpy.testing.assert_allclose(H, 2, rtol=1e-4)
        indirect = numpy.load(self.solve("i.npy", "--quantity", "indirect", *self.glow()))
        numpy.testing.assert_allclose(indirect, 1, rtol=2e-4)

    def test_formats_agree(self):
        light = ("--emit", "floor=3", "--emit", "wall-x0=.5")
        B = numpy.load(self.solve("a.npy", *light))
        with open(self.solve("a.json", *light), encoding="utf-8") as file:
            answer = json.load(file)
        self.assertEqual((answer["scene"], answer["elements"], answer["channels"], answer["quantity"]),
                         ("box", 96, 1, "radiosity"))
        self.assertEqual(set(answer["error"]), {"stated", "parts", "relative_mean", "indirect_mean", "mesh", "light", "emitters"}
                         | ({"coarse", "advice"} if answer["error"]["stated"] > .1 else set()))
        numpy.testing.assert_array_equal(numpy.array(answer["radiosity"], "f4"), B)
        with open(self.solve("a.csv", *light), newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        numpy.testing.assert_array_equal(numpy.array([row["radiosity [W/m2]"] for row in rows], "f4"), B)
        self.assertEqual([int(row["element"]) for row in rows], list(range(96)))
        self.assertEqual({row["group"] for row in rows},
                         {"floor", "ceiling", "wall-x0", "wall-x1", "wall-y0", "wall-y1"})
        self.assertAlmostEqual(sum(float(row["area"]) for row in rows), 6)
        tree = xml.etree.ElementTree.parse(self.solve("a.vtu", *light))
        arrays = {array.get("Name"): array.text.split() for array in tree.iter("DataArray")}
        numpy.testing.assert_array_equal(numpy.array(arrays["radiosity"], "f4"), B)
        self.assertEqual(len(arrays["offsets"]), 96)
        self.assertEqual(int(arrays["offsets"][-1]), len(arrays["connectivity"]))
        with open(self.solve("a.ply", *light), "rb") as file:
            header, body = file.read().split(b"end_header\n", 1)
        n_vertices = int(header.split(b"element vertex ")[1].split()[0])
        faces = numpy.frombuffer(body[24 * n_vertices:], numpy.dtype(
            [("corners", "u1"), ("vertices", "<u4", 4), ("group", "<u4"), ("value", "<f4")]))
        self.assertEqual((len(faces), set(faces["corners"])), (96, {4}))
        numpy.testing.assert_array_equal(faces["value"], B)
        self.glb("a.glb", numpy.repeat(B[:, None], 4, axis=1), B, *light)

    def glb(self, name, corners, B, *options):
        """A file of glTF has the values of corners [n][4], and their colours."""
        with open(self.solve(name, *options), "rb") as file:
            made = Glb(file.read())
        with h5py.File(self.store) as file:
            area, vertices, elements = (file["mesh"][k][:] for k in ("area", "vertices", "elements"))
        white = made.about["white"]
        self.assertAlmostEqual(white, 4 * (B * area).sum() / area.sum(), delta=1e-5 * white)
        self.assertEqual(sum(group.count for group in made.groups.values()), 96)
        for group in made.groups.values():
            element = group.element.astype(int)
            corner = numpy.tile(numpy.arange(4), group.count)
            value, colour = (made.array(group.attributes[k]) for k in ("_RADIOSITY", "COLOR_0"))
            numpy.testing.assert_array_equal(value, corners[element, corner])
            numpy.testing.assert_allclose(colour, numpy.repeat(numpy.clip(value / white, 0, 1)[:, None], 3, axis=1), rtol=1e-6)
            numpy.testing.assert_array_equal(group.position, turned(vertices[elements[element, corner]], "z").astype("f4"))
            self.assertEqual(group.material["extensions"], {"KHR_materials_unlit": {}})

    def test_corners(self):
        # The light of a floor falls off towards its rim, so that corners at the rim have less than the mean there.
        light = ("--emit", "ceiling=3")
        B = numpy.load(self.solve("a.npy", *light))
        smooth = numpy.load(self.solve("s.npy", "--smooth", *light))
        self.assertEqual((smooth.shape, smooth.dtype.str), ((96, 4), "<f4"))
        with h5py.File(self.store) as file:
            names = [name.decode() for name in file["mesh/group_names"][:]]
            floor = file["mesh/group"][:] == names.index("floor")
            ceiling = file["mesh/group"][:] == names.index("ceiling")
            vertices, elements = file["mesh/vertices"][:], file["mesh/elements"][:]
        places = vertices[elements]
        middle = numpy.all(numpy.abs(places - .5)[..., :2] < 1e-9, axis=-1)
        rim = numpy.all(numpy.minimum(places, 1 - places)[..., :2] < 1e-9, axis=-1)
        self.assertEqual((middle[floor].sum(), rim[floor].sum()), (4, 4))
        self.assertLess(smooth[floor][rim[floor]].max(), B[floor].min())
        self.assertEqual(len(set(smooth[floor][middle[floor]])), 1)
        self.assertGreater(smooth[floor][middle[floor]][0], B[floor].mean())
        # Emission does not vary inside an element: the ceiling has 3 and what the walls give it.
        indirect = numpy.load(self.solve("i.npy", "--smooth", "--quantity", "indirect", *light))
        numpy.testing.assert_allclose(smooth[ceiling] - 3, indirect[ceiling], rtol=1e-5)
        # Other formats have the same, at one point for each corner, beside the means.
        tree = xml.etree.ElementTree.parse(self.solve("s.vtu", "--smooth", *light))
        points = {array.get("Name"): array.text.split() for array in tree.find(".//PointData")}
        cells = {array.get("Name"): array.text.split() for array in tree.find(".//CellData")}
        numpy.testing.assert_array_equal(numpy.array(points["radiosity"], "f4"), smooth.ravel())
        numpy.testing.assert_array_equal(numpy.array(cells["radiosity"], "f4"), B)
        at = numpy.array(tree.find(".//Points/DataArray").text.split(), float).reshape(-1, 3)
        connectivity = [int(word) for word in tree.find(".//Cells/DataArray").text.split()]
        numpy.testing.assert_array_equal(at[connectivity], places.reshape(-1, 3))
        with open(self.solve("s.ply", "--smooth", *light), "rb") as file:
            header, body = file.read().split(b"end_header\n", 1)
        self.assertIn(b"element vertex 384", header)
        vertex = numpy.frombuffer(body, numpy.dtype([("at", "<f8", 3), ("value", "<f4")]), 384)
        faces = numpy.frombuffer(body[28 * 384:], numpy.dtype(
            [("corners", "u1"), ("vertices", "<u4", 4), ("group", "<u4"), ("value", "<f4")]))
        numpy.testing.assert_array_equal(vertex["value"][faces["vertices"]], smooth)
        numpy.testing.assert_array_equal(vertex["at"][faces["vertices"]], places)
        numpy.testing.assert_array_equal(faces["value"], B)
        self.glb("s.glb", smooth, B, "--smooth", *light)
        # A batch has a vector more in front, each as if alone.
        E = numpy.zeros((2, 96))
        E[0, 7], E[1] = 5, 1
        numpy.save(self.path("e.npy"), E)
        both = numpy.load(self.solve("b.npy", "--smooth", "--emission", self.path("e.npy")))
        self.assertEqual(both.shape, (2, 96, 4))
        numpy.save(self.path("e1.npy"), E[1])
        numpy.testing.assert_array_equal(
            both[1], numpy.load(self.solve("b1.npy", "--smooth", "--emission", self.path("e1.npy"))))
        for arguments, words in ((("-o", "x.csv"), ".npy, .ply, .vtu or .glb only"), (("-o", "x.npy", "--reduce", "floor=mean"),
                                 "without --reduce"), ((), "is for -o"), (("-o", "x.npy", "--tolerance", "1e-3"),
                                                                          "--tolerance")):
            done = lambert("solve", self.store, "--smooth", *light, *arguments)
            self.assertEqual(done.returncode, 2, arguments)
            self.assertIn(words, done.stderr)

    def test_emission_files_agree_with_groups(self):
        wanted = numpy.load(self.solve("a.npy", "--emit", "floor=3"))
        with h5py.File(self.store) as file:
            names = [name.decode() for name in file["mesh/group_names"][:]]
            E = 3. * (file["mesh/group"][:] == names.index("floor"))
        inputs = {"f8.npy": E, "f4.npy": E.astype("f4")}
        for name, array in inputs.items():
            numpy.save(self.path(name), array)
        for name, document in (("dense.json", E.tolist()), ("groups.json", {"groups": {"floor": 3}}),
                               ("sparse.json", {"elements": numpy.flatnonzero(E).tolist(),
                                                "values": [3] * int((E > 0).sum())}),
                               ("body.json", {"emission": {"groups": {"floor": [3]}}})):
            with open(self.path(name), "w", encoding="utf-8") as file:
                json.dump(document, file)
            inputs[name] = None
        for name in inputs:
            with self.subTest(name):
                B = numpy.load(self.solve("b.npy", "--emission", self.path(name)))
                numpy.testing.assert_array_equal(B, wanted)
        # As for the daemon, rows of a grey scene are vectors: this is a batch of one.
        numpy.save(self.path("row.npy"), E[None])
        numpy.testing.assert_array_equal(numpy.load(self.solve("b.npy", "--emission", self.path("row.npy"))), wanted[None])

    def test_batches(self):
        E = numpy.zeros((3, 96))
        E[0], E[1, 5], E[2, ::2] = 1, 10, 2
        numpy.save(self.path("e.npy"), E)
        with open(self.path("e.json"), "w", encoding="utf-8") as file:
            json.dump({"emissions": E.tolist()}, file)
        B = numpy.load(self.solve("b.npy", "--emission", self.path("e.npy")))
        self.assertEqual(B.shape, (3, 96))
        numpy.testing.assert_array_equal(numpy.load(self.solve("c.npy", "--emission", self.path("e.json"))), B)
        for v in range(3):
            numpy.save(self.path("one.npy"), E[v])
            numpy.testing.assert_array_equal(numpy.load(self.solve("one-b.npy", "--emission", self.path("one.npy"))),
                                             B[v])
        with open(self.solve("b.json", "--emission", self.path("e.npy")), encoding="utf-8") as file:
            numpy.testing.assert_array_equal(numpy.array(json.load(file)["radiosity"], "f4"), B)

    def test_bad_emissions(self):
        def npy(name, array):
            numpy.save(self.path(name), array)
            return name
        def text(name, content):
            with open(self.path(name), "w", encoding="utf-8") as file:
                file.write(content)
            return name
        good = numpy.ones(96)
        nan = good.copy()
        nan[7] = numpy.nan
        numpy.save(self.path("cut.npy"), good)
        with open(self.path("cut.npy"), "r+b") as file:
            file.truncate(300)
        for name, wanted in (
                (npy("short.npy", good[:-1]), "must be (96)"), (npy("nan.npy", nan), "value 7 is NaN"),
                (npy("int.npy", good.astype(int)), "<f4 or <f8"),
                (npy("big-endian.npy", good.astype(">f8")), "(big-endian), must be <f4 or <f8"),
                (npy("fortran.npy", numpy.asfortranarray(-numpy.ones((2, 97)))), "shape"),
                (npy("deep.npy", numpy.ones((1, 1, 1, 96))), "3 axes"),
                (npy("colour.npy", numpy.ones((2, 3, 96))), "shape"), (npy("none.npy", numpy.ones((0, 96))), "empty"),
                (npy("huge.npy", numpy.array([1e300] * 96)), "single precision"),
                ("cut.npy", "its shape and type need 768"),
                (text("a.json", "{"), "not JSON"), (text("b.json", "[1,NaN]"), "not JSON"),
                (text("c.json", "[1,2]"), "must be 96"), (text("d.json", '{"groups":{"lava":1}}'), 'no group "lava"'),
                (text("e.json", '{"elements":[96],"values":[1]}'), "from 0 to 95"),
                (text("f.json", '{"elements":[1],"values":[]}'), "must be as many"),
                (text("g.json", '{"elements":[1],"values":["-1"]}'), "must be a number"),
                (text("h.json", '{"sky":[1]}'), "has no sky"), (text("i.json", '{"emissions":[]}'), "empty"),
                (text("j.json", '{"groups":{"floor":"bright"}}'), "must be a number"),
                (text("k.json", "[1e999]"), "0 = 1e999"),
                (text("l.json", '{"floor":1}'), "floor is not a member"), (text("m.txt", "1"), "must end in"),
                (text("n.npy", "not an array"), "is not NPY"), ("missing.npy", "No such file"),
                ("missing.json", "missing.json")):
            with self.subTest(name):
                self.refused(1, wanted, "solve", self.store, "--emission", self.path(name), "-o", self.path("out.npy"))
                self.assertFalse(os.path.exists(self.path("out.npy")))
        self.refused(1, 'no group "lava"', "solve", self.store, "--emit", "lava=1")
        self.refused(1, 'did you mean "floor"?', "solve", self.store, "--emit", "flor=1")
        self.refused(1, "2 values", "solve", self.store, "--emit", "floor=1,2")
        self.refused(1, "no light of its own", "solve", self.store)

    def test_reduce(self):
        light = ("--emit", "floor=3")
        B = numpy.load(self.solve("a.npy", *light)).astype("f8")
        figures = "floor=mean,sum,min,max,uniformity,variance"
        with open(self.solve("r.json", "--reduce", figures, "--reduce", "wall-x0=mean", *light), encoding="utf-8") as f:
            groups = json.load(f)["groups"]
        with h5py.File(self.store) as file:
            names = [name.decode() for name in file["mesh/group_names"][:]]
            inside, A = file["mesh/group"][:] == names.index("floor"), file["mesh/area"][:]
        x, a = B[inside], A[inside]
        mean = (a * x).sum() / a.sum()
        for name, value in (("mean", mean), ("sum", (a * x).sum()), ("min", x.min()), ("max", x.max()),
                            ("uniformity", x.min() / mean), ("variance", (a * (x - mean) ** 2).sum() / a.sum())):
            self.assertAlmostEqual(groups["floor"][name], value, delta=1e-6 * abs(value), msg=name)
        self.assertEqual(set(groups["wall-x0"]), {"mean"})
        with open(self.solve("r.csv", "--reduce", figures, *light), newline="", encoding="utf-8") as file:
            rows = {row["statistic"]: float(row["radiosity [W/m2]"]) for row in csv.DictReader(file)}
        self.assertAlmostEqual(rows["mean"], mean, delta=1e-6 * mean)
        self.refused(1, "no group", "solve", self.store, "--reduce", "lava=mean", *light)
        table = must("solve", self.store, *light).stdout
        line = next(line for line in table.splitlines() if line.startswith("floor"))
        self.assertAlmostEqual(float(line.split()[3]), mean, delta=1e-4 * mean)

    def test_own_light_in_colour(self):
        scene, store = self.path("cornell.obj"), self.path("cornell.h5")
        must("generate", "cornell", "--elements", 200, "-o", scene)
        must("precompute", scene, "-o", store, "--method", "low-rank", "--rays", 256, "--probes", 4, "--quiet")
        done = must("solve", store, "-o", self.path("a.npy"))
        self.assertIn("the scene's own light", done.stderr)
        with h5py.File(store) as file:
            n, E = file["mesh/area"].shape[0], file["mesh/emission"][:]
        B = numpy.load(self.path("a.npy"))
        self.assertEqual(B.shape, (3, n))
        numpy.save(self.path("e.npy"), E)
        must("solve", store, "--emission", self.path("e.npy"), "-o", self.path("b.npy"))
        numpy.testing.assert_array_equal(numpy.load(self.path("b.npy")), B)
        lamp = E[:, E[0].argmax()]
        must("solve", store, "--emit", "lamp=" + ",".join(repr(float(e)) for e in lamp), "-o", self.path("c.npy"))
        numpy.testing.assert_array_equal(numpy.load(self.path("c.npy")), B)
        with open(self.path("c.json"), "w", encoding="utf-8") as file:
            json.dump({"emissions": [E.tolist(), {"groups": {"lamp": [1, 0, 0]}}]}, file)
        must("solve", store, "--emission", self.path("c.json"), "-o", self.path("d.npy"))
        batch = numpy.load(self.path("d.npy"))
        self.assertEqual(batch.shape, (2, 3, n))
        numpy.testing.assert_array_equal(batch[0], B)
        self.assertEqual((abs(batch[1, 1:]).max(), batch[1, 0].max() > 0), (0, True))
        must("solve", store, "-o", self.path("a.csv"))
        with open(self.path("a.csv"), encoding="utf-8") as header:
            self.assertEqual(header.readline(), "element,group,area,radiosity_r [W/m2],radiosity_g [W/m2],radiosity_b [W/m2]\n")


if __name__ == "__main__":
    unittest.main()
