"""An installation into an empty prefix: programs, library and examples as a user finds them."""

import json
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

import h5py
import numpy as np

from patience import PATIENCE

BUILD = pathlib.Path(os.environ["LAMBERT"]).parent
EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "deploy" / "examples"


def run(*command, **more):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=PATIENCE, check=False, **more)
    assert done.returncode == 0, (command, done.stdout, done.stderr)
    return done.stdout


class Install(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.root = pathlib.Path(cls.folder.name)
        cls.prefix = cls.root / "prefix"
        run("cmake", "--install", BUILD, "--prefix", cls.prefix)
        cls.pkgconfig = next(cls.prefix.rglob("lambert.pc"))
        cls.libraries = cls.pkgconfig.parents[1]
        lambert = cls.prefix / "bin" / "lambert"
        cls.minor_version = run(lambert, "--version").split()[1].rpartition(".")[0]
        cls.closed, cls.open = cls.root / "closed.h5", cls.root / "open.h5"
        run(lambert, "generate", "box", "--divisions", 5, "-o", cls.root / "closed.obj")
        run(lambert, "precompute", cls.root / "closed.obj", "-o", cls.closed, "--mesh", "faces", "--reflectance", 0.5, "--keep-form-factors")
        run(lambert, "generate", "city", "--elements", 500, "-o", cls.root / "open.obj")
        run(lambert, "precompute", cls.root / "open.obj", "-o", cls.open, "--mesh", "faces", "--sky", "tregenza",
            "--rays", 256)
        np.save(cls.root / "ones.npy", np.ones(150, "f4"))
        run(lambert, "solve", cls.closed, "--emission", cls.root / "ones.npy", "-o", cls.root / "closed.npy")
        skies = np.repeat(np.arange(1, 5, dtype="f4")[:, None], 145, axis=1)
        np.save(cls.root / "skies.npy", skies)
        run(lambert, "solve", cls.open, "--sky", cls.root / "skies.npy", "-o", cls.root / "open.npy")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def flags(self, *options):
        environment = dict(os.environ, PKG_CONFIG_PATH=str(self.pkgconfig.parent))
        return run("pkg-config", *options, "lambert", env=environment).split()

    def compile(self, name, static):
        """The program of an example; static: with liblambert.a in it, other libraries shared."""
        program = self.root / (name + ("-static" if static else "-shared"))
        libraries = self.flags("--libs", *(["--static"] if static else []))
        if static:
            libraries = ["-l:liblambert.a" if word == "-llambert" else word for word in libraries]
        run("cc", "-std=c11", "-Wall", "-Wextra", "-Werror", EXAMPLES / f"{name}.c", *self.flags("--cflags"), *libraries,
            "-o", program)
        needed = run("readelf", "-d", program)
        self.assertEqual(f"liblambert.so.{self.minor_version}" in needed, not static)
        return program

    def numbers(self, name, static, store):
        environment = dict(os.environ, LD_LIBRARY_PATH="" if static else str(self.libraries))
        return np.array([line.split() for line in run(self.compile(name, static), store, env=environment).splitlines()],
                        dtype=float)

    def test_files(self):
        for name in ("bin/lambert", "bin/lambertd", "bin/lambert-bench", "include/lambert/lambert.h",
                     "share/doc/lambert/README.md", "share/doc/lambert/FORMAT.md", "share/doc/lambert/examples/apply_one.c",
                     "share/lambert/bench/service.py", "share/lambert/bench/honesty.py", "share/lambert/bench/cie171.py",
                     "share/lambert/bench/cie171_cases.py", "share/lambert/bench/plots.py",
                     "share/lambert/python/pyproject.toml", "share/lambert/python/lambert/scene.py", "share/lambert/python/lambert/py.typed",
                     "share/lambert/js/package.json", "share/lambert/js/lambert.js", "share/lambert/js/lambert.d.ts"):
            self.assertTrue((self.prefix / name).is_file(), name)
        version = run(self.prefix / "bin" / "lambert", "--version").split()[1]
        self.assertEqual(self.flags("--modversion"), [version])

    def test_manual_pages_and_completion(self):
        """Each is what the installed program prints, where man and the shells look for it."""
        for program in ("lambert", "lambertd"):
            for option, place in (("--print-manual", f"man/man1/{program}.1"),
                                  ("--print-completion=bash", f"bash-completion/completions/{program}"),
                                  ("--print-completion=zsh", f"zsh/site-functions/_{program}"),
                                  ("--print-completion=fish", f"fish/vendor_completions.d/{program}.fish")):
                with self.subTest(place=place):
                    printed = run(self.prefix / "bin" / program, option)
                    self.assertGreater(len(printed.splitlines()), 10)
                    self.assertEqual((self.prefix / "share" / place).read_text(), printed)
        self.assertTrue((self.prefix / "share/man/man1/lambert.1").read_text().startswith(".TH LAMBERT 1 "))

    def test_symbols(self):
        """Both libraries export the functions of lambert.h and no others; jansson is not needed."""
        header = (self.prefix / "include/lambert/lambert.h").read_text()
        exported = {}
        for name, options in (("liblambert.so", ["-D"]), ("liblambert.a", ["-g"])):
            lines = run("nm", *options, "--defined-only", self.libraries / name).splitlines()
            words = [line.split() for line in lines]
            exported[name] = {word[2].partition("@")[0] for word in words if len(word) == 3 and not word[2].startswith("LAMBERT_")}
            versions = {word[2].partition("@@")[2] for word in words if len(word) == 3 and not word[2].startswith("LAMBERT_")}
            self.assertEqual(versions, {"LAMBERT_0.3"} if name.endswith(".so") else {""})
            self.assertGreater(len(exported[name]), 25)
            for symbol in exported[name]:
                self.assertIn(f"{symbol}(", header)
        self.assertEqual(exported["liblambert.so"], exported["liblambert.a"])
        self.assertNotIn("jansson", run("readelf", "-d", self.libraries / "liblambert.so"))

    def test_header_in_cplusplus(self):
        run("c++", "-x", "c++", "-fsyntax-only", "-Wall", "-Werror", self.prefix / "include/lambert/lambert.h")

    def test_apply_one(self):
        solved = np.load(self.root / "closed.npy").ravel()
        for static in (False, True):
            B = self.numbers("apply_one", static, self.closed).ravel()
            np.testing.assert_array_equal(B.astype("f4"), solved)
            # A furnace: B = E / (1 - rho) = 2. Closed forms make F; .05 is --epsilon, which bounds the operator.
            np.testing.assert_allclose(B, 2, rtol=.05)

    def test_apply_skies(self):
        solved = np.load(self.root / "open.npy").reshape(4, -1, 1)
        for static in (False, True):
            B = self.numbers("apply_skies", static, self.open)
            self.assertGreater(B.max(), 0)
            np.testing.assert_array_equal(B.T.astype("f4"), solved.reshape(4, -1)[:, : len(B)])

    def test_reduce_one(self):
        """Names, areas and means are those of the store; each group has its stated error, which is that of the daemon."""
        with h5py.File(self.closed, "r") as f:
            names = [name.decode() for name in f["mesh/group_names"][()]]
            group, area = f["mesh/group"][()], f["mesh/area"][()]
        command = [self.prefix / "bin" / "lambertd", self.closed, "--listen", "127.0.0.1:0"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as daemon:
            try:
                address = next(found[1] for found in (re.search(r"listening on (http:\S+)", line) for line in daemon.stdout) if found)
                body = {"emission": {"groups": {names[0]: 1}}, "quantity": "irradiance", "reduce": {"groups": names, "with": ["mean", "min"]}}
                wanted = json.loads(run("curl", "-sS", "-H", "Content-Type: application/json", "-d", json.dumps(body), f"{address}/v1/scenes/closed/radiosity"))
            finally:
                daemon.terminate()
        for static in (False, True):
            environment = dict(os.environ, LD_LIBRARY_PATH="" if static else str(self.libraries))
            lines = [line.split() for line in run(self.compile("reduce_one", static), self.closed, env=environment).splitlines()]
            self.assertEqual([line[0] for line in lines], names)
            for g, (name, of, mean, stated) in enumerate(lines):
                self.assertAlmostEqual(float(of), area[group == g].sum(), places=6)
                np.testing.assert_allclose(float(mean), wanted["groups"][name]["mean"], rtol=1e-5)
                np.testing.assert_allclose(float(stated), wanted["error"]["groups"][name]["stated"], rtol=1e-3)

    def test_ask_daemon(self):
        """A lamp of twice the watts gives twice the light; the daemon is the installed one."""
        command = [self.prefix / "bin" / "lambertd", self.closed, "--listen", "127.0.0.1:0"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as daemon:
            try:
                address = next(found[1] for found in (re.search(r"listening on (http:\S+)", line) for line in daemon.stdout)
                               if found)
                lines = run("/usr/bin/python3", EXAMPLES / "ask_daemon.py", address, "ceiling").splitlines()
            finally:
                daemon.terminate()
        means = [json.loads(line.split(" ", 1)[1]) for line in lines]
        self.assertEqual(len(means), 4)
        for name, mean in means[0].items():
            self.assertGreater(mean, 0)
            np.testing.assert_allclose([other[name] for other in means], np.array([1, 2, 4, 8]) * mean, rtol=1e-5)

    def test_refine_one(self):
        """B solves (I - R F) B = E of the kept F, to the tolerance asked for."""
        with h5py.File(self.closed, "r") as f:
            g, rho = f["form_factors"], f["mesh/reflectance"][0].astype(float)
            n = len(rho)
            F = np.zeros((n, n))
            F[np.repeat(np.arange(n), np.diff(g["indptr"][()].astype(int))), g["indices"][()]] = g["data"][()]
        truth = np.linalg.solve(np.eye(n) - rho[:, None] * F, np.ones(n))
        for static in (False, True):
            B = self.numbers("refine_one", static, self.closed).ravel()
            # 1e-9 of the indirect light, which is 1 here, and the rounding of a dense solution of condition 3.
            np.testing.assert_allclose(B, truth, atol=1.1e-9)


if __name__ == "__main__":
    unittest.main()
