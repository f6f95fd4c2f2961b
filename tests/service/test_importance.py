"""Stores for receivers and for sources, from the command line: what is read or emitted there is right, what is stated
holds, others are warned of, and what is asked for in vain is refused."""

import json
import os
import re
import unittest

import h5py
import numpy

from case import Case
from command import REFERENCE, SMALL, lambert, must

HOW = "--form-factors", "blocks", "--epsilon", .1, "--trials", 1


class Importance(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.room = os.path.join(cls.shared.name, "room.obj")
        must("generate", "cornell", "--closed", "--elements", 500 if SMALL else 1500, "--reflectance", .5, "-o", cls.room)
        cls.store = os.path.join(cls.shared.name, "some.h5")
        cls.log = must("precompute", cls.room, "-o", cls.store, *HOW, "--receivers", "lamp", "--probes", 8).stderr
        cls.all = os.path.join(cls.shared.name, "all.h5")
        cls.lit = os.path.join(cls.shared.name, "lit.h5")
        cls.log_of_lit = must("precompute", cls.room, "-o", cls.lit, *HOW, "--sources", "lamp", "--probes", 8).stderr
        cls.exact = os.path.join(cls.shared.name, "exact.h5")
        must("precompute", cls.room, "-o", cls.exact, "--form-factors", "rays", "--method", "exact", "--probes", 0, "--quiet",
             program=REFERENCE)
        cls.log_of_all = must("precompute", cls.room, "-o", cls.all, *HOW, "--method", "hierarchical", "--probes", 0).stderr

    @classmethod
    def is_read(cls):
        with h5py.File(cls.store) as file:
            names = [name.decode() if isinstance(name, bytes) else name for name in file["mesh/group_names"][()]]
            return file["mesh/group"][()] == names.index("lamp"), file["mesh/area"][()]

    def solve(self, store, light):
        numpy.save(self.path("e.npy"), light)
        done = must("solve", store, "--emission", self.path("e.npy"), "--quantity", "indirect", "-o", self.path("b.npy"))
        return numpy.load(self.path("b.npy")).astype("f8").reshape(len(light), -1), done.stderr

    def test_what_is_read_errs_as_stated_and_the_operator_is_smaller(self):
        read, area = self.is_read()
        rng = numpy.random.default_rng(2)
        light = rng.random((3, len(area))).astype("f4")
        truth = self.solve(self.exact, light)[0]
        off = {}
        for store in self.store, self.all:
            found = self.solve(store, light)[0]
            off[store] = numpy.sqrt((area * read * (found - truth) ** 2).sum() / (area * read * truth ** 2).sum())
        with h5py.File(self.store) as file:
            stated = file["error/random"].attrs
            # The reference of all pairs is exact to .0002 (accuracy of pairs and rounding).
            self.assertLess(off[self.store], stated["receivers_indirect"] + stated["receivers_noise"] + .0005)
            self.assertGreater(stated["total_indirect_mean"], 0)
            some = file["operator"].attrs["density"]
        with h5py.File(self.all) as file:
            self.assertLess(some, .6 * file["operator"].attrs["density"])
        blocks = [int(re.search(r"\n(\d+) blocks of ", log)[1]) for log in (self.log, self.log_of_all)]
        self.assertLess(blocks[0], .9 * blocks[1])

    def test_light_of_sources_errs_as_stated(self):
        emits, area = self.is_read()
        rng = numpy.random.default_rng(4)
        light = (rng.random((3, len(area))) * emits).astype("f4")
        truth, found = self.solve(self.exact, light)[0], self.solve(self.lit, light)[0]
        off = numpy.sqrt((area * (found - truth) ** 2).sum() / (area * truth ** 2).sum())
        with h5py.File(self.lit) as file:
            stated = file["error/random"].attrs
            self.assertLess(off, stated["total_indirect_mean"] + 3 * stated["reference_noise"] + .0005)
            self.assertGreater(off, .3 * stated["total_indirect_mean"])
            self.assertEqual(list(file["sources/elements"][()]), list(numpy.flatnonzero(emits)))
            self.assertNotIn("importance", file)
            self.assertNotIn("receivers_indirect", stated)
            some = file["operator"].attrs["density"]
        with h5py.File(self.store) as file:
            # S is symmetric: the operator is that of the lamp as a receiver.
            self.assertEqual(some, file["operator"].attrs["density"])
        about = json.loads(must("info", self.lit, "--json").stdout)
        self.assertEqual(about["sources"], {"option": "--sources lamp", "elements": int(emits.sum())})
        self.assertIsNone(about["importance"])
        text = must("info", self.lit).stdout
        self.assertRegex(text, r"\nemit +\d+ elements, by --sources lamp; light that others emit is only roughly right, "
                               r"and no error is stated for it\n")
        self.assertIn("\n  single, lights, random: of emissions of the sources alone\n", text)
        self.assertIn("\nerrors of emissions of the sources alone:\nsingle ", self.log_of_lit)
        for said in must("info", self.all).stdout, must("info", self.store).stdout, self.log:
            self.assertNotIn("sources", said)

    def test_light_of_others_is_warned_of(self):
        warning = "there is light from elsewhere than the sources, which the store was built for"
        with h5py.File(self.lit) as file:
            stated = file["error/lights"].attrs["total_indirect_mean"]
        for light, strange in (("lamp=1",), False), (("floor=1",), True), (("lamp=1", "floor=1e-9"), True), ((), False):
            done = must("solve", self.lit, *(word for item in light for word in ("--emit", item)), "--json")
            self.assertEqual(warning in done.stderr, strange, light)
            error = json.loads(done.stdout)["error"]
            if strange:
                self.assertEqual(set(error), {"stated", "advice", "from"})
                self.assertEqual((error["stated"], error["from"]), (None, "others"))
            else:
                self.assertEqual((error["light"], error["from"]), ("own", "sources"))
                self.assertTrue(.1 * stated < error["indirect_mean"] < 10 * stated, (stated, error))
        self.assertIn("stated error of this answer, emitted by sources, ", must("solve", self.lit).stdout)
        self.assertNotIn("stated error", must("solve", self.lit, "--emit", "floor=1").stdout)

    def test_receivers_and_sources_go_together(self):
        out = self.path("both.h5")
        must("precompute", self.room, "-o", out, *HOW, "--sources", "lamp", "--receivers", "floor", "--probes", 4, "--quiet")
        with h5py.File(out) as file, h5py.File(self.lit) as lit:
            self.assertLess(file["operator"].attrs["density"], .7 * lit["operator"].attrs["density"])
            self.assertGreater(file["error/lights"].attrs["receivers_indirect"], 0)
        done = must("solve", out, "--reduce", "floor=mean", "--json")
        self.assertNotIn("warning", done.stderr)
        error = json.loads(done.stdout)["error"]
        self.assertEqual((error["of"], error["from"]), ("receivers", "sources"))
        self.assertRegex(must("verify", out, "--probes", 4).stdout, r"\nok +error ")

    def test_sensors_as_receivers(self):
        """In six rooms the light at four points of one of them needs half of the coefficients, and errs as much."""
        scene, sensors, stores, values = self.path("rooms.obj"), self.path("s.json"), {}, {}
        must("generate", "rooms", "--elements", 1500 if SMALL else 4000, "-o", scene)
        with open(sensors, "w", encoding="ascii") as file:
            json.dump({"points": [{"name": "desk", "at": [[3, 3, .8], [3.4, 3, .8], [3, 3.5, .8], [3.5, 3.5, .8]], "normal": [0, 0, 1]}]},
                      file)
        for name, options in (("fine", ("--epsilon", .005)), ("all", ()), ("some", ("--receivers", "sensors"))):
            store = stores[name] = self.path(name + ".h5")
            must("precompute", scene, "--mesh", "faces", "-o", store, "--sensors", sensors, "--method", "hierarchical", *HOW, "--probes",
                 8 if name == "some" else 0, *options, "--quiet")
        with h5py.File(stores["some"]) as some, h5py.File(stores["all"]) as every:
            read = some["importance/elements"][()]
            self.assertEqual(some["importance"].attrs["sensors"], 1)
            self.assertEqual(some["importance"].attrs["option"], b"--receivers sensors")
            self.assertLess(some["operator"].attrs["density"], .7 * every["operator"].attrs["density"])
            self.assertGreater(some["error/lights"].attrs["receivers_indirect"], 0)
            # Receivers send nearly all of the light that comes to the points.
            of_read = numpy.isin(some["sensors/indices"][()], read)
            self.assertGreater(some["sensors/weights"][()][of_read].sum(), .95 * some["sensors/weights"][()].sum())
            n = len(some["mesh/area"])
            self.assertLess(len(read), .5 * n)
        rng = numpy.random.default_rng(5)
        light = numpy.zeros((64, n), "f4")
        light[range(64), rng.integers(n, size=64)] = 1
        numpy.save(self.path("e.npy"), light)
        for name, store in stores.items():
            done = must("solve", store, "--emission", self.path("e.npy"), "--sensors", "all", "-o", self.path("v.npy"))
            self.assertNotIn("receivers", done.stderr)
            values[name] = numpy.load(self.path("v.npy")).astype("f8")
        off = {name: numpy.linalg.norm(values[name] - values["fine"]) for name in ("all", "some")}
        self.assertLess(off["some"], 1.5 * off["all"])
        self.assertIn("are no receivers", must("solve", stores["some"]).stderr)
        # Weights are those of these sensors, so that others are refused, and each store says which receivers it has.
        done = lambert("precompute", stores["some"], "--sensors", sensors, "-o", self.path("x.h5"))
        self.assertEqual(done.returncode, 1)
        self.assertIn("was built for the light at the sensors that it has (--receivers)", done.stderr)
        must("precompute", self.store, "--sensors", sensors, "-o", self.path("lamp.h5"))
        self.assertIn("the store was built for other receivers than sensors", must("solve", self.path("lamp.h5"), "--sensors", "all").stderr)
        done = lambert("precompute", self.room, "--receivers", "sensors", "-o", self.path("x.h5"))
        self.assertEqual(done.returncode, 1)
        self.assertIn("--receivers sensors: there are none; give --sensors FILE too", done.stderr)

    def test_the_store_says_what_it_is_for(self):
        read, _ = self.is_read()
        with h5py.File(self.store) as file:
            self.assertEqual(list(file["importance/elements"][()]), list(numpy.flatnonzero(read)))
            self.assertTrue((file["importance/weights"][()] == 1).all())
            for group in "single", "lights", "random":
                self.assertIn("receivers_indirect", file["error"][group].attrs)
        about = json.loads(must("info", self.store, "--json").stdout)
        self.assertEqual(about["importance"], {"option": "--receivers lamp", "elements": int(read.sum())})
        self.assertGreater(about["error"]["lights"]["receivers_indirect"], 0)
        text = must("info", self.store).stdout
        self.assertRegex(text, r"\nread +\d+ elements, by --receivers lamp; the light of others is only roughly right\n")
        self.assertRegex(text, r"\n  lights  receivers ")
        self.assertRegex(self.log, r"\nlights   receivers relative .*, indirect .* \(noise of the reference ")
        self.assertIsNone(json.loads(must("info", self.all, "--json").stdout)["importance"])
        self.assertNotIn("receivers", must("info", self.all).stdout)

    def test_other_light_is_warned_of(self):
        warning = "are no receivers, which the store was built for: their light is only roughly right"
        self.assertIn(warning, must("solve", self.store).stderr)
        self.assertIn(warning, must("solve", self.store, "--reduce", "floor=mean").stderr)
        done = must("solve", self.store, "--reduce", "lamp=mean", "--json")
        self.assertNotIn(warning, done.stderr)
        with h5py.File(self.store) as file:
            stated = file["error/lights"].attrs["receivers_indirect"]
            of_all = file["error/lights"].attrs["total_indirect_mean"]
        error = json.loads(done.stdout)["error"]
        self.assertEqual((error["light"], error["of"]), ("own", "receivers"))
        self.assertEqual(set(error["groups"]), {"lamp"})
        self.assertTrue(.01 * stated < error["groups"]["lamp"]["elements"] < 10 * stated, (stated, error))
        error = json.loads(must("solve", self.store, "--reduce", "lamp=mean", "--reduce", "floor=mean", "--json").stdout)["error"]
        self.assertEqual((set(error["groups"]), error["of"]), ({"lamp", "floor"}, "all"))
        self.assertGreater(error["groups"]["floor"]["elements"], .1 * of_all)
        self.assertIn("stated error of this answer, of the light of receivers, ", must("solve", self.store, "--reduce", "lamp=mean").stdout)
        self.assertNotIn("of the light of", must("solve", self.all).stdout)
        self.assertNotIn(warning, must("solve", self.all).stderr)

    def test_verify_lights_sources_alone(self):
        done = must("verify", self.lit, "--probes", 8, "--walks", 2000)
        self.assertRegex(done.stdout, r"\nok +error ")
        self.assertRegex(done.stdout, r"\nok +energy .* of the light of the sources ")
        self.assertRegex(done.stdout, r"\nok +walks ")
        other = self.path("other.h5")
        with open(self.lit, "rb") as one, open(other, "wb") as two:
            two.write(one.read())
        with h5py.File(other, "r+") as file:
            for end in "mean", "max", "std":
                file["error/random"].attrs[f"total_indirect_{end}"] = 1e-7
        done = lambert("verify", other, "--probes", 8)
        self.assertEqual(done.returncode, 1)
        self.assertIn("random: total indirect error", done.stdout)

    def test_verify_finds_what_is_stated(self):
        self.assertRegex(must("verify", self.store, "--probes", 8).stdout, r"\nok +error ")
        other = self.path("other.h5")
        with open(self.store, "rb") as one, open(other, "wb") as two:
            two.write(one.read())
        with h5py.File(other, "r+") as file:
            file["error/lights"].attrs["receivers_indirect"] = 1e-6
            file["error/lights"].attrs["receivers_noise"] = 1e-7
        done = lambert("verify", other, "--probes", 8)
        self.assertEqual(done.returncode, 1)
        self.assertIn("lights: receivers' indirect error", done.stdout)

    def test_files_give_weights_and_bits_do_not_depend_on_threads(self):
        sums = []
        with open(self.path("w.json"), "w", encoding="ascii") as file:
            json.dump({"groups": {"lamp": 4, "floor": .5}}, file)
        for threads in 1, 3:
            out = self.path(f"w{threads}.h5")
            must("precompute", self.room, "-o", out, *HOW, "--importance", self.path("w.json"), "--probes", 0, "--quiet",
                 threads=threads)
            with h5py.File(out) as file:
                sums.append([file[name][()].tobytes() for name in ("operator/K/0/data", "importance/weights")
                             if name in file] + [file["operator"].attrs["density"]])
                self.assertEqual(sorted(set(file["importance/weights"][()])), [.125, 1])
                self.assertEqual(file["importance"].attrs["option"], f"--importance {self.path('w.json')}".encode())
        self.assertEqual(sums[0], sums[1])

    def test_rows_and_streams_serve_receivers_too(self):
        for name, options in ("pairs", ("--form-factors", "rays")), ("rays", ("--rays", 128)):
            out = self.path(name + ".h5")
            must("precompute", self.room, "-o", out, "--receivers", "lamp", *options, "--epsilon", .1, "--trials", 1,
                 "--probes", 4, "--quiet")
            with h5py.File(out) as file:
                self.assertIn("importance", file)
                self.assertEqual(file["operator"].attrs["method"], b"hierarchical")
                self.assertGreater(file["error/random"].attrs["receivers_indirect"], 0)

    def test_what_is_wrong_is_refused_in_one_line(self):
        out = self.path("no.h5")

        def last_line(status, wanted, *options):
            done = lambert("precompute", self.room, "-o", out, *options)
            self.assertEqual(done.returncode, status, done.stderr)
            said = [line for line in done.stderr.splitlines() if line.startswith("lambert")]
            self.assertEqual(len(said), 1, done.stderr)
            self.assertIn(wanted, said[0])
            self.assertFalse(os.path.exists(out))

        last_line(1, '--receivers: the scene has no group "lmap"; did you mean "lamp"?', "--receivers", "lmap")
        last_line(1, "--receivers", "--receivers", "lamp,")
        last_line(1, '--sources: the scene has no group "lmap"; did you mean "lamp"?', "--sources", "lamp,lmap")
        last_line(1, "--sources", "--sources", "lamp,")
        last_line(2, "--receivers and --importance exclude each other", "--receivers", "lamp", "--importance", "w.json")
        for text, wanted in (('{"groups":{"lmap":1}}', "lmap"), ('{"groups":{"lamp":-1}}', "-1"),
                             ('{"groups":{"lamp":NaN}}', "w.json"), ('{"groups":{"lamp":1e999}}', "w.json"),
                             ('{"groups":{"lamp":0}}', "is 0 everywhere, must be above 0 somewhere"),
                             ('{"emissions":[{"groups":{"lamp":1}},{"groups":{"lamp":2}}]}', "has 2 vectors, must have 1"),
                             ("", "w.json")):
            with open(self.path("w.json"), "w", encoding="ascii") as file:
                file.write(text)
            last_line(1, wanted, "--importance", self.path("w.json"))
        last_line(1, "missing.json", "--importance", self.path("missing.json"))
        last_line(1, "--importance", "--importance", self.room)
        last_line(1, "--keep-form-factors: blocks that are found for receivers serve nothing else", *HOW, "--receivers",
                  "lamp", "--keep-form-factors")
        last_line(1, "--keep-form-factors: blocks that are found for sources serve nothing else", *HOW, "--sources", "lamp",
                  "--keep-form-factors")
        done = must("precompute", self.box, "-o", out, "--method", "exact", "--rays", 64, "--probes", 0, "--sources", "floor")
        self.assertIn("exact does not use --sources", done.stderr)
        with h5py.File(out) as file:
            self.assertNotIn("sources", file)
        os.remove(out)
        done = must("precompute", self.box, "-o", out, "--method", "exact", "--rays", 64, "--probes", 0, "--receivers",
                    "floor")
        self.assertIn("exact does not use --receivers", done.stderr)
        with h5py.File(out) as file:
            self.assertNotIn("importance", file)


if __name__ == "__main__":
    unittest.main()
