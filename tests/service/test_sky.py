"""A sky from end to end: what `precompute --sky` stores, and what `solve`, `render` and the daemon make of it.

Answers are compared with a dense solution in double of what h5py reads from the store alone.
"""

import json
import pathlib
import tempfile
import unittest

import h5py
import numpy as np

from command import lambert as run
from daemon import Daemon
from make_store import add_checksums
from yard import Truth, write_yard


class Sky(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.rng = np.random.default_rng(5)
        cls.stores, cls.truth = {}, {}
        for name, floor, options in (
            ("exact", "0.5 0.5 0.5", ["--method", "exact", "--sky", "tregenza", "--ground-albedo", ".3"]),
            ("colour", "0.7 0.4 0.2", ["--method", "low-rank", "--rank", "150", "--sky", "grid:12x11"]),
            ("folded", "0.5 0.5 0.5", ["--method", "low-rank", "--rank", "150", "--sky", "reinhart:2"]),
        ):
            cls.scene = write_yard(cls.folder, floor)
            path = cls.folder / (name + ".h5")
            done = run("precompute", cls.scene, "-o", path, "--elements", 150, "--rays", 1024, "--probes", 4,
                       "--keep-form-factors", *options)
            assert done.returncode == 0, done.stderr
            cls.stores[name], cls.truth[name] = path, Truth(path)
        cls.plain = cls.folder / "plain.h5"
        done = run("precompute", cls.scene, "-o", cls.plain, "--probes", 0, "--rays", 64)
        assert done.returncode == 0, done.stderr

    def test_closure(self):
        """A box with a hole of a thousandth of its area is open, unless the user says otherwise."""
        scene = self.folder / "hole.obj"
        low, high = 0.5 - 0.0387, 0.5 + 0.0387
        points = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
        points += [(low, low, 1), (high, low, 1), (high, high, 1), (low, high, 1)]
        faces = ["1 2 4 3", "1 3 7 5", "2 6 8 4", "1 5 6 2", "3 4 8 7", "5 9 10 6", "6 10 11 8", "8 11 12 7", "7 12 9 5"]
        scene.write_text("".join("v %g %g %g\n" % p for p in points) + "".join("f %s\n" % f for f in faces))
        power = {}
        for closed, says in (([], "the scene is open: .* wider than 0.0022 m; --closed overrules that"),
                             (["--closed"], "the scene is closed: as --closed says"),
                             (["--closed=no"], "the scene is open: as --closed=no says")):
            store = self.folder / "hole.h5"
            done = run("precompute", scene, "-o", store, "--elements", 150, "--sky", "tregenza", "--ground-albedo", 1,
                       "--reflectance", 0.5, "--probes", 0, "--keep-form-factors", *closed)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertRegex(done.stderr, says)
            with h5py.File(store) as f:
                for group in ("form_factors", "operator"):
                    kept = f[group].attrs.get("closure", b"").decode()
                    self.assertEqual(kept, {"--closed": "closed", "--closed=no": "open"}.get("".join(closed), ""))
                power[tuple(closed)] = f["mesh/area"][:] @ f["sky/first_bounce"][:].sum(0) / np.pi
        area = (high - low) ** 2
        self.assertAlmostEqual(power[()], area, delta=0.02 * area)
        self.assertEqual(power[("--closed",)], 0)
        self.assertEqual(power[("--closed=no",)], power[()])
        done = run("precompute", self.folder / "hole.h5", "-o", self.folder / "again.h5", "--closed")
        self.assertEqual(done.returncode, 2, done.stderr)

    def test_portal(self):
        """A window whose rim is no loop of the mesh: its panes say where rays are aimed, and are no elements."""
        scene, panes = self.folder / "panes.obj", self.folder / "panes"
        points = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
        faces = ["1 2 4 3", "1 3 7 5", "2 6 8 4", "1 5 6 2", "3 4 8 7"]
        low, high = 0.45, 0.55
        roof = [(0, 0, 1, low), (0, high, 1, 1), (0, low, low, high), (high, low, 1, high)]
        text = "".join("v %g %g %g\n" % p for p in points) + "o box\n" + "".join("f %s\n" % f for f in faces)
        count = len(points)
        for name, (x, y, u, w), z in [("roof", r, 1) for r in roof] + [("pane.1", (low, low, 0.5, high), 1),
                                                                      ("pane.2", (0.5, low, high, high), 1)]:
            text += f"o {name}\n" + "".join(f"v {a} {b} {z}\n" for a, b in ((x, y), (x, w), (u, w), (u, y)))
            text += "f %d %d %d %d\n" % tuple(range(count + 1, count + 5))
            count += 4
        scene.write_text(text)
        options = ["--elements", 200, "--sky", "tregenza", "--rays", 1024, "--probes", 0, "--reflectance", 0.5]
        done = run("precompute", scene, "-o", panes, *options, "--portal", "pane.1", "--portal", "pane.2")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, "2 faces of portals, which are no elements")
        self.assertRegex(done.stderr, "rays are aimed at 2 openings")
        with h5py.File(panes) as f:
            self.assertEqual([name.decode() for name in f["mesh/group_names"][:]], ["box", "roof"])
            power = f["mesh/area"][:] @ f["sky/first_bounce"][:].sum(0) / np.pi
        self.assertAlmostEqual(power, 0.01, delta=0.0002)
        for group, says in (("glass", 'the scene has no group "glass"'), ("box", "do not lie in one plane")):
            done = run("precompute", scene, "-o", panes, *options, "--portal", group)
            self.assertEqual(done.returncode, 1)
            self.assertIn(says, done.stderr)

    def npy(self, name, values):
        path = self.folder / name
        np.save(path, np.asarray(values))
        return path

    def close(self, got, wanted, what):
        """Operators of full rank: single precision, over some hundred terms."""
        np.testing.assert_allclose(got, wanted, atol=2e-5 * np.abs(wanted).max(), err_msg=str(what))

    def test_store(self):
        for name, tiling, count, albedo in (("exact", "tregenza", 145, 0.3), ("colour", "grid:12x11", 132, 0.0),
                                            ("folded", "reinhart:2", 577, 0.0)):
            t = self.truth[name]
            self.assertEqual(t.attributes, {"tiling": tiling, "ground_albedo": albedo, "up": "z"})
            self.assertEqual((t.tiles.shape, t.first_bounce.shape), ((count, 9), (count, t.n)))
            self.assertAlmostEqual(t.tiles[:, 7].sum(), 2 * np.pi, delta=1e-12)
            self.assertAlmostEqual(t.tiles[:, 8].sum(), np.pi, delta=1e-12)
            altitude, azimuth = t.tiles[:, 3:5], t.tiles[:, 5:7]
            np.testing.assert_allclose(np.diff(azimuth)[:, 0] * np.diff(np.sin(altitude))[:, 0], t.tiles[:, 7],
                                       atol=1e-14)
            middle, towards = altitude.mean(axis=1), azimuth.mean(axis=1)
            middle[np.isclose(np.diff(azimuth)[:, 0], 2 * np.pi)] = np.pi / 2
            np.testing.assert_allclose(t.tiles[:, 0], np.sin(towards) * np.cos(middle), atol=1e-14)
            np.testing.assert_allclose(t.tiles[:, 1], np.cos(towards) * np.cos(middle), atol=1e-14)
            # The incoming light is the part that rows leave outside; the yard shows nobody a back face but its lamp and walls.
            outside = 1 - t.F.sum(axis=1)
            self.assertTrue((t.first_bounce.sum(axis=0) / np.pi <= outside + 1e-6).all())
            self.assertGreater(t.first_bounce.sum(), 0)

    def test_walls_and_directions(self):
        t = self.truth["colour"]  # no ground
        south = t.group == t.groups.index("south")  # looks north
        H0 = t.first_bounce[:, south].mean(axis=1)
        self.assertEqual(H0[t.tiles[:, 1] < -0.5].sum(), 0)
        self.assertGreater(H0[t.tiles[:, 1] > 0.5].sum(), 0.2)
        # The wall in the east hides it.
        low_east, low_west = (np.argmax(s * t.tiles[:, 0]) for s in (1, -1))
        floor = t.group == t.groups.index("floor")
        self.assertLess(t.first_bounce[low_east, floor].mean(), 0.5 * t.first_bounce[low_west, floor].mean())

    def test_information(self):
        about = json.loads(run("info", self.stores["exact"], "--json").stdout)
        self.assertEqual(about["sky"], {"tiling": "tregenza", "tiles": 145, "ground_albedo": 0.3})
        self.assertIsNone(json.loads(run("info", self.plain, "--json").stdout)["sky"])
        self.assertRegex(run("info", self.stores["folded"]).stdout, r"(?m)^sky +reinhart:2, 577 tiles, ground albedo 0$")
        self.assertNotIn("sky", run("info", self.plain).stdout.replace("--sky", ""))

    def test_verify(self):
        for path in self.stores.values():
            done = run("verify", path, "--probes", 0)
            self.assertEqual(done.returncode, 0, done.stdout)
            self.assertRegex(done.stdout, r"(?m)^ok +sky ")
        self.assertRegex(run("verify", self.plain, "--probes", 0).stdout, r"(?m)^skipped +sky ")
        bright = self.folder / "bright.h5"
        bright.write_bytes(self.stores["exact"].read_bytes())
        with h5py.File(bright, "r+") as f:
            f["sky/first_bounce"][7, 3] = 4
            add_checksums(f)
        done = run("verify", bright, "--probes", 0)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stdout, r"(?m)^BROKEN +sky +element 3 receives")

    def test_store_keeps_its_sky(self):
        again = self.folder / "again.h5"
        done = run("precompute", self.stores["exact"], "-o", again, "--method", "low-rank", "--rank", 20, "--probes", 0)
        self.assertEqual(done.returncode, 0, done.stderr)
        with h5py.File(again) as new, h5py.File(self.stores["exact"]) as old:
            for name in "tiles", "first_bounce":
                self.assertEqual(new["sky"][name][()].tobytes(), old["sky"][name][()].tobytes())
            self.assertEqual(dict(new["sky"].attrs), dict(old["sky"].attrs))
        for option in (["--sky", "tregenza"], ["--sky", "none"], ["--ground-albedo", ".3"]):
            done = run("precompute", self.stores["exact"], "-o", again, *option)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1))
            self.assertIn("keeps the sky it has", done.stderr)

    def test_options(self):
        for option, wanted in ((["--sky", "dome"], "must be none, tregenza"), (["--sky", "reinhart:0"], "from 1 to 16"),
                               (["--sky", "reinhart:17"], "from 1 to 16"), (["--sky", "grid:12"], "grid:AxB"),
                               (["--sky", "grid:361x2"], "from 1 to 360"), (["--sky", "tregenza "], "must be"),
                               (["--ground-albedo", "1.1"], "--ground-albedo"), (["--ground-albedo", "-1"], "albedo")):
            done = run("precompute", self.scene, "-o", self.folder / "none.h5", *option)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), (option, done.stderr))
            self.assertIn(wanted, done.stderr)
        done = run("precompute", self.scene, "-o", self.folder / "none.h5", "--sky", "none", "--ground-albedo", ".2",
                   "--rays", 64, "--probes", 0)
        self.assertEqual(done.returncode, 0)
        self.assertIn("does not use --ground-albedo", done.stderr)
        # 36,865 tiles of 500,000 elements are 74 GB.
        done = run("precompute", self.scene, "-o", self.folder / "none.h5", "--sky", "reinhart:16", "--elements", 500000,
                   "--rays", 256, "--probes", 0, "--rank", 1, "--memory", "40G")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertRegex(done.stderr, r"36865 sky tiles need .* fits: a --sky of at most \d+ tiles, or --memory")

    def test_closed(self):
        self.assertEqual(run("generate", "box", "-o", self.folder / "box.obj").returncode, 0)
        done = run("precompute", self.folder / "box.obj", "-o", self.folder / "box.h5", "--sky", "tregenza", "--rays",
                   64, "--probes", 0)
        self.assertEqual(done.returncode, 0)
        self.assertIn("no element sees the sky; --portal GROUP takes away faces that stand in a window", done.stderr)

    def test_other_ways_to_form_factors(self):
        for options in (["--form-factors", "hemicube", "--resolution", 64], ["--quality", "high"]):
            path = self.folder / "way.h5"
            done = run("precompute", self.scene, "-o", path, "--elements", 60, "--probes", 0, "--keep-form-factors",
                       "--sky", "tregenza", "--ground-albedo", "1", *options)
            self.assertEqual(done.returncode, 0, done.stderr)
            t = Truth(path)
            outside = 1 - t.F.sum(axis=1)
            self.assertTrue((t.first_bounce.sum(axis=0) / np.pi <= outside + 1e-6).all(), options)
            # The part of the outside that is no back face is sky or ground; of floor and walls at least this much.
            self.assertGreater((t.area * t.first_bounce.sum(axis=0)).sum(), 0.5 * np.pi * (t.area * outside).sum())
            with h5py.File(path) as f:
                if options[0] == "--quality":  # the sky needs more rays than the pairs do
                    self.assertEqual(f["form_factors"].attrs["rays"], 65536)

    def test_solve(self):
        for name, path in self.stores.items():
            t = self.truth[name]
            m = len(t.tiles)
            L = self.rng.random((t.C, m)) * 10
            sky = self.npy("sky.npy", (L if t.C > 1 else L[0]).astype("<f4"))
            L = np.load(sky).astype(float).reshape(t.C, m)
            out = self.folder / "out.npy"
            for quantity in "radiosity", "irradiance", "indirect":
                for light, E in (([], t.lamp(0)), (["--emit", "lamp=3"], t.lamp(3))):
                    done = run("solve", path, "--sky", sky, *light, "--quantity", quantity, "-o", out)
                    self.assertEqual(done.returncode, 0, done.stderr)
                    got = np.load(out).reshape(t.C, t.n)
                    self.close(got, t.solve(E, L, quantity), (name, quantity, light))
            # Black elements have no radiosity, but irradiance.
            black = t.group == t.groups.index("east")
            self.assertTrue((t.solve(t.lamp(0), L, "irradiance")[:, black] > 0).all())

    def test_solve_other_files(self):
        t = self.truth["exact"]
        skies = self.rng.random((3, 145))
        batch = self.npy("batch.npy", skies)
        out = self.folder / "out.npy"
        done = run("solve", self.stores["exact"], "--sky", batch, "--emit", "lamp=1", "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        for got, L in zip(np.load(out).reshape(3, t.n), skies):
            self.close(got, t.solve(t.lamp(1), L[None], "radiosity")[0], "batch")
        emission = self.npy("emission.npy", np.tile(t.lamp(2), (3, 1)))
        done = run("solve", self.stores["exact"], "--sky", batch, "--emission", emission, "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.close(np.load(out).reshape(3, t.n)[1], t.solve(t.lamp(2), skies[1:2], "radiosity")[0], "emission")
        text = self.folder / "sky.json"
        text.write_text(json.dumps({"emission": {"sky": skies[0].tolist(), "groups": {"lamp": 4}}}))
        done = run("solve", self.stores["exact"], "--emission", text, "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.close(np.load(out), t.solve(t.lamp(4), skies[:1], "radiosity")[0], "json")

    def test_solve_refuses(self):
        good = self.rng.random(145)
        negative, nan = good.copy(), good.copy()
        negative[3], nan[7] = -1, np.nan
        both = self.folder / "both.json"
        both.write_text(json.dumps({"sky": good.tolist()}))
        for wanted, store, *arguments in (
            ("is (144), must be (145)", "exact", "--sky", self.npy("a.npy", good[:-1])),
            ("value 3 is -1", "exact", "--sky", self.npy("b.npy", negative)),
            ("value 7 is NaN", "exact", "--sky", self.npy("c.npy", nan)),
            ("shape", "colour", "--sky", self.npy("d.npy", np.ones((2, 132)))),
            ("No such file", "exact", "--sky", self.folder / "missing.npy"),
            ("a sky of its own", "exact", "--sky", self.npy("e.npy", good), "--emission", both),
            ("has no sky", None, "--sky", self.npy("e.npy", good)),
            ("has no sky; precompute it with --sky", None, "--emission", both),
        ):
            done = run("solve", self.stores[store] if store else self.plain, *arguments, "-o", self.folder / "no.npy")
            self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1), done.stderr)
            self.assertIn(wanted, done.stderr)
            self.assertFalse((self.folder / "no.npy").exists())

    def test_daemon(self):
        for name, path in self.stores.items():
            t = self.truth[name]
            with Daemon(f"{path}:{name}") as daemon:
                about = daemon.get(f"/v1/scenes/{name}").json()["sky"]
                self.assertEqual(about, {"tiling": t.attributes["tiling"], "tiles": len(t.tiles),
                                         "ground_albedo": t.attributes["ground_albedo"]})
                L = self.rng.random((t.C, len(t.tiles)))
                for quantity in "radiosity", "irradiance", "indirect":
                    answer = daemon.radiosity(name, {"emission": {"sky": L.T.tolist(), "groups": {"lamp": 3}},
                                                     "quantity": quantity})
                    self.assertEqual(answer.status, 200, answer)
                    got = np.array(answer.json()[quantity]).reshape(t.C, t.n)
                    self.close(got, t.solve(t.lamp(3), L, quantity), (name, quantity))

    def test_render(self):
        sky = self.npy("render.npy", np.ones(145))
        picture = self.folder / "yard.png"
        done = run("render", self.stores["exact"], "--sky", sky, "-o", picture, "--size", "40x40")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(picture.read_bytes()[1:4], b"PNG")
        done = run("render", self.stores["exact"], "--sky", self.npy("two.npy", np.ones((2, 145))), "-o", picture)
        self.assertEqual(done.returncode, 1)
        self.assertIn("holds 2 emissions", done.stderr)


if __name__ == "__main__":
    unittest.main()
