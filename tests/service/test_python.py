"""The Python package over HTTP: what a scene consists of, its light and gradients beside those of plain requests;
and the package as it is distributed."""

import contextlib
import doctest
import importlib
import io
import os
import pkgutil
import shutil
import subprocess
import sys
import tempfile
import threading
import unittest
import unittest.mock

import numpy as np

from lambert_python import PACKAGE, TOKEN, PackageCase, lambert, random_emission
from patience import PATIENCE

try:
    import scipy.sparse.linalg as linalg
except ImportError:
    linalg = None
try:
    import torch
except ImportError:
    torch = None


def modules():
    return sorted(m.name for m in pkgutil.iter_modules(lambert.__path__))


class OverHttp(PackageCase):
    def ask(self, name, route, body):
        answer = self.daemon.post(f"/v1/scenes/{name}/{route}", body, headers={"Authorization": f"Bearer {TOKEN}"})
        self.assertEqual(answer.status, 200, answer)
        return answer.json()

    def test_examples_of_docstrings(self):
        """All of them, with a daemon at `address`; a store and lambertd for those that serve one."""
        from lambert import client

        begin = client.Client.__init__

        def with_token(self, address, token=None, *more):
            begin(self, address, token or TOKEN, *more)

        given = {"lambert": lambert, "np": np, "address": self.address, "store": self.stores["box"]}
        count = 0
        with unittest.mock.patch.object(client.Client, "__init__", with_token):
            for name in modules():
                found = doctest.testmod(importlib.import_module(f"lambert.{name}"), extraglobs=dict(given))
                self.assertEqual(found.failed, 0, name)
                count += found.attempted
        self.assertGreater(count, 50)

    def test_elements_and_groups(self):
        for name in ("box", "office", "yard", "leaves", "merged"):
            scene, mesh = self.scene(name), self.mesh(name)
            self.assertEqual(scene.names, [text.decode() for text in mesh["group_names"]])
            self.assertEqual(list(scene.groups), scene.names)
            np.testing.assert_allclose(scene.areas, mesh["area"], rtol=1e-6)
            np.testing.assert_allclose(scene.normals, mesh["normal"], atol=1e-6)
            np.testing.assert_array_equal(scene.reflectances, np.atleast_2d(mesh["reflectance"]))
            self.assertEqual(scene.centres.shape, (scene.n, 3))
            for g, group in enumerate(scene.groups.values()):
                of = mesh["group"] == g
                np.testing.assert_array_equal(group.indices, np.flatnonzero(of))
                self.assertAlmostEqual(group.area, mesh["area"][of].sum(), delta=1e-6 * group.area)
                self.assertEqual((group.elements, len(group)), (of.sum(), of.sum()))
                for means, values in ((group.reflectance, mesh["reflectance"]), (group.emission, mesh["emission"])):
                    wanted = np.atleast_2d(values)[:, of] @ mesh["area"][of] / mesh["area"][of].sum()
                    np.testing.assert_allclose(means, wanted, rtol=1e-5, atol=1e-9)
            with self.assertRaisesRegex(KeyError, "no group is called lmap; there are"):
                scene.groups["lmap"]
            with self.assertRaises(ValueError):
                scene.areas[0] = 1

    def test_luminaires_sensors_and_sky(self):
        office, yard = self.scene("office"), self.scene("yard")
        self.assertEqual(list(office.luminaires), ["row.0", "row.1", "desk"])
        self.assertEqual((office.luminaires["desk"].dim, office.luminaires["row.1"].group, office.units), (0.5, "row", "lm"))
        self.assertEqual((office.sensors["desks"].at.shape, office.sensors["desks"].rows, office.sky), ((100, 3), 10, None))
        self.assertEqual((yard.sky.tiles, len(yard.sky), yard.luminaires, yard.sensors), (145, 145, {}, {}))
        self.assertAlmostEqual(yard.sky.solid_angle.sum(), 2 * np.pi, places=5)
        with self.assertRaisesRegex(lambert.NotFound, "no luminaire is called dask; there are row.0, row.1, desk"):
            office.luminaires["dask"]

    def test_light_is_that_of_plain_requests(self):
        box, office, yard, few = map(self.scene, ("box", "office", "yard", "few"))
        dense = abs(random_emission(box))
        sky = np.arange(145.0)
        self.assertEqual(self.scene("box").radiosity(dense).dtype, np.float32)
        for scene, emission, sent, more in (
                (box, {"lamp": [17, 12, 4]}, {"groups": {"lamp": [17, 12, 4]}}, {}),
                (box, {"lamp": "3600lm"}, {"groups": {"lamp": "3600lm"}}, {"quantity": "irradiance", "unit": "lx"}),
                (box, dense, dense.tolist(), {}), (box, dense[0], dense[0].tolist(), {}),
                (box, dense, dense.tolist(), {"quantity": "indirect", "limit": False}),
                (box, {"lamp": 1}, {"groups": {"lamp": 1}}, {"at": "faces", "select": {"groups": ["floor", "lamp"]}}),
                (box, {"elements": [3, 5], "values": np.ones(2)}, {"elements": [3, 5], "values": [1, 1]}, {"tolerance": 1e-6}),
                (office, {"luminaires": {"row": 0.4}}, {"luminaires": {"row": 0.4}}, {"quantity": "irradiance", "select": {"sensors": ["desks"]}}),
                (office, {"luminaires": {"desk": 1}, "groups": {"floor": 2}}, {"luminaires": {"desk": 1}, "groups": {"floor": 2}}, {}),
                (yard, {"sky": sky}, {"sky": sky.tolist()}, {"quantity": "irradiance"}),
                (yard, {"sky": sky, "elements": np.ones(yard.n)}, {"sky": sky.tolist(), "elements": list(range(yard.n)), "values": [1] * yard.n}, {}),
                (few, {"luminaires": {"row": 0.4}}, {"luminaires": {"row": 0.4}}, {})):
            with self.subTest(scene=scene.name, more=more):
                plain = self.ask(scene.name, "radiosity", {"emission": sent, **more})
                answer = scene.radiosity(emission, **more)
                wanted = np.array(plain[plain["quantity"]], float)
                np.testing.assert_allclose(answer.values, wanted, rtol=1e-6, atol=1e-30)
                self.assertEqual((answer.unit, answer.limited), (plain["unit"], plain.get("limited")) if "limited" in plain
                                 else (plain["unit"], answer.limited))
                # A batch has the same vectors, whoever else is in it.
                both = scene.radiosity([emission, emission], **more)
                np.testing.assert_array_equal(both.values, np.stack([answer.values] * 2))
                if scene is box and "tolerance" not in more:
                    self.assertEqual(scene.radiosity(emission, stated=True, **more).error["stated"], plain["error"]["stated"])
                if "tolerance" in more:
                    self.assertEqual(answer.dtype, np.float64)
                    self.assertGreater(answer.iterations, 0)
                    self.assertLess(answer.certificate, 1e-4)

    def test_short_forms(self):
        box = self.scene("box")
        B = box.radiosity({"lamp": 17})
        np.testing.assert_array_equal(box.indirect({"lamp": 17}), box.radiosity({"lamp": 17}, quantity="indirect"))
        H = box.irradiance({"lamp": 17}).values
        np.testing.assert_allclose(B[:, box.groups["floor"].indices], (H * box.reflectances)[:, box.groups["floor"].indices], rtol=1e-5)
        self.assertGreater(B.times["solve"], 0)
        self.assertIsInstance(B, lambert.Answer)
        self.assertNotIsInstance(B + 1, lambert.Answer)

    def test_long_batches_are_several_requests(self):
        box = self.scene("box")
        E = abs(random_emission(box, 2, 70))
        found = box.radiosity(E)
        self.assertEqual((found.shape, len(found.limited)), ((70, 3, 400), 2))
        np.testing.assert_array_equal(found[69], box.radiosity(E[69]).values)

    def test_figures(self):
        office, box = self.scene("office"), self.scene("box")
        found = office.reduce({"luminaires": {"row": 1}}, sensors=["desks"], figures=("mean", "min", "uniformity"), at_least=[100, 300])
        values = office.irradiance({"luminaires": {"row": 1}}, select={"sensors": ["desks"]}).values
        self.assertAlmostEqual(found["desks"]["mean"], values.mean(), delta=1e-4 * values.mean())
        self.assertAlmostEqual(found["desks"]["share"][100], (values >= 100).mean())
        self.assertIn("stated", found.error)
        both = box.reduce([{"lamp": 1}, {"lamp": 2}], groups=["floor", "ceiling"], figures="mean")
        self.assertEqual(both["ceiling"]["mean"].shape, (2, 3))
        np.testing.assert_allclose(both["floor"]["mean"][1], 2 * both["floor"]["mean"][0], rtol=1e-6)

    def test_gradients(self):
        box, office, yard = map(self.scene, ("box", "office", "yard"))
        g = random_emission(box)
        np.testing.assert_allclose(box.adjoint(g), self.ask("box", "adjoint", {"cotangent": g.tolist()})["gradient"]["emission"], rtol=2e-6, atol=1e-9)
        self.assertEqual(box.adjoint(g, doubles=True).dtype, np.float64)
        self.assertEqual(box.adjoint([g, g, {"floor": 1}]).shape, (3, 3, 400))
        both = box.adjoint(g, ("groups", "reflectance"), emission={"lamp": 17})
        self.assertEqual({name: array.shape for name, array in both.items()}, {"groups": (3, 8), "reflectance": (3, 400)})
        self.assertEqual(yard.adjoint({"roof*": 1} if "roof.0" in yard.names else {yard.names[0]: 1}, "sky").shape[-1], 145)
        J = office.jacobian({"sensors": "desks"}, by="luminaires")
        np.testing.assert_allclose(office.adjoint({"sensors": {"desks": np.eye(100)[7]}}, "luminaires"), J["luminaires"][7], rtol=1e-4)
        values = office.irradiance({"luminaires": {"row": 0.4, "desk": 1}}, select={"sensors": ["desks"]}, limit=False)
        np.testing.assert_allclose(J["luminaires"] @ [0.4, 0.4, 1], values.values, rtol=1e-4)

    def test_one_request_is_enough(self):
        """A batch of cotangents, and the linear map of what falls below zero, are one request each by arrays alone."""
        box = self.scene("box")
        E, G, asked = random_emission(box), random_emission(box, 5, 9), []
        wanted = [box.adjoint(g, quantity="indirect") for g in G]
        ask = box._source.client.ask

        def counted(request, **more):
            asked.append((request.path, request.kind))
            return ask(request, **more)

        with unittest.mock.patch.object(box._source.client, "ask", counted):
            np.testing.assert_array_equal(box.adjoint(G, quantity="indirect"), wanted)
            linear = box.radiosity(E, quantity="indirect", limit=False)
            mixed = box.adjoint([G[0], {"floor": 1}], ("emission", "groups"))
        self.assertEqual(asked, [("/v1/scenes/box/adjoint?quantity=indirect", "application/x-npy"),
                                 ("/v1/scenes/box/radiosity?quantity=indirect&limit=false", "application/x-npy"), ("/v1/scenes/box/adjoint", "application/json")])
        self.assertLess(linear.min(), 0)
        self.assertIsNone(linear.limited)
        np.testing.assert_array_equal(mixed["groups"][1], box.adjoint({"floor": 1}, "groups"))

    def test_variants(self):
        paint = self.scene("paint")
        red = paint.variant("red", {"floor": [0.6, 0.1, 0.1]})
        try:
            self.assertEqual(red.name, "paint@red")
            self.assertGreater(red.radiosity({"lamp": 1})[0].mean(), red.radiosity({"lamp": 1})[1].mean())
        finally:
            red.delete()
        with self.assertRaises(lambert.NotFound):
            red.radiosity({"lamp": 1})
        with self.assertRaises(lambert.Refused):  # 409: it keeps no factors
            self.scene("waves").variant("red", {"floor": 0.5})

    def test_errors_say_where(self):
        box = self.scene("box")
        with self.assertRaisesRegex(lambert.Refused, "lmap") as caught:
            box.radiosity({"lmap": 1})
        error = caught.exception
        self.assertEqual((error.status, error.kind, error.pointer), (422, "unknown-group", "/emission/groups/lmap"))
        self.assertEqual(error.route, "POST /v1/scenes/box/radiosity")
        for words, wrong in ((r"\[399\], must have \[400\] or \[3, 400\]", lambda: box.radiosity(np.ones(399))),
                             (r"\[2, 3, 399\], must have \[3, 400\]", lambda: box.radiosity(np.ones((2, 3, 399)))),
                             (r"emission 1 of the batch has the shape \[2\]", lambda: box.radiosity([np.ones(400), np.ones(2)])),
                             (r"cotangent has the shape \[4, 400\]", lambda: box.adjoint(np.ones((4, 400)))),
                             ("real numbers", lambda: box.radiosity(np.ones(400) * 1j)),
                             ("quantity 'light' is none of", lambda: box.radiosity({"lamp": 1}, quantity="light")),
                             ("beside lamp", lambda: box.radiosity({"groups": {"lamp": 1}, "lamp": 1})),
                             ("one of the two", lambda: box.reduce({"lamp": 1})), ("empty batch", lambda: box.radiosity([])),
                             ("not finite", lambda: box.radiosity({"lamp": float("nan")})),
                             ("is no address", lambda: lambert.Scene("http:///box")), ("more than a scene", lambda: lambert.Scene("http://h/a/b")),
                             (r"has 11 scenes, so that one is named: box, ", lambda: lambert.Scene(self.address, token=TOKEN))):
            with self.assertRaisesRegex(lambert.Refused, words):
                wrong()
        with self.assertRaisesRegex(lambert.NotFound, "bex"):
            self.scene("bex")
        with self.assertRaises(lambert.Denied):
            lambert.Scene(self.address + "/box")
        with self.assertRaisesRegex(lambert.Disconnected, "127.0.0.1:1: "):
            lambert.Scene("http://127.0.0.1:1/box")

    def test_page(self):
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            page = self.scene("box").show()
        self.assertEqual(printed.getvalue().strip(), page.address)
        with unittest.mock.patch.dict(sys.modules, {"IPython": unittest.mock.Mock()}), contextlib.redirect_stdout(io.StringIO()) as printed:
            self.scene("box").show()
        self.assertEqual(printed.getvalue(), "")
        self.assertIn("<iframe", page._repr_html_())
        self.assertTrue(repr(page).startswith(self.address + "/#1."))

    def test_threads_share_a_scene(self):
        box = self.scene("box")
        wanted, wrong = box.radiosity({"lamp": 1}).values, []

        def ask():
            for _ in range(5):
                wrong.extend([1] * (not np.array_equal(box.radiosity({"lamp": 1}), wanted)))

        threads = [threading.Thread(target=ask) for _ in range(6)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])

    @unittest.skipIf(linalg is None, "SciPy is not installed")
    def test_linear_algebra(self):
        self.assertEqual(len({self.scene(name).about["kind"] for name in ("box", "office", "waves")}), 3)
        for name in ("box", "office", "waves"):
            scene = self.scene(name)
            M = scene @ np.eye(scene.n)[:, None].repeat(scene.channels, 1)  # [n][C][n]: columns of M~ for each channel
            M = M.reshape(scene.n, scene.channels, scene.n)
            A = scene.as_operator()
            dense = np.zeros(A.shape)
            for c in range(scene.channels):
                dense[c * scene.n:(c + 1) * scene.n, c * scene.n:(c + 1) * scene.n] = M[:, c].T
            X = np.random.default_rng(3).normal(size=(A.shape[1], 3))
            np.testing.assert_allclose(A @ X, dense @ X, atol=2e-5)
            np.testing.assert_allclose(A.H @ X, dense.T @ X, atol=2e-5)
            np.testing.assert_allclose(linalg.svds(A, k=2, random_state=1)[1], np.linalg.svd(dense)[1][1::-1], rtol=1e-5)
            x, info = linalg.gmres(A, dense @ X[:, 0], tol=1e-7, atol=0)
            self.assertLess(np.linalg.norm(x - X[:, 0]) / np.linalg.norm(X[:, 0]), 1e-4)

    @unittest.skipIf(torch is None, "PyTorch is not installed")
    def test_torch(self):
        for name in ("box", "office", "waves"):
            scene = self.scene(name)
            light = scene.torch("irradiance")
            generator = torch.Generator().manual_seed(1)
            basis, weights = (torch.rand(k, *scene.shape, dtype=torch.float64, generator=generator) for k in (3, 2))

            def of(c):  # few unknowns, and a batch of two
                E = torch.einsum("bk,k...->b...", c, basis).reshape(2, scene.channels, scene.n)
                return torch.einsum("b...,w...->bw", light(E).reshape(2, *scene.shape), weights)

            c = torch.rand(2, 3, dtype=torch.float64, generator=generator, requires_grad=True)
            # The light is in single precision and linear, so that long steps have the smallest error: 1e-7 times sums of about 1000.
            self.assertTrue(torch.autograd.gradcheck(of, (c,), eps=0.5, atol=2e-3, rtol=1e-4))
            E = torch.ones(scene.n, requires_grad=True)  # alike in all channels
            light(E).sum().backward()
            np.testing.assert_allclose(E.grad.numpy(), scene.adjoint(np.ones(scene.shape), quantity="irradiance").reshape(-1, scene.n).sum(0), rtol=1e-5)

    def test_jax(self):
        """By what the package uses of JAX, where that is not installed: a call of the host, and a function with its own gradient."""
        scene, called = self.scene("box"), []

        class OwnGradient:
            def __init__(self, function):
                self.function = function

            def __call__(self, E):
                return self.function(E)

            def defvjp(self, forward, backward):
                self.forward, self.backward = forward, backward

        def pure_callback(host, result, array):
            found = host(array)
            called.append((found.shape, found.dtype) == (tuple(result.shape), result.dtype))
            return found

        fake = unittest.mock.Mock(pure_callback=pure_callback, custom_vjp=OwnGradient,
                                  ShapeDtypeStruct=lambda shape, dtype: unittest.mock.Mock(shape=shape, dtype=np.dtype(dtype)))
        with unittest.mock.patch.dict(sys.modules, {"jax": fake}):
            light = scene.jax()
            for shape in ((400,), (3, 400), (2, 3, 400)):
                E, g = random_emission(scene, 8).ravel()[0] * np.ones(shape, np.float32), random_emission(scene, 9, *shape[:-2])
                B, kept = light.forward(E)
                np.testing.assert_array_equal(B, scene @ E)
                gradient, = light.backward(kept, np.float32(g))
                self.assertEqual(gradient.shape, shape)
                self.assertAlmostEqual((gradient * E).sum() / (B * g).sum(), 1, places=4)
        self.assertEqual(called, [True] * 6)

    def test_libraries_that_are_not_there(self):
        box = self.scene("box")
        with unittest.mock.patch.dict(sys.modules, {"torch": None, "jax": None, "scipy.sparse.linalg": None}):
            for ask, words in ((box.torch, "PyTorch is not installed"), (box.jax, "JAX is not installed"), (box.as_operator, "SciPy is not installed")):
                with self.assertRaisesRegex(lambert.Unsupported, words):
                    ask()


class Sources(unittest.TestCase):
    """The package as it is distributed."""

    @unittest.skipIf(shutil.which("mypy") is None, "mypy is not installed")
    def test_types(self):
        done = subprocess.run(["mypy", "--strict", "--cache-dir", os.devnull, "lambert"], cwd=PACKAGE, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout)

    def test_wheel_and_sdist(self):
        """Both are built without a network, and the wheel is importable where nothing but NumPy is."""
        with tempfile.TemporaryDirectory() as folder:
            source = os.path.join(folder, "source")
            shutil.copytree(PACKAGE, source, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info", "build"))
            build = "import setuptools.build_meta as b, sys; sys.argv[1:] = []; print(b.build_sdist('..')); print(b.build_wheel('..'))"
            run = lambda *words, **more: subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE, **more)
            done = run("/usr/bin/python3", "-c", build, cwd=source, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            sdist, wheel = (next(os.path.join(folder, name) for name in os.listdir(folder) if name.endswith(end)) for end in (".tar.gz", ".whl"))
            bare = os.path.join(folder, "bare")
            self.assertEqual(run("/usr/bin/python3", "-m", "venv", "--system-site-packages", bare, check=False).returncode, 0)
            for package in (wheel, sdist):
                done = run(os.path.join(bare, "bin", "pip"), "install", "--no-index", "--no-build-isolation", "--no-deps", "--force-reinstall", package, check=False)
                self.assertEqual(done.returncode, 0, done.stderr)
                done = run(os.path.join(bare, "bin", "python"), "-I", "-c", "import lambert, os; print(lambert.__file__, lambert.__version__, "
                           "os.path.exists(os.path.join(os.path.dirname(lambert.__file__), 'py.typed')))", cwd=folder, check=False)
                self.assertEqual(done.stdout.split()[1:], [lambert.__version__, "True"], done.stderr)
                self.assertTrue(done.stdout.startswith(bare))

    def test_version_is_that_of_the_programs(self):
        version = subprocess.run([os.environ["LAMBERT"], "--version"], capture_output=True, text=True, check=True).stdout.split()[1]
        self.assertEqual(lambert.__version__, version)
        self.assertIn(f'version = "{version}"', (PACKAGE / "pyproject.toml").read_text())


if __name__ == "__main__":
    unittest.main()
