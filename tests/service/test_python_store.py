"""Scenes in process, by liblambert and by NumPy alone: the same interface and the same numbers as over HTTP, of all kinds."""

import glob
import os
import pathlib
import shutil
import unittest
import unittest.mock

import numpy as np

from lambert_python import PackageCase, lambert, random_emission

try:
    import scipy.sparse.linalg as linalg
except ImportError:
    linalg = None

LIBRARY = next(iter(sorted(glob.glob(str(pathlib.Path(os.environ["LAMBERT"]).parent / "liblambert.so*")))), None)
# Sums of single precision over n elements in another order: sqrt(400) roundings of 6e-8, of values of about the largest.
SAME = 2e-6


class InProcess(PackageCase):
    def ways(self, name, numpy_too=True):
        """The scene over HTTP, then in process."""
        found = [("library", lambert.Scene(self.stores[name], library=LIBRARY))] if LIBRARY else []
        if numpy_too:
            found.append(("numpy", lambert.Scene(self.stores[name], library=False)))
        return self.scene(name), found

    def same(self, got, wanted, factor=1):
        got, wanted = np.asarray(got, float), np.asarray(wanted, float)
        self.assertEqual(got.shape, wanted.shape, self.which)
        np.testing.assert_array_equal(np.isnan(got), np.isnan(wanted), self.which)
        np.testing.assert_allclose(got, wanted, rtol=0, atol=factor * SAME * max(np.nanmax(abs(wanted), initial=0), 1e-30), err_msg=self.which)

    def each(self, names):
        for name in names:
            remote, ways = self.ways(name, name != "waves")
            for way, scene in ways:
                self.which = f"{name} by {way}"  # failures say it
                yield remote, scene

    def test_what_a_scene_consists_of(self):
        for remote, scene in self.each(self.stores):
            for what in ("name", "n", "channels", "units", "names", "shape"):
                self.assertEqual(getattr(scene, what), getattr(remote, what), what)
            for what in ("areas", "normals", "centres", "reflectances", "faces"):
                np.testing.assert_allclose(getattr(scene, what), getattr(remote, what), rtol=1e-6, atol=1e-6, err_msg=what)
            for one, other in zip(scene.groups.values(), remote.groups.values()):
                self.assertEqual((one.name, one.elements), (other.name, other.elements))
                np.testing.assert_allclose([one.area, *one.reflectance, *one.emission], [other.area, *other.reflectance, *other.emission], rtol=1e-6)
                np.testing.assert_array_equal(one.indices, other.indices)
            self.assertEqual(list(scene.luminaires), list(remote.luminaires))
            for name, one in scene.luminaires.items():
                other = remote.luminaires[name]
                self.assertEqual((one.group, one.dim, one.opening), (other.group, other.dim, other.opening))
                np.testing.assert_allclose([*one.at, *one.aim, *one.c0, *one.colour], [*other.at, *other.aim, *other.c0, *other.colour], atol=1e-9)
            for name, one in scene.sensors.items():
                other = remote.sensors[name]
                for what in ("kind", "weight", "count", "rows", "columns", "in_walls"):
                    self.assertEqual(getattr(one, what), getattr(other, what), what)
                np.testing.assert_allclose(one.at, other.at)
                np.testing.assert_allclose(one.axis, other.axis)
            if remote.sky is not None:
                np.testing.assert_allclose(scene.sky.centre, remote.sky.centre, atol=1e-6)
                np.testing.assert_allclose(scene.sky.cosine, remote.sky.cosine, rtol=1e-6)
                self.assertEqual([*scene.sky.north, scene.sky.up], [*remote.sky.north, remote.sky.up])
            else:
                self.assertIsNone(scene.sky)

    def test_light_of_elements(self):
        for remote, scene in self.each(("box", "paint", "coarse", "thin", "waves", "office", "yard", "leaves", "merged")):
            E = random_emission(remote, 1, 3)
            for quantity in ("radiosity", "irradiance", "indirect"):
                self.same(scene.radiosity(E, quantity=quantity, limit=False), remote.radiosity(E, quantity=quantity, limit=False))
                one = abs(E[0]) * (np.arange(remote.n) < 3)  # little light far away, which is limited
                wanted, found = (s.radiosity(one, quantity=quantity, stated=False) for s in (remote, scene))
                self.same(found, wanted)
                self.assertEqual((found.unit, found.dtype), (wanted.unit, wanted.dtype))
                self.same(scene.adjoint(E[0], quantity=quantity), remote.adjoint(E[0], quantity=quantity))
            name = remote.names[0]
            given = {name: 2 if remote.channels == 1 else [1, 2, 3]}
            for more in ({}, {"select": {"groups": [name]}}, {"select": {"elements": [5, 3, 5]}}, {"at": "faces"},
                         {"at": "faces", "select": {"groups": [name, remote.names[1]]}}, {"quantity": "irradiance", "unit": "lx"},
                         {"unit": "W/m2"}, {"unit": "fc"}, {"select": {"faces": [1, 0]}}):
                wanted, found = (s.radiosity(given, **more) for s in (remote, scene))
                self.same(found, wanted)
                self.assertEqual(found.unit, wanted.unit)

    def test_limited_light_is_counted_alike(self):
        count = 0
        for remote, scene in self.each(("paint", "coarse", "thin", "waves", "office")):
            E = np.zeros((4, *remote.shape))
            E[..., :4] = np.eye(4).reshape(4, *[1] * (len(remote.shape) - 1), 4)
            wanted, found = remote.radiosity(list(E), select={"elements": list(range(remote.n))}), scene.radiosity(list(E))
            # A value next to zero may have either sign.
            np.testing.assert_allclose(found.limited, wanted.limited, atol=3)
            self.same(found, wanted)
            count += sum(wanted.limited)
        self.assertGreater(count, 50)

    def test_light_of_sky_luminaires_and_emitters(self):
        for remote, scene in self.each(("office", "yard", "few", "dome", "leaves")):
            skies = [{"sky": np.arange(24.0).reshape(3, 8)}, {"emitters": np.ones(8)}]
            given = {"dome": skies, "leaves": [{"sky": np.arange(145.0)}],
                     "office": [{"luminaires": {"row": 0.4, "desk": 1}}, {"luminaires": {"row.0": 1}, "groups": {"floor": "300lm"}},
                                {"luminaires": {"ro*": 1}}],
                     "yard": [{"sky": np.arange(145.0)}, {"sky": np.ones((remote.channels, 145)), "groups": {remote.names[0]: 5}}],
                     "few": [{"luminaires": {"row": 0.4}}, {"emitters": {"ceiling": 3}, "luminaires": {"desk": 2}}, {"ceiling": 3},
                             {"emitters": np.ones(len(remote.about["emitters"] or [1]))}]}[remote.name]
            for quantity in ("radiosity", "irradiance", "indirect"):
                for emission in [*given, given]:
                    for limit in (True, False):
                        wanted, found = (s.radiosity(emission, quantity=quantity, limit=limit) for s in (remote, scene))
                        self.same(found, wanted)
                        self.assertEqual(found.unit, wanted.unit)
            if remote.name == "yard":
                for photometric in (True, False):
                    wanted, found = (s.irradiance(given[1], photometric=photometric) for s in (remote, scene))
                    self.same(found, wanted)
                    self.assertEqual(found.unit, wanted.unit)

    def test_sensors_and_figures(self):
        for remote, scene in self.each(("office",)):
            given = [{"luminaires": {"row": 0.4, "desk": 1}}, {"floor": 100}]
            self.same(scene.irradiance(given, select={"sensors": ["desks"]}), remote.irradiance(given, select={"sensors": ["desks"]}), 5)
            for emission in (given, given[0]):
                for over in ({"sensors": ["desks"]}, {"groups": ["floor", "wall*"]}):
                    words = ["mean", "min", "max", "uniformity", "variance"] + ["sum"] * ("groups" in over)
                    wanted, found = (s.reduce(emission, figures=words, at_least=[50, 100], **over) for s in (remote, scene))
                    self.assertEqual((found.keys(), found.unit), (wanted.keys(), wanted.unit))
                    for name, figures in wanted.items():
                        self.assertEqual(found[name].keys(), figures.keys())
                        for figure, value in figures.items():
                            if figure == "share":
                                self.assertEqual(found[name][figure].keys(), value.keys())
                                value, got = [*value.values()], [*found[name][figure].values()]
                            else:
                                got = found[name][figure]
                            np.testing.assert_allclose(got, value, rtol=2e-5, err_msg=figure)
        for remote, scene in self.each(("box", "thin")):
            wanted, found = (s.reduce({"lamp": 17}, groups=["floor"], figures=("mean", "min"), unit="lx") for s in (remote, scene))
            for figure in wanted["floor"]:
                self.assertAlmostEqual(found["floor"][figure] / wanted["floor"][figure], 1, places=5)

    def test_gradients(self):
        for remote, scene in self.each(("box", "paint", "office", "yard", "few", "dome", "leaves", "waves")):
            names = {"dome": ("emitters",), "leaves": ("emission", "sky", "groups"), "yard": ("emission", "sky", "groups"),
                     "office": ("emission", "groups", "luminaires", "reflectance"),
                     "few": ("emitters", "luminaires")}.get(remote.name, ("emission", "groups", "reflectance"))
            light = {"luminaires": {"row": 1}} if remote.name == "office" else {remote.names[0]: 1}
            for quantity in ("radiosity", "irradiance", "indirect"):
                g = random_emission(remote, 4)
                more = {"emission": light} if "reflectance" in names else {}
                if "reflectance" in names and remote.about["kind"] in ("sparse", "hierarchical", "exact"):
                    names = tuple(name for name in names if name != "reflectance") if remote.about["kind"] != "exact" else names
                    more = more if "reflectance" in names else {}
                wanted, found = (s.adjoint(g, names, quantity, **more) for s in (remote, scene))
                self.assertEqual(found.keys(), wanted.keys())
                for name in names:
                    self.same(found[name], wanted[name], 5)
            if remote.name == "office":
                for by in ("luminaires", "groups"):
                    J, K = (s.jacobian({"sensors": ["desks"]}, by=by) for s in (remote, scene))
                    self.same(K[by], J[by], 5)
                    self.assertEqual((K.columns[by], K.rows), (J.columns[by], J.rows))
                g = {"sensors": {"desks": np.arange(100.0)}}
                for name in ("emission", "luminaires", "groups"):
                    self.same(scene.adjoint(g, name), remote.adjoint(g, name), 5)

    def test_means_and_their_errors(self):
        """Means by rows, of all forms of light, limited or not, and the errors that are stated of them."""
        count = 0
        for remote, scene in self.each(("box", "paint", "waves", "office", "yard", "few", "dome")):
            some = random_emission(remote, 8)
            given = {"office": [{"luminaires": {"row": 0.4, "desk": 1}}, {"luminaires": {"desk": 1}, "groups": {"floor": 3}}, some],
                     "yard": [{"sky": np.arange(145.0)}, {remote.names[0]: 2}, some], "few": [{"luminaires": {"row": 0.4}}, {"ceiling": 3}],
                     "dome": [{"sky": np.arange(24.0).reshape(3, 8)}, {"emitters": np.ones(8)}]}.get(
                         remote.name, [{remote.names[0]: 1 if remote.channels == 1 else [1, 2, 3]}, {remote.names[0]: -1, remote.names[1]: 3}, some])
            names = remote.names[:2]
            for emission in [*given, given[:2]]:
                for more in ({}, {"quantity": "indirect"}, {"quantity": "radiosity", "limit": False}, {"unit": "lx"}):
                    wanted, found = (s.reduce(emission, groups=names, figures=("sum", "mean"), **more) for s in (remote, scene))
                    self.assertEqual(found.unit, wanted.unit)
                    for name in names:
                        for figure in ("mean", "sum"):
                            # A mean is off by single precision of its largest contribution: of light of either sign that is more than the mean.
                            most = max(np.abs(np.asarray(wanted[other][figure], float)).max() for other in names)
                            np.testing.assert_allclose(found[name][figure], wanted[name][figure], rtol=1e-5, atol=1e-5 * most, err_msg=self.which)
                    # With min the daemon has whole answers, too; of means alone its law takes the light as even over a group.
                    stated = remote.reduce(emission, groups=names, figures=("mean", "min"), **more).error
                    if "library" in self.which and stated.get("light") == "own":
                        for name in names:
                            one, other = stated["groups"][name]["stated"], found.error["groups"][name]["stated"]
                            np.testing.assert_allclose(other or 0, one or 0, rtol=1e-3, err_msg=f"{self.which} {more}")
                            count += 1
                    elif "numpy" in self.which:
                        self.assertIsNone(found.error)
            whole, other = (s.radiosity(given[0], stated=True) for s in (remote, scene))
            if "library" in self.which:
                self.assertAlmostEqual(other.error["stated"] / whole.error["stated"], 1, places=3)
        self.assertTrue(count > 50 or not LIBRARY)

    def test_derivatives(self):
        """Of groups and elements by all that there is; times what the sources give they are the linear answer."""
        for remote, scene in self.each(("box", "waves", "office", "yard", "few")):
            names, elements = remote.names[:2], [0, remote.n - 1, 3]
            for of in ({"groups": names}, {"elements": elements}, {"elements": elements * 60}):
                for quantity in (None, "irradiance"):
                    wanted, found = (s.jacobian(of, None, quantity) for s in (remote, scene))
                    self.assertEqual((set(found), found.rows), (set(wanted), wanted.rows))
                    for kind, matrix in wanted.items():
                        self.assertEqual(found.columns[kind], wanted.columns[kind], kind)
                        self.same(found[kind], matrix, 5)
            again = scene.jacobian({"groups": names}, None, "irradiance")
            kind = next(iter(again))
            np.testing.assert_array_equal(again[kind], scene.jacobian({"groups": names}, kind, "irradiance")[kind])
        scene = lambert.Scene(self.stores["box"], library=LIBRARY or False)
        for words, wrong in (("sensors, groups or elements", lambda: scene.jacobian({"faces": [1]})), ("no luminaires", lambda: scene.jacobian({"groups": ["floor"]}, "luminaires")),
                             ("no group is called lmap", lambda: scene.jacobian({"groups": ["lmap"]})), ("not from 0 to", lambda: scene.jacobian({"elements": [scene.n]}))):
            with self.assertRaisesRegex(lambert.Refused, words):
                wrong()

    def test_library_refuses_by_name(self):
        """The words of lam_scene and lam_rows for questions that the package would not ask."""
        if not LIBRARY:
            self.skipTest("this build has no shared library")
        op = lambert.Scene(self.stores["box"], library=LIBRARY)._source.op
        few = lambert.Scene(self.stores["few"], library=LIBRARY)._source.op
        E, values = np.ones((3, op.n)), np.ones((3, op.n))
        for words, wrong in (('the store has no group "flor"; did you mean "floor"', lambda: op.rows("radiosity", ("flor",))),
                             (r"elements\[1\] = 400, must be below 400", lambda: op.jacobian("radiosity", np.array([0, 400]), "groups")),
                             ("has a sky, the store has none", lambda: op.rows("radiosity", ("floor",)).means([{"L": np.ones((3, 145))}])),
                             ("the store has no luminaires", lambda: op.stated("radiosity", {"E": E, "D": np.ones((3, 1))}, values, ())),
                             ("weights, the store answers any emission", lambda: op.stated("radiosity", {"W": E}, values, ())),
                             (r"groups\[0\] = 8, must be below 8", lambda: op.rows("radiosity", ("floor",)).means([{"groups": np.array([8]), "exitances": np.ones((1, 3))}])),
                             (r"groups\[1\] = 99", lambda: op.stated("radiosity", {"E": E}, values, (0, 99))),
                             ("give its weights", lambda: few.rows("radiosity", ("floor",)).means([{"E": np.ones((few.channels, few.n))}]))):
            with self.assertRaisesRegex(lambert.Refused, words):
                wrong()
        self.assertEqual(op.rows("radiosity", ()).means([{}]).shape, (1, 0, 3))
        dark = op.rows("radiosity", ("floor",)).means([{}, {"E": E}])
        self.assertEqual(dark[0].max(), 0)
        self.assertGreater(dark[1].min(), 0)
        self.assertEqual(op.stated("radiosity", {}, 0 * values, (0,))["stated"], 0)  # of no light nothing is off

    def test_older_library(self):
        """One without lam_scene: the same numbers by whole answers."""
        if not LIBRARY:
            self.skipTest("this build has no shared library")
        from lambert import library

        with unittest.mock.patch.dict(library.SCENE_FUNCTIONS, {"lam_scene_of_the_future": (None, [])}):
            old = lambert.Scene(self.stores["office"], library=LIBRARY)
        self.assertIsNone(old._source.op.scene)
        new, light = lambert.Scene(self.stores["office"], library=LIBRARY), {"luminaires": {"row": 1}}
        self.which = "older"
        wanted, found = (s.reduce(light, groups=["floor"]) for s in (new, old))
        self.assertAlmostEqual(found["floor"]["mean"] / wanted["floor"]["mean"], 1, places=5)
        self.assertIsNone(found.error)
        for of in ({"groups": ["floor"]}, {"elements": [1, 5]}):
            self.same(old.jacobian(of, "luminaires")["luminaires"], new.jacobian(of, "luminaires")["luminaires"], 5)

    def test_variants(self):
        for remote, scene in self.each(("paint",)):
            red, other = (s.variant("red", {"floor": [0.6, 0.1, 0.1], "back*": 0.3}) for s in (remote, scene))
            try:
                self.assertEqual(other.name, red.name)
                self.same(other.radiosity({"lamp": 5}), red.radiosity({"lamp": 5}), 5)
                self.assertFalse(np.array_equal(other.radiosity({"lamp": 5}), scene.radiosity({"lamp": 5})))
            finally:
                red.delete()
        for _, scene in self.each(("box",)):
            with self.assertRaisesRegex(lambert.Refused, "--keep-factors"):
                scene.variant("red", {"floor": 0.5})

    def test_tolerance(self):
        if not LIBRARY:
            self.skipTest("this build has no shared library")
        for remote, scene in self.each(("box",)):
            try:
                found = scene.radiosity({"lamp": 17}, tolerance=1e-7)
            except lambert.Unsupported as why:
                self.assertIn("liblambert", str(why))
                continue
            wanted = remote.radiosity({"lamp": 17}, tolerance=1e-7)
            self.assertEqual((found.dtype, found.shape), (np.float64, wanted.shape))
            np.testing.assert_allclose(found, wanted, atol=found.certificate + wanted.certificate)

    def test_words(self):
        for _, scene in self.each(("box", "office")):
            for words, wrong in (("no group is called lmap; there are", lambda: scene.radiosity({"lmap": 1})),
                                 (r"shape \[2\], must have", lambda: scene.radiosity(np.ones(2))),
                                 ("not from 0 to", lambda: scene.radiosity({"elements": [scene.n], "values": [1]})),
                                 ("twice", lambda: scene.radiosity({"elements": [1, 1], "values": [1, 1]})),
                                 ("no sky", lambda: scene.radiosity({"sky": np.ones(145)})), ("3lux", lambda: scene.radiosity({scene.names[0]: "3lux"})),
                                 ("not finite", lambda: scene.radiosity(np.full(scene.n, np.nan))), ("a store stays", scene.delete)):
                with self.assertRaisesRegex(lambert.Refused, words):
                    wrong()
            for asked in (lambda: scene.skies("overcast"), scene.weather,
                          lambda: scene.radiosity({"sun": {"azimuth": 1, "altitude": 2, "direct": 3}}),
                          lambda: scene.reduce({scene.names[0]: 1}, groups=scene.names[0], figures="ugr")):
                with self.assertRaisesRegex(lambert.Unsupported, "needs a daemon"):
                    asked()
            with self.assertRaises(lambert.NotFound):
                scene.show()
        with self.assertRaisesRegex(lambert.Unsupported, "hierarchical needs liblambert"):
            lambert.Scene(self.stores["waves"], library=False)
        with self.assertRaisesRegex(lambert.NotFound, "no such store"):
            lambert.Scene("gone.h5")
        wrong = os.path.join(self.shared.name, "wrong.h5")
        shutil.copy(os.path.join(self.shared.name, "box.obj"), wrong)
        with self.assertRaisesRegex(lambert.Refused, "is no store"):
            lambert.Scene(wrong)
        with self.assertRaises(lambert.Unsupported):
            lambert.Scene(self.stores["box"], library=wrong)
        with unittest.mock.patch.dict("sys.modules", {"h5py": None}), self.assertRaisesRegex(lambert.Unsupported, "h5py, which is not installed"):
            lambert.Scene(self.stores["box"])

    @unittest.skipIf(linalg is None, "SciPy is not installed")
    def test_linear_algebra_is_the_same(self):
        """Singular values, solutions and finite differences of three kinds of operators: within 1e-5 of each other."""
        for remote, scene in self.each(("box", "office", "waves")):
            found = []
            for s in (remote, scene):
                A = s.as_operator()
                b = np.random.default_rng(5).normal(size=A.shape[0])
                x, info = linalg.gmres(A, b, tol=1e-6, atol=0)
                self.assertEqual(info, 0)
                E, step = random_emission(s, 6), random_emission(s, 7)
                difference = ((s @ (E + step)) ** 2).sum() - ((s @ (E - step)) ** 2).sum()
                gradient = (s.H @ (2 * (s @ E)) * step).sum()
                self.assertLess(abs(difference / 2 / gradient - 1), 1e-4)  # of a square, whose third derivatives are 0
                found.append((linalg.svds(A, k=3, random_state=1)[1], x, gradient))
            for one, other in zip(*found):
                np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-5 * np.abs(one).max())


if __name__ == "__main__":
    unittest.main()
