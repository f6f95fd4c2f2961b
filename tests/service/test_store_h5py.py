"""A store as others see it: read with h5py and nothing of ours, as store/FORMAT.md says."""

import ctypes
import ctypes.util
import datetime
import functools
import os
import pathlib
import re
import sys
import tempfile
import unittest
import unittest.mock

import h5py
import numpy as np

from command import example, lambert as run
from cube import CORNERS

FORMAT = pathlib.Path(__file__).resolve().parents[2] / "store" / "FORMAT.md"
PIECE = 2**20
ROUND = 2.0**-24  # of one operation in single precision, relative

# A cube of one metre seen from inside; one wall is black, a quarter of the ceiling's material glows.
CUBE = "mtllib cube.mtl\n" + CORNERS + """o Böden
usemtl floor
f 1 2 3 4
o ceiling
usemtl lamp
f 8 7 6 5
o left
usemtl red
f 4 8 5 1
o right
usemtl white
f 2 6 7 3
o front
usemtl black
f 1 5 6 2
o back
usemtl white
f 3 7 8 4
"""
MATERIALS = """newmtl floor
Kd 0.5 0.5 0.5
newmtl lamp
Kd 0.7 0.7 0.7
Ke 2 2 2
newmtl red
Kd {red}
newmtl white
Kd 0.75 0.75 0.75
newmtl black
Kd 0 0 0
"""


def datasets(store, below="/"):
    found = {}
    store[below].visititems(
        lambda path, item: found.update({"/" + path: item}) if isinstance(item, h5py.Dataset) else None
    )
    return found


def load_xxhash():
    library = ctypes.CDLL(ctypes.util.find_library("xxhash"))
    library.XXH3_64bits.restype = ctypes.c_uint64
    library.XXH3_64bits.argtypes = [ctypes.c_char_p, ctypes.c_size_t]
    return lambda data: library.XXH3_64bits(bytes(data), len(data))


class XxhashPackage:
    """The functions of Python's package xxhash that an example uses, by the C library."""

    def __init__(self):
        self.data = b""

    xxh3_64 = classmethod(lambda cls: cls())
    xxh3_64_intdigest = staticmethod(load_xxhash())

    def update(self, data):
        self.data += data

    def hexdigest(self):
        return f"{self.xxh3_64_intdigest(self.data):016x}"


class Store:
    """An operator as FORMAT.md describes it, in numpy, in double."""

    def __init__(self, path):
        with h5py.File(path, "r") as f:
            self.reflectance = f["mesh/reflectance"][()].astype(float)
            self.area = f["mesh/area"][()]
            self.channels, self.n = self.reflectance.shape
            operator = f["operator"]
            self.kind = operator.attrs["kind"].decode()
            self.form = operator.attrs["form"].decode() if "form" in operator.attrs else None
            self.epsilon = operator.attrs.get("epsilon")
            self.order = operator["order"][()] if "order" in operator else np.arange(self.n)
            self.arrays = {name: self.read(operator, name) for name in operator
                           if name != "order" and not name.endswith("_scale")}
            rows = f["form_factors"]
            self.F = np.zeros((self.n, self.n))
            indptr, indices, data = (rows[name][()] for name in ("indptr", "indices", "data"))
            for i in range(self.n):
                span = slice(int(indptr[i]), int(indptr[i + 1]))
                self.F[i, indices[span]] = data[span]

    @staticmethod
    def read(operator, name):
        values = operator[name][()]
        values = values.astype(float)
        return values * operator[name + "_scale"][()] if name + "_scale" in operator else values

    def bounced(self, E, magnitude=False):
        """The operator's row sums of bounced light; with magnitude, of the sizes of all terms in them."""
        size = np.abs if magnitude else lambda x: x
        sign = 1 if magnitude else -1
        result = np.zeros_like(E)
        a = {name: size(array) for name, array in self.arrays.items()}
        for c in range(self.channels):
            e = size(E[c, self.order])
            if self.form == "folded":
                row = sign * (a["Y"] @ (a["V"].T @ e))
            elif self.form == "factored":
                row = a["U"] @ (a["core"][c] @ (a["V"].T @ e))
            else:
                row = a["M"][c] @ e + (e if magnitude else -e)
            result[c, self.order] = row
        return result

    def answer(self, E):
        """Radiosity and irradiance."""
        row = self.bounced(E)
        rho, black = self.reflectance, self.reflectance == 0
        if self.form == "factored":
            return E + rho * row, row
        return np.where(black, E, E + row), row / np.where(black, 1, rho)

    def rounding(self, E):
        """A bound on the rounding of single precision: an operation rounds by ROUND of what it adds, and no sum
        here has more terms than n for each of at most three products."""
        return 3 * (self.n + 2) * ROUND * (np.abs(E) + self.bounced(E, magnitude=True))

    def reference(self, E):
        """(1 - rho F) B = E, channel by channel."""
        unit = np.eye(self.n)
        pairs = zip(self.reflectance, E)
        return np.array([np.linalg.solve(unit - rho[:, None] * self.F, e) for rho, e in pairs])

    def norm(self, x):
        return np.sqrt(np.sum(self.area * x * x))


def each_store(test):
    """Runs a test for every store, all of them whatever fails."""

    @functools.wraps(test)
    def run_all(self):
        for name, path in self.stores.items():
            with self.subTest(store=name):
                test(self, name, path)

    return run_all


class StoreTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.root = pathlib.Path(cls.folder.name)
        cls.stores = {}
        cases = {
            "folded": ("0.5 0.5 0.5", "low-rank"),
            "factored": ("0.6 0.1 0.1", "low-rank"),
            "exact": ("0.5 0.5 0.5", "exact"),
            "exact_colour": ("0.6 0.1 0.1", "exact"),
            "folded_f16": ("0.5 0.5 0.5", "low-rank"),
            "folded_i8": ("0.5 0.5 0.5", "low-rank"),
            "factored_i8": ("0.6 0.1 0.1", "low-rank"),
        }
        for name, (red, method) in cases.items():
            precision = name.partition("_")[2] if method == "low-rank" else ""
            scene = cls.root / name
            scene.mkdir()
            (scene / "cube.obj").write_text(CUBE)
            (scene / "cube.mtl").write_text(MATERIALS.format(red=red))
            store = scene / "cube.h5"
            made = run("precompute", scene / "cube.obj", "-o", store, "--method", method, "--max-edge", 0.25,
                       "--epsilon", 0.05, "--rays", 4096, "--seed", 7, "--keep-form-factors",
                       "--sky", "grid:4x3", "--quiet", "--store-precision", precision or "f32")
            if made.returncode != 0:
                raise AssertionError(f"precompute {name}: exit {made.returncode}: {made.stderr}")
            cls.stores[name] = store

    def text(self, attributes, name):
        value = attributes[name]
        self.assertIsInstance(value, bytes, name)
        return value.decode()

    @each_store
    def test_root(self, name, path):
        with h5py.File(path, "r") as f:
            self.assertEqual(self.text(f.attrs, "format"), "lambert")
            self.assertEqual(f.attrs["version"], 1)
            self.assertEqual(f.attrs["version"].dtype, np.dtype("<i8"))
            self.assertEqual(self.text(f.attrs, "name"), "cube")
            self.assertEqual(f.attrs["seed"], 7)
            self.assertIn("lambert", self.text(f.attrs, "tool"))
            self.assertIn("precompute", self.text(f.attrs, "command"))
            self.assertEqual(f.attrs["unit"], 1.0)
            created = self.text(f.attrs, "created")
            self.assertRegex(created, r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$")
            made = datetime.datetime.strptime(created, "%Y-%m-%dT%H:%M:%S%z")
            self.assertLess(abs(datetime.datetime.now(datetime.timezone.utc) - made),
                            datetime.timedelta(days=1))

    @each_store
    def test_every_dataset_is_documented(self, name, path):
        n = 6 * 16
        with h5py.File(path, "r") as f:
            C = 3 if name in ("factored", "factored_i8", "exact_colour") else 1
            v = f["mesh/vertices"].shape[0]
            g = f["mesh/group_names"].shape[0]
            nnz = f["form_factors/data"].shape[0]
            k = int(f["operator"].attrs.get("rank", 0))
            expected = {
                "/mesh/vertices": ((v, 3), "<f8"), "/mesh/elements": ((n, 4), "<u4"),
                "/mesh/area": ((n,), "<f8"), "/mesh/normal": ((n, 3), "<f4"),
                "/mesh/reflectance": ((C, n), "<f4"), "/mesh/emission": ((C, n), "<f4"),
                "/mesh/group": ((n,), "<u4"), "/mesh/row_sums": ((n,), "<f8"),
                "/mesh/face": ((n,), "<u4"), "/mesh/face_area": ((6,), "<f8"),
                "/form_factors/indptr": ((n + 1,), "<u8"), "/form_factors/indices": ((nnz,), "<u4"),
                "/form_factors/data": ((nnz,), "<f4"), "/form_factors/leaving": ((n,), "<f8"),
                "/form_factors/absorbed": ((n,), "<f8"), "/form_factors/repair": ((n,), "<f8"), "/sky/tiles": ((12, 9), "<f8"),
                "/sky/first_bounce": ((12, n), "<f4"),
            }
            form, _, precision = name.partition("_")
            if form != "exact":
                value = {"": "<f4", "f16": "<f2", "i8": "|i1"}[precision]
                for array in ("Y", "V") if form == "folded" else ("U", "V"):
                    expected["/operator/" + array] = ((n, k), value)
                    if precision == "i8" or f"operator/{array}_scale" in f and precision == "f16":
                        expected[f"/operator/{array}_scale"] = ((k,), "<f4")
                self.assertEqual(self.text(f["operator"].attrs, "precision"), precision or "f32")
            if form == "factored":
                expected["/operator/core"] = ((C, k, k), "<f4")
            elif form == "exact":
                expected.update({"/operator/M": ((C, n, n), "<f4")})
            if "order" in f["operator"]:
                expected["/operator/order"] = ((n,), "<u4")
            found = {p: (d.shape, d.dtype.str) for p, d in datasets(f).items()
                     if not p.startswith("/checksum/")}
            law = [f"{what}_{part}" for what in ("rms", "mean") for part in ("one", "many", "even")]
            by_group = law + [near + largest for near in ("uniform", "near", "far") for largest in ("", "_largest")]
            if "error/by_group/sky_power" in f:  # a sky shines into the scene
                by_group += [f"sky_{what}_{part}" for what in ("rms", "mean")
                             for part in ("tiles", "even", "bounced")]
                self.assertTrue(np.isfinite(f["error/by_group"].attrs["sky_direct"]))
                expected["/error/by_group/sky_power"] = ((C, 12), "<f8")
                expected["/error/by_group/sky_power_off"] = ((C, 12), "<f8")
                for name in "sky_first", "sky_elements_off", "sky_means_off":
                    expected[f"/error/by_group/{name}"] = ((g, 12), "<f8")
            expected.update({f"/error/by_group/{figure}": ((1, g), "<f8") for figure in by_group})
            # All groups of the box are few enough to be judged as themselves.
            expected["/error/by_group/whole_groups"] = ((g,), "<u4")
            expected.update({f"/error/by_group/whole_{what}": ((1, g, g, g), "<f8") for what in ("rms", "mean")})
            self.assertEqual(sorted(f["error/by_group/whole_groups"][:]), list(range(g)))
            for what in "rms", "mean":
                of_pairs = f[f"error/by_group/whole_{what}"][0]
                np.testing.assert_array_equal(of_pairs, of_pairs.transpose(0, 2, 1))
                self.assertTrue((np.diagonal(of_pairs, axis1=1, axis2=2) >= 0).all())
            of_mesh = [light for light in ("lights", "even", "single", "groups", "sky_even", "sky_cloudy", "sky_tile")
                       if light in f["error/mesh"].attrs]
            expected.update({f"/error/mesh/{light}_{what}": ((g,), "<f8")
                             for light in of_mesh for what in ("variation", "reflected")})
            if "lights" in of_mesh:
                expected["/error/mesh/lights_power"] = ((g,), "<f8")
            if "groups" in of_mesh:
                expected.update({f"/error/mesh/group_{what}": ((g,), "<f8") for what in ("share", "light")})
            names = found.pop("/mesh/group_names")
            self.assertEqual(names[0], (g,))
            self.assertRegex(names[1], r"^\|S\d+$")
            self.assertEqual(found, expected)
            for dataset in datasets(f).values():
                self.assertIsNone(dataset.chunks)
                self.assertIsNone(dataset.compression)
                if dataset.nbytes >= 4096:
                    self.assertEqual(dataset.id.get_offset() % 4096, 0, dataset.name)

    @each_store
    def test_every_attribute_is_documented(self, name, path):
        words = set(re.findall(r"`(\w+)`", FORMAT.read_text()))
        figures = re.compile(r"(total|operator)_(relative|indirect)_(mean|std|max)")
        with h5py.File(path, "r") as f:
            found = set(f.attrs)
            f.visititems(lambda _, item: found.update(item.attrs))
        self.assertGreater(len(found), 30)
        self.assertEqual({a for a in found if not figures.fullmatch(a)} - words, set())

    @each_store
    def test_mesh(self, name, path):
        with h5py.File(path, "r") as f:
            mesh = f["mesh"]
            names = [name.decode() for name in mesh["group_names"]]
            self.assertEqual(sorted(names), sorted(["Böden", "ceiling", "left", "right", "front", "back"]))
            for hash_name in ("geometry_hash", "source_hash"):
                self.assertRegex(self.text(mesh.attrs, hash_name), r"^[0-9a-f]{32}$")
            self.assertIn(self.text(mesh.attrs, "up"), "xyz")
            self.assertEqual(mesh.attrs["two_sided"], 0)
            # 16 squares on each face of the unit cube; .25 is exact in binary
            np.testing.assert_allclose(mesh["area"][()], 1 / 16, rtol=1e-12)
            corners = mesh["vertices"][()][mesh["elements"][()]]
            np.testing.assert_allclose(
                np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) * 16,
                mesh["normal"][()], atol=1e-6)
            group = mesh["group"][()]
            floor = group == names.index("Böden")
            self.assertEqual(floor.sum(), 16)
            np.testing.assert_allclose(mesh["normal"][()][floor], [[0, 0, 1]] * 16, atol=1e-6)
            np.testing.assert_allclose(mesh["reflectance"][()][:, floor], 0.5, rtol=1e-6)
            lit = mesh["emission"][()] > 0
            np.testing.assert_array_equal(lit, np.broadcast_to(group == names.index("ceiling"), lit.shape))
            self.assertTrue((mesh["reflectance"][()][:, group == names.index("front")] == 0).all())

    @each_store
    def test_form_factors(self, name, path):
        store = Store(path)
        with h5py.File(path, "r") as f:
            attributes = f["form_factors"].attrs
            self.assertEqual(self.text(attributes, "method"), "rays")
            self.assertEqual(self.text(attributes, "storage"), "rows")
            self.assertEqual(attributes["rays"], 4096)
            for number in ("closure_error", "reciprocity_error", "leaving_share", "absorbed_share",
                           "repair_mean", "repair_max"):
                self.assertGreaterEqual(attributes[number], 0, number)
            self.assertIn("seed", attributes)
            self.assertEqual(attributes["closed"], 1)
            row_sums = f["mesh/row_sums"][()]
            indptr = f["form_factors/indptr"][()]
            self.assertEqual(indptr[0], 0)
            self.assertEqual(indptr[-1], f["form_factors/data"].shape[0])
        # the sum of up to n values rounded to single precision, each at most 1
        np.testing.assert_allclose(store.F.sum(axis=1), row_sums, atol=store.n * ROUND)
        np.testing.assert_allclose(store.F.sum(axis=1), 1, atol=1e-3)
        flow = store.area[:, None] * store.F
        np.testing.assert_allclose(flow, flow.T, atol=4 * ROUND * flow.max())

    @each_store
    def test_radiosity_is_that_of_the_formula(self, name, path):
        """`lambert solve` answers what a reader of FORMAT.md computes."""
        rng = np.random.default_rng(3)
        store = Store(path)
        self.assertEqual(store.kind, "exact" if name.startswith("exact") else "low_rank")
        self.assertEqual(store.form, None if name.startswith("exact") else name.partition("_")[0])
        E = np.where(rng.random((store.channels, store.n)) < 0.2,
                     rng.random((store.channels, store.n)), 0).astype("<f4")
        np.save(self.root / "E.npy", E)
        B, H = store.answer(E.astype(float))
        bound = store.rounding(E.astype(float))
        small = np.where(store.reflectance == 0, 1, store.reflectance)
        for quantity, expected, tolerance in (("radiosity", B, bound), ("irradiance", H, bound / small),
                                              ("indirect", B - E, bound)):
            out = self.root / "out.npy"
            solved = run("solve", path, "--emission", self.root / "E.npy", "--quantity", quantity, "-o", out)
            self.assertEqual(solved.returncode, 0, solved.stderr)
            answer = np.load(out).astype(float).reshape(store.channels, store.n)
            self.assertGreater(np.abs(answer).max(), 0)
            worst = (np.abs(answer - expected) / tolerance).max()
            self.assertLessEqual(worst, 1, quantity)

    @each_store
    def test_radiosity_is_that_of_the_form_factors(self, name, path):
        """Exact: but for rounding. Low rank: within epsilon/(1 - max rho), area-weighted."""
        store = Store(path)
        E = np.zeros((store.channels, store.n))
        E[:, 5] = 1
        for emission in (E, np.ones_like(E)):
            B, H = store.answer(emission)
            reference = store.reference(emission)
            if name.startswith("exact"):
                # M is the inverse in double, rounded once; its own error is of the order of 1e-13
                np.testing.assert_array_less(np.abs(B - reference), store.rounding(emission) + 1e-12)
                np.testing.assert_allclose(H, [store.F @ b for b in reference], atol=1e-4)
            else:
                error = store.norm(B - reference) / store.norm(reference)
                # i8: a value is off by up to 1/254 of its column's largest, some of them of one sign
                narrow = 0.02 if name.endswith("i8") else 0
                self.assertLess(error, store.epsilon / (1 - store.reflectance.max()) + narrow)

    def test_the_norm_of_the_error_is_that_of_the_bound(self):
        """S - Q V' is A^1/2 (F - U V') A^-1/2 with what a factored store holds."""
        scene, path = self.root / "factored" / "cube.obj", self.root / "norm.h5"
        for factorizer, rank in (("hf", None), ("svd", None), ("hf", 20)):
            with self.subTest(factorizer=factorizer, rank=rank):
                made = run("precompute", scene, "-o", path, "--method", "low-rank", "--max-edge", 0.25, "--epsilon", 0.2,
                           "--rays", 4096, "--probes", 0, "--keep-form-factors", "--factorizer", factorizer,
                           "--levels", 2, *(() if rank is None else ("--rank", rank)))
                self.assertEqual(made.returncode, 0, made.stderr)
                unused = "--epsilon" if rank is not None else "--levels" if factorizer == "svd" else None
                self.assertEqual(re.findall("low-rank does not use (.*)", made.stderr), [unused] if unused else [])
                with h5py.File(path, "r") as f:
                    operator = f["operator"].attrs
                    self.assertEqual(self.text(operator, "norm"), "2")
                    self.assertEqual(operator.get("budget"), b"squares" if unused is None else None)
                    measured, epsilon = operator["measured_norm_error"], operator["epsilon"]
                store = Store(path)
                UV = np.zeros((store.n, store.n))
                UV[np.ix_(store.order, store.order)] = store.arrays["U"] @ store.arrays["V"].T
                root = np.sqrt(store.area)
                left = root[:, None] * (store.F - UV) / root
                expected = np.linalg.norm(left, 2)
                self.assertIn(f"measured norm error {measured:.3g}, order of the norm 2", made.stderr)
                # by power iteration to about a per cent
                self.assertLess(abs(measured - expected), 0.03 * expected + store.n * ROUND)
                self.assertEqual(epsilon, 0.2 if rank is None else measured)
                self.assertLessEqual(expected, epsilon * 1.03)

    @each_store
    def test_errors_are_stored(self, name, path):
        with h5py.File(path, "r") as f:
            self.assertIn("single", f["error"])
            # of what constants leave: every light is there that the operator answers
            of_mesh = dict(f["error/mesh"].attrs)
            self.assertEqual("even" in of_mesh, name != "emitters")
            for light, share in of_mesh.items():
                if not light.endswith("_emitters"):
                    self.assertTrue(0 <= share < 10, (light, share))
            for name, figures in f.get("error/by_group", {}).items():
                if "sky" not in name and "whole" not in name:
                    self.assertEqual(figures.shape, (1, len(f["mesh/group_names"])), name)
            for group in (f["error"][name] for name in f["error"] if name not in ("by_group", "mesh")):
                attributes = group.attrs
                self.assertGreater(attributes["probes"], 0)
                own = "operator_probes" in attributes  # not of skies
                for kind in ("total", "operator")[:2 if own else 1]:
                    for norm in ("relative", "indirect"):
                        figures = [attributes[f"{kind}_{norm}_{what}"] for what in ("mean", "std", "max")]
                        self.assertTrue(np.isfinite(figures).all())
                        # the mean may pass the largest by rounding where all are equal
                        self.assertLessEqual(figures[0], figures[2] * (1 + 1e-12))
                for what in ("reference_noise", "negative_share", "energy_balance")[:3 if own else 1]:
                    self.assertTrue(np.isfinite(attributes[what]), what)

    @each_store
    def test_checksums(self, name, path):
        xxh3 = load_xxhash()
        with h5py.File(path, "r") as f:
            arrays = {p: d for p, d in datasets(f).items() if not p.startswith("/checksum/")}
            sums = datasets(f, "/checksum")
            self.assertEqual(sorted(arrays), sorted(sums))
            self.assertEqual(f["checksum"].attrs["piece_bytes"], PIECE)
            everything = b""
            for array in sorted(arrays, key=str.encode):
                raw = np.ascontiguousarray(arrays[array][()]).tobytes()
                expected = [xxh3(raw[i : i + PIECE]) for i in range(0, len(raw), PIECE)]
                self.assertEqual(sums[array].dtype.str, "<u8")
                self.assertEqual(expected, [int(s) for s in sums[array][()]], array)
                everything += array.encode() + b"\0" + sums[array][()].tobytes()
            self.assertEqual(f"{xxh3(everything):016x}", self.text(f["checksum"].attrs, "xxh3"))

    @each_store
    def test_python_of_the_checksums(self, name, path):
        """The reader in deploy/examples accepts what was written, and no store in which one number differs."""
        changed = self.root / "changed.h5"
        changed.write_bytes(path.read_bytes())
        with unittest.mock.patch.dict(sys.modules, xxhash=XxhashPackage):
            names = example("read_checksums.py", path)
            with h5py.File(path, "r") as f:
                arrays = sorted((p for p in datasets(f) if not p.startswith("/checksum/")), key=str.encode)
            self.assertEqual(sorted(names["paths"], key=str.encode), arrays)
            with h5py.File(changed, "r+") as f:
                f["mesh/area"][-1] *= 2
            with self.assertRaises(AssertionError):
                example("read_checksums.py", changed)

    def test_python_of_the_documentation(self):
        """The reader in deploy/examples computes what this file does."""
        path = self.stores["folded"]
        names = example("read_low_rank.py", path)
        store = Store(path)
        with h5py.File(path, "r") as f:
            E = f["mesh/emission"][()].astype(float)
        np.testing.assert_allclose(names["B"], store.answer(E)[0][0], rtol=1e-12)

    def test_python_of_a_hierarchical_store(self):
        """The reader in deploy/examples says what `lambert solve --linear` does."""
        scene, path, answer = (self.root / name for name in ("made.obj", "made.h5", "made.npy"))
        for kind, group, rays, made_up in (("cornell", "lamp", "auto", False), ("city", "street", 64, True)):
            for line in (("generate", kind, "--elements", 1000, "-o", scene),
                         ("precompute", scene, "-o", path, "--method", "hierarchical", "--probes", 0, "--reflectance", 0.5,
                          "--rays", rays),
                         ("solve", path, "--emit", f"{group}=2", "--linear", "-o", answer)):
                done = run(*line)
                self.assertEqual(done.returncode, 0, done.stderr)
            with h5py.File(path, "r+") as f:
                bright = [name.decode() for name in f["mesh/group_names"][()]].index(group)
                f["mesh/emission"][0] = np.where(f["mesh/group"][()] == bright, 2, 0)
                self.assertEqual("missing" in f["operator"], made_up)
            names = example("read_hierarchical.py", path)
            B = np.load(answer)
            B = B[0] if B.ndim == 2 else B
            # Two transforms and a product in single precision, of numbers that half precision has exactly.
            np.testing.assert_allclose(names["B"], B, atol=1e-5 * B.max())

    def test_upper_triangle(self):
        """Above 10,240 elements: read by the reader in deploy/examples, and as `precompute` and `verify` do."""
        scene, path, again = (self.root / name for name in ("many.obj", "many.h5", "again.h5"))
        how = ("--method", "low-rank", "--rank", 8, "--probes", 0, "--keep-form-factors")
        for line in (("generate", "box", "--divisions", 42, "-o", scene), ("precompute", scene, "-o", path, "--rays", 64, *how),
                     ("precompute", path, "-o", again, *how), ("verify", path, "--probes", 0)):
            done = run(*line)
            self.assertEqual(done.returncode, 0, done.stderr + done.stdout)
        names = example("read_form_factors.py", path)
        n, pairs = 10584, len(names["F"])
        with h5py.File(path, "r") as one, h5py.File(again, "r") as two:
            self.assertEqual(one["form_factors"].attrs["storage"], b"upper")
            self.assertEqual(2 * len(one["form_factors/data"]), pairs)
            sums = np.bincount(names["i"], names["F"].astype(np.float32), n)
            np.testing.assert_allclose(sums, one["mesh/row_sums"][()], rtol=1e-12)
            for name in ("operator/Y", "operator/V", "mesh/row_sums", *(f"form_factors/{d}" for d in one["form_factors"])):
                np.testing.assert_array_equal(one[name][()], two[name][()], name)
        with h5py.File(self.stores["folded"], "r") as few:
            self.assertEqual(few["form_factors"].attrs["storage"], b"rows")

    def refused(self, path, *words):
        for verb in ("info", "verify"):
            answer = run(verb, path)
            self.assertEqual(answer.returncode, 1, answer.stderr)
            self.assertEqual(len(answer.stderr.strip().splitlines()), 1, answer.stderr)
            for word in (str(path), *words):
                self.assertIn(word, answer.stderr)

    def copy(self, name):
        path = self.root / f"{name}.h5"
        path.write_bytes(self.stores["folded"].read_bytes())
        return path

    def test_another_version_is_refused(self):
        path = self.copy("newer")
        with h5py.File(path, "r+") as f:
            f.attrs.modify("version", 2)
        self.refused(path, "version 2", "version 1")

    def test_foreign_files_are_refused(self):
        path = self.root / "foreign.h5"
        with h5py.File(path, "w") as f:
            f["x"] = np.arange(9)
        self.refused(path)
        path.write_text("not HDF5\n" * 100)
        self.refused(path)

    def test_truncated_stores_are_refused(self):
        path = self.copy("truncated")
        size = path.stat().st_size
        for length in (0, 47, 1000, size // 2, size - 1):
            os.truncate(path, length)
            self.refused(path)
            path = self.copy("truncated")

    def test_a_flipped_bit_is_found(self):
        path = self.copy("flipped")
        with h5py.File(path, "r") as f:
            offset = f["operator/Y"].id.get_offset() + f["operator/Y"].nbytes // 2
        content = bytearray(path.read_bytes())
        content[offset] ^= 16
        path.write_bytes(content)
        answer = run("verify", path)
        self.assertEqual(answer.returncode, 1)
        self.assertIn("/operator/Y", answer.stdout + answer.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
