"""Answers by face of the scene file, of lambertd and of lambert solve: means over the elements of each face by area, as
store/FORMAT.md says with h5py alone, and as the polygons of the file say, cut with those of the elements."""

import csv
import io
import json
import os
import pathlib
import tempfile
import unittest

import h5py
import numpy as np

from command import must
from case import Case
from daemon import Daemon, npy
from make_store import Scene, add_checksums
from test_backs import Gltf, material, square

NONE = 0xFFFFFFFF
SINGLE = 2.0**-24  # of a rounding to single precision, relative
QUICK = "--quiet", "--probes", 0
QUANTITIES = "radiosity", "irradiance", "indirect"

# A room of 2 m, of which face 1 is a line there and back, 2 repeats 0, 5 is a hexagon in the middle, 6 and 7 make a wall of triangles, and
# 10 is another floor's quad: its objects are not in one piece.
VERTICES = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2),
            (.9, .5, 1), (1.4, .5, 1), (1.6, .9, 1), (1.4, 1.3, 1), (.9, 1.3, 1), (.7, .9, 1)]
FACES = [("floor", (1, 2, 3, 4)), ("floor", (1, 2, 1)), ("floor", (2, 3, 4, 1)), ("ceiling", (10, 9, 8, 7)), ("south", (1, 7, 8, 2)),
         ("table", (11, 12, 13, 14, 15, 16)), ("east", (2, 8, 9)), ("east", (2, 9, 5)), ("north", (5, 9, 10, 6)), ("west", (6, 10, 7, 1)),
         ("floor", (4, 3, 5, 6))]
EMPTY = 1, 2  # faces without an element
MATERIALS = {"grey": "newmtl white\nKd .7 .7 .7\nnewmtl lamp\nKd .5 .5 .5\nKe 3 3 3\nnewmtl dark\nKd .2 .2 .2\n",
             "colours": "newmtl white\nKd .7 .6 .5\nnewmtl lamp\nKd .5 .5 .5\nKe 3 2 1\nnewmtl dark\nKd .2 .3 .2\n"}
LOOKS = {"ceiling": "lamp", "table": "dark"}


def write_scene(folder, name, materials="grey"):
    lines = [f"mtllib {name}.mtl", *(f"v {x} {y} {z}" for x, y, z in VERTICES)]
    for group, corners in FACES:
        lines += [f"o {group}", f"usemtl {LOOKS.get(group, 'white')}", "f " + " ".join(map(str, corners))]
    (folder / f"{name}.obj").write_text("\n".join(lines) + "\n")
    (folder / f"{name}.mtl").write_text(MATERIALS[materials])
    return folder / f"{name}.obj"


def flat(points, at, normal):
    """Points in axes of a plane."""
    u = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    u /= np.linalg.norm(u)
    return (points - at) @ np.stack([u, np.cross(normal, u)], axis=1)


def area_of(polygon):
    x, y = polygon.T
    return (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2


def cut(polygon, by):
    """The part that two convex polygons of a plane, counter-clockwise, have in common."""
    for a, b in zip(by, np.roll(by, -1, axis=0)):
        if len(polygon) < 3:
            return np.zeros((0, 2))
        side = (b - a)[0] * (polygon - a)[:, 1] - (b - a)[1] * (polygon - a)[:, 0]
        kept = []
        for k, (p, d) in enumerate(zip(polygon, side)):
            q, e = polygon[(k + 1) % len(polygon)], side[(k + 1) % len(polygon)]
            if d >= 0:
                kept.append(p)
            if (d >= 0) != (e >= 0):
                kept.append(p + d / (d - e) * (q - p))
        polygon = np.array(kept).reshape(-1, 2)
    return polygon


def common_areas(store, polygons):
    """[faces][n]: the area that each polygon of a file has in common with each element, fronts alone."""
    with h5py.File(store) as f:
        vertices, elements, normal = (f["mesh"][name][()] for name in ("vertices", "elements", "normal"))
        attributes = f["mesh"].attrs
        n = len(elements)
        fronts = n // 2 if attributes["two_sided"] else n - attributes.get("backs", 0)
    found = np.zeros((len(polygons), n))
    for k, polygon in enumerate(polygons):
        polygon = np.asarray(polygon, float)
        own = sum(np.cross(b - polygon[0], c - polygon[0]) for b, c in zip(polygon[1:], polygon[2:]))
        if not np.linalg.norm(own) > 1e-12:
            continue
        own = own / np.linalg.norm(own)
        flat_polygon = flat(polygon, polygon[0], own)
        for i in range(fronts):
            corners = vertices[elements[i][elements[i] != NONE]]
            if normal[i] @ own < .999 or abs((corners - polygon[0]) @ own).max() > 1e-6:
                continue
            both = cut(flat(corners, polygon[0], own), flat_polygon)
            found[k, i] = area_of(both) if len(both) >= 3 else 0
    return found


def stored_areas(store):
    """The same by /mesh/face and the arrays beside it."""
    with h5py.File(store) as f:
        m = f["mesh"]
        face, area = m["face"][()], m["area"][()]
        n_faces, n = len(m["face_area"]), len(face)
        fronts = n // 2 if m.attrs["two_sided"] else n - m.attrs.get("backs", 0)
        found = np.zeros((n_faces, n))
        for i in range(fronts):
            if face[i] != NONE:
                found[face[i], i] = area[i]
        if "face_part" in m:
            for (i, of), common in zip(m["face_part"][()], m["face_part_area"][()]):
                assert face[i] == NONE and i < fronts
                found[of, i] = common
        np.testing.assert_allclose(m["face_area"][()], found.sum(axis=1), rtol=1e-12, atol=0)
    return found


def means(areas, x):
    """[..., n] to [..., faces], NaN of a face without an element."""
    with np.errstate(invalid="ignore"):
        return np.asarray(x, float) @ areas.T / areas.sum(axis=1)


def numbers(values, kind=np.float32):
    """Lists of an answer, null as NaN: decimals stand for the numbers of single precision, or of double, that are next to them."""
    return np.array(values, dtype=kind).astype(float)


class FacesCase(Case):
    @classmethod
    def setUpClass(cls):
        cls.shared = tempfile.TemporaryDirectory(prefix="lambert-faces-")
        cls.base = pathlib.Path(cls.shared.name)
        cls.polygons = [np.array([VERTICES[k - 1] for k in corners], float) for _, corners in FACES]

    def close(self, found, wanted, message=""):
        """Equal but for a rounding to single precision, and gaps in the same places."""
        found, wanted = np.asarray(found, float), np.asarray(wanted, float)
        self.assertEqual(found.shape, wanted.shape, message)
        np.testing.assert_array_equal(np.isnan(found), np.isnan(wanted), err_msg=str(message))
        np.testing.assert_allclose(found, wanted, rtol=1.01 * SINGLE, atol=1e-12, err_msg=str(message))


class Stores(FacesCase):
    """The faces that a store knows."""

    def check(self, store, polygons, empty=(), overlaps=()):
        """The areas of the store are those of the polygons; a polygon that repeats another one has none."""
        of_file, areas = common_areas(store, polygons), stored_areas(store)
        for k in empty:
            of_file[k] = 0
        np.testing.assert_allclose(areas, of_file, atol=1e-6)
        np.testing.assert_allclose(areas.sum(axis=1)[[k for k in range(len(polygons)) if k not in empty]],
                                   [a for k, a in enumerate(of_file.sum(axis=1)) if k not in empty], rtol=1e-9)
        return areas

    def test_faces_of_meshes(self):
        scene = write_scene(self.base, "meshes")
        for options in (("--mesh", "faces"), ("--mesh", "light"), ("--elements", 90), ("--max-edge", .3), ("--mesh-error", .2),
                        ("--elements", 90, "--two-sided"), ("--mesh-error", .1, "--max-edge", .7, "--two-sided"), ("--max-edge", .5, "--orient")):
            store = self.path("m.h5")
            must("precompute", scene, "-o", store, *QUICK, *options)
            with self.subTest(options=options):
                areas = self.check(store, self.polygons, EMPTY)
                self.assertEqual(len(areas), len(FACES))
                self.assertEqual(json.loads(must("info", store, "--json").stdout)["faces"], len(FACES))
                self.assertIn(f"faces             {len(FACES)}\n", must("info", store).stdout)
                with h5py.File(store) as f:
                    face, n = f["mesh/face"][()], len(f["mesh/face"])
                    if "--two-sided" in options:
                        np.testing.assert_array_equal(face[:n // 2], face[n // 2:])
                    # Joined faces, the two of the floor and the triangles of a wall, share elements.
                    self.assertEqual("face_part" in f["mesh"], "--mesh-error" in options)

    def test_a_store_of_a_store_and_one_of_portals(self):
        scene = write_scene(self.base, "again")
        first, second, third = self.path("first.h5"), self.path("second.h5"), self.path("third.h5")
        must("precompute", scene, "-o", first, *QUICK, "--mesh-error", .2, "--keep-form-factors")
        must("precompute", first, "-o", second, *QUICK, "--method", "exact")
        np.testing.assert_array_equal(stored_areas(first), stored_areas(second))
        must("precompute", scene, "-o", third, *QUICK, "--elements", 60, "--portal", "north", "--sky", "grid:4x2")
        self.check(third, self.polygons, (*EMPTY, 8))

    def test_a_gltf_counts_the_triangles_of_its_nodes(self):
        made = Gltf([("lower", square(0), 0), ("upper", square(1), 1), ("side", square(0, .5, (2, 0)), 0)], [material(.5), material(.2, 1.0)])
        made.instances(1, TRANSLATION=(np.array([[0, 0, 0], [3, 0, 0]], "<f4"), 5126, "VEC3"))
        scene = self.base / "nodes.gltf"
        scene.write_bytes(made.text())
        store = self.path("g.h5")
        must("precompute", scene, "-o", store, *QUICK, "--up", "y", "--elements", 50)
        def quads(corners, shift=0.0):
            x, y, z = np.array(corners, float).T
            at = np.c_[x + shift, z, -y]
            return [at[[0, 1, 2]], at[[0, 2, 3]]]
        expected = [*quads(square(0)), *quads(square(1)), *quads(square(1), 3), *quads(square(0, .5, (2, 0)))]
        self.check(store, expected)

    def test_damaged_faces_are_refused(self):
        scene = write_scene(self.base, "damaged")
        store = self.path("d.h5")
        must("precompute", scene, "-o", store, *QUICK, "--mesh", "faces")
        with h5py.File(store, "r+") as f:
            f["mesh/face"][3] = 11
            add_checksums(f)
        self.refused(1, "/mesh/face[3] = 11, there are 11 faces", "solve", store)
        with Daemon(store, ready=False) as daemon:
            daemon.wait_for_error("/mesh/face[3] = 11, there are 11 faces")
            daemon.kill()


class Answers(FacesCase):
    """Means of lambertd and of solve are those of the values of elements."""

    STORES = {
        "exact": ("grey", "--mesh", "light", "--method", "exact", "--keep-form-factors"),
        "whole": ("colours", "--mesh", "faces", "--method", "exact"),
        "joined": ("colours", "--mesh-error", .2, "--method", "low-rank", "--keep-factors", "--keep-form-factors"),
        "sided": ("grey", "--elements", 100, "--two-sided", "--method", "2msc"),
        "sparse": ("grey", "--elements", 80, "--method", "sparse"),
        "hierarchical": ("colours", "--elements", 120, "--method", "hierarchical"),
        "emitters": ("grey", "--elements", 80, "--method", "emitters", "--emitters", "group=ceiling", "--keep-form-factors"),
        "sky": ("grey", "--elements", 80, "--sky", "grid:4x2", "--portal", "north"),
        "read": ("grey", "--elements", 100, "--method", "hierarchical", "--form-factors", "blocks", "--receivers", "table"),
    }

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.scenes = {look: write_scene(cls.base, look, look) for look in MATERIALS}
        for name, (look, *options) in cls.STORES.items():
            must("precompute", cls.scenes[look], "-o", cls.base / f"{name}.h5", "--quiet", "--probes", 8, *options)
        (cls.base / "walk.json").write_text(json.dumps({
            "light": {"polygon": [[-.1, -.1, 0], [-.1, .1, 0], [.1, .1, 0], [.1, -.1, 0]], "emission": [10, 10, 10]},
            "positions": [{"move": [.5, .5, 1.5]}, {"move": [1.5, 1.5, 1.5]}]}))
        must("precompute", cls.scenes["grey"], "-o", cls.base / "positions.h5", "--quiet", "--elements", 60, "--positions",
             cls.base / "walk.json", "--paths", 500)

    def lights(self, name, about):
        if name == "positions":
            return [{"emitters": [1, 0]}, {"emitters": [.5, 2]}]
        if name == "sky":
            return [{"sky": [1] * about["sky"]["tiles"]}, {"groups": {"ceiling": 2}}]
        if name == "emitters":
            return [{"groups": {"ceiling": 2}}, {"groups": {"ceiling": 5}}]
        return [{"groups": {"ceiling": 2}}, {"groups": {"table": 1, "floor": .1}}]

    def test_every_kind_of_store(self):
        stores = [*self.STORES, "positions"]
        with Daemon(*(self.base / f"{name}.h5" for name in stores)) as daemon:
            for name in stores:
                about = daemon.get(f"/v1/scenes/{name}").json()
                self.assertEqual(about["faces"], len(FACES))
                areas = stored_areas(self.base / f"{name}.h5")
                for quantity in QUANTITIES:
                    for limit in True, False:
                        with self.subTest(store=name, quantity=quantity, limit=limit):
                            self.one_batch(daemon, name, about, areas, quantity, limit)

    def one_batch(self, daemon, name, about, areas, quantity, limit):
        body = {"emissions": self.lights(name, about), "quantity": quantity, "limit": limit}
        whole = daemon.radiosity(name, body).json()
        given = daemon.radiosity(name, {**body, "at": "faces"}).json()
        self.assertEqual(given["at"], "faces")
        self.assertEqual(given["elements"], about["elements"])
        self.assertEqual({k: v for k, v in given.items() if k not in (quantity, "at", "time_ms")},
                         {k: v for k, v in whole.items() if k not in (quantity, "time_ms")})
        wanted = means(areas, numbers(whole[quantity]))
        found = numbers(given[quantity])
        self.close(found, wanted)
        alone = daemon.radiosity(name, {"emission": body["emissions"][1], "quantity": quantity, "limit": limit, "at": "faces"}).json()
        np.testing.assert_array_equal(numbers(alone[quantity]), found[1])  # elements have the same bits alone and in a batch
        for dtype, precision in ("f2", 2**-11), ("f4", 0), ("f8", 0):
            raw = daemon.radiosity(name, {**body, "at": "faces"}, accept=f"application/x-npy; dtype={dtype}").body
            array = np.load(io.BytesIO(raw))
            self.assertEqual(array.dtype.str, "<" + dtype)
            np.testing.assert_allclose(array, found, rtol=precision, atol=1e-7 if dtype == "f2" else 0)

    def test_elements_is_the_preset(self):
        with Daemon(self.base / "exact.h5") as daemon:
            body = {"emission": {"groups": {"ceiling": 1}}}
            a, b = (daemon.radiosity("exact", more).json() for more in (body, {**body, "at": "elements"}))
            self.assertEqual(a["radiosity"], b["radiosity"])
            self.assertNotIn("at", b)

    def test_a_face_of_one_element_has_its_value(self):
        """As every face has one but the hexagon, which is two."""
        store = self.base / "whole.h5"
        with h5py.File(store) as f:
            face = f["mesh/face"][()]
        with Daemon(store) as daemon:
            body = {"emission": {"groups": {"ceiling": [3, 2, 1]}}}
            elements, faces = (numbers(daemon.radiosity("whole", more).json()["radiosity"]) for more in (body, {**body, "at": "faces"}))
        single = [k for k in range(len(FACES)) if (face == k).sum() == 1]
        self.assertEqual(single, [0, 3, 4, 6, 7, 8, 9, 10])
        for k in single:
            np.testing.assert_array_equal(faces[:, k], elements[:, face == k][:, 0])

    def test_selected_faces(self):
        order = [10, 5, 1, 3]
        with Daemon(*(self.base / f"{name}.h5" for name in ("exact", "joined", "sided", "emitters"))) as daemon:
            for name in "exact", "joined", "sided", "emitters":
                body = {"emissions": self.lights(name, None)}
                every = numbers(daemon.radiosity(name, {**body, "at": "faces"}).json()["radiosity"])
                for more in {"at": "faces", "select": {"faces": order}}, {"select": {"faces": order}}:
                    given = daemon.radiosity(name, {**body, **more}).json()
                    self.assertEqual(given["at"], "faces")
                    np.testing.assert_array_equal(numbers(given["radiosity"]), every[..., order])
                # Groups give their faces, in the file's order; those of the floor are not in one piece of it.
                for groups, faces in (["floor"], [0, 10]), (["east", "table"], [6, 7, 5]), ([], []):
                    given = daemon.radiosity(name, {**body, "at": "faces", "select": {"groups": groups}}).json()
                    np.testing.assert_array_equal(numbers(given["radiosity"]).reshape(*every.shape[:-1], len(faces)), every[..., faces])
                none = daemon.radiosity(name, {**body, "select": {"faces": [1, 2]}}).json()["radiosity"]
                self.assertTrue(np.isnan(numbers(none)).all())
                raw = daemon.radiosity(name, {**body, "select": {"faces": order}}, accept="application/x-npy").body
                np.testing.assert_array_equal(np.load(io.BytesIO(raw)), every[..., order])

    def test_refined_answers(self):
        with Daemon(*(self.base / f"{name}.h5" for name in ("exact", "joined", "emitters"))) as daemon:
            for name in "exact", "joined", "emitters":
                areas = stored_areas(self.base / f"{name}.h5")
                body = {"emissions": self.lights(name, None), "tolerance": 1e-9}
                whole = daemon.radiosity(name, body).json()
                given = daemon.radiosity(name, {**body, "at": "faces"}).json()
                found = numbers(given["radiosity"], float)
                np.testing.assert_allclose(found, means(areas, whole["radiosity"]), rtol=1e-14)
                for of_faces, of_elements in zip(given["certificate"], whole["certificate"]):
                    self.assertGreaterEqual(of_faces, of_elements)
                    self.assertLess(of_faces - of_elements, 1e-12)
                some = daemon.radiosity(name, {**body, "select": {"faces": [10, 2, 5]}}).json()
                np.testing.assert_allclose(numbers(some["radiosity"], float), found[..., [10, 2, 5]], rtol=1e-8)
                raw = daemon.radiosity(name, {**body, "at": "faces"}, accept="application/x-npy").body
                array = np.load(io.BytesIO(raw))
                self.assertEqual(array.dtype.str, "<f8")
                np.testing.assert_array_equal(array, found)

    def test_variants(self):
        with tempfile.NamedTemporaryFile("w", suffix=".txt") as tokens:
            tokens.write("secret\n")
            tokens.flush()
            with Daemon(self.base / "joined.h5", "--token-file", tokens.name, "--max-variants", 1) as daemon:
                headers = {"Authorization": "Bearer secret"}
                made = daemon.ask("PUT", "/v1/scenes/joined/reflectance", json.dumps({"variant": "dark", "groups": {"floor": .1}}),
                                  {**headers, "Content-Type": "application/json"})
                self.assertEqual(made.status, 202, made)
                daemon.wait_until(lambda: daemon.get("/v1/scenes/joined@dark", headers=headers).status == 200, "the variant")
                body = {"emission": {"groups": {"ceiling": 1}}}
                elements, faces = (numbers(daemon.radiosity("joined@dark", more, headers=headers).json()["radiosity"])
                                   for more in (body, {**body, "at": "faces"}))
                self.close(faces, means(stored_areas(self.base / "joined.h5"), elements))

    def test_solve(self):
        for name in "exact", "joined", "sided":
            store = self.base / f"{name}.h5"
            areas = stored_areas(store)
            groups = [None if k in EMPTY else group for k, (group, _) in enumerate(FACES)]
            for options in ("--emit", "ceiling=2"), ("--emit", "ceiling=2", "--quantity", "irradiance", "--linear"):
                must("solve", store, *options, "-o", self.path("elements.npy"))
                wanted = means(areas, np.load(self.path("elements.npy")))
                with self.subTest(store=name, options=options):
                    for extension in "npy", "json", "csv":
                        must("solve", store, *options, "--at", "faces", "-o", self.path("faces." + extension))
                    self.close(np.load(self.path("faces.npy")), wanted)
                    answer = json.loads(pathlib.Path(self.path("faces.json")).read_text())
                    self.assertEqual(answer["at"], "faces")
                    self.close(numbers(answer[answer["quantity"]]), wanted)
                    self.assertEqual(json.loads(must("solve", store, *options, "--at", "faces", "--json").stdout), answer)
                    with open(self.path("faces.csv"), newline="", encoding="utf-8") as file:
                        rows = list(csv.DictReader(file))
                    self.assertEqual([row["face"] for row in rows], [str(k) for k in range(len(FACES))])
                    self.assertEqual([row["group"] or None for row in rows], groups)
                    np.testing.assert_allclose([float(row["area"]) for row in rows], areas.sum(axis=1), rtol=1e-8)
                    columns = [c for c in rows[0] if c.startswith(answer["quantity"])]
                    self.assertEqual([row[columns[0]] == "" for row in rows], [k in EMPTY for k in range(len(FACES))])
                    self.close([[float(row[c] or "nan") for row in rows] for c in columns], np.atleast_2d(wanted))
                    lines = must("solve", store, *options, "--at", "faces").stdout.splitlines()[1:1 + len(FACES)]
                    table = np.array([[np.nan if w == "-" else float(w) for w in line.split()[3:]] for line in lines]).T
                    np.testing.assert_allclose(table, np.atleast_2d(wanted), rtol=1e-5)
        store, options = self.base / "exact.h5", ("--emit", "ceiling=2", "--tolerance", 1e-8)
        must("solve", store, *options, "-o", self.path("fine.npy"))
        must("solve", store, *options, "--at", "faces", "-o", self.path("means.npy"))
        np.testing.assert_allclose(np.load(self.path("means.npy")), means(stored_areas(store), np.load(self.path("fine.npy"))), rtol=1e-14)

    def test_a_year_of_solve(self):
        store = self.base / "sky.h5"
        np.save(self.path("year.npy"), np.random.default_rng(1).random((24, 8)).astype("f4"))
        options = "--sky", self.path("year.npy"), "--annual", "sum", "--annual", "autonomy=.5"
        for place in "elements", "faces":
            must("solve", store, *options, "--at", place, "-o", self.path(f"{place}.npy"))
        self.close(np.load(self.path("faces.npy")), means(stored_areas(store), np.load(self.path("elements.npy"))))


class Refusals(FacesCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        scene = write_scene(cls.base, "scene")
        cls.store = cls.base / "new.h5"
        must("precompute", scene, "-o", cls.store, *QUICK, "--mesh", "faces", "--two-sided")
        cls.older = cls.base / "older.h5"
        Scene(60).write(cls.older, "older")

    def test_lambertd(self):
        light = {"emission": {"groups": {"ceiling": 1}}}
        backs = {"emission": {"groups": {"lamp": 1}}}
        cases = [
            ("older", {**backs, "at": "faces"}, "not-in-store", "/at", "precompute the scene again"),
            ("older", {**backs, "select": {"faces": [0]}}, "not-in-store", "/select/faces", "precompute the scene again"),
            ("new", {**light, "at": "corner"}, "unknown-word", "/at", 'at = "corner", must be elements, faces or corners'),
            ("new", {**light, "at": 3}, "wrong-kind", "/at", 'at must be "elements", "faces" or "corners"'),
            ("new", {**light, "at": "faces", "at ": 1}, "wrong-members", "/at ", "not a member"),
            ("new", {**light, "at": "faces", "reduce": {"groups": ["floor"], "with": ["mean"]}}, "wrong-members", "", "both reduce"),
            ("new", {**light, "reduce": {"groups": ["floor"], "with": ["max"]}, "at": "faces"}, "wrong-members", "", "both reduce"),
            ("new", {**light, "at": "faces", "select": {"elements": [0]}}, "wrong-members", "/select", "select faces or groups"),
            ("new", {**light, "at": "elements", "select": {"faces": [0]}}, "wrong-members", "/select", "at is elements"),
            ("new", {**light, "select": {"faces": [0], "groups": ["floor"]}}, "wrong-members", "/select", "one of elements, groups, faces,"),
            ("new", {**light, "select": {}}, "wrong-members", "/select", "one of elements, groups, faces,"),
            ("new", {**light, "select": {"faces": [11]}}, "bad-index", "/select/faces/0", "an integer from 0 to 10"),
            ("new", {**light, "select": {"faces": [1.5]}}, "bad-index", "/select/faces/0", "an integer from 0 to 10"),
            ("new", {**light, "select": {"faces": [4, 3, 4]}}, "given-twice", "/select/faces/2", "a face that was listed before"),
            ("new", {**light, "select": {"faces": ["floor"]}}, "wrong-kind", "/select/faces/0", "the number of a face"),
            ("new", {**light, "select": {"faces": 4}}, "wrong-kind", "/select/faces", "an array of numbers of faces"),
            ("new", {**light, "at": "faces", "select": {"groups": ["floor", "floor"]}}, "given-twice", "/select", "floor are selected twice"),
            ("new", {**light, "at": "faces", "select": {"groups": ["floor.back"]}}, "unknown-group", "/select", "floor.back has backs alone"),
            ("new", {**light, "at": "faces", "tolerance": 1e-6}, "not-in-store", "/tolerance", "--keep-form-factors"),
        ]
        with Daemon(self.store, self.older) as daemon:
            for name, body, kind, pointer, says in cases:
                with self.subTest(body=body):
                    given = daemon.radiosity(name, body)
                    self.assertEqual(given.status, 422, given)
                    problem = given.json()
                    self.assertTrue(problem["type"].endswith("#" + kind), problem)
                    self.assertEqual(problem.get("pointer", ""), pointer, problem)
                    self.assertIn(says, problem["detail"])
            twice = daemon.radiosity("new", '{"emission":{"groups":{"ceiling":1}},"at":"faces","at":"faces"}')
            self.assertEqual((twice.status, twice.json()["type"].rpartition("#")[2]), (422, "given-twice"))
            too_large = daemon.radiosity("new", {"emission": {"groups": {"ceiling": 1e5}}, "at": "faces"}, accept="application/x-npy; dtype=f2")
            self.assertEqual((too_large.status, too_large.json()["type"].rpartition("#")[2]), (422, "not-in-encoding"))
            adjoint = daemon.post("/v1/scenes/new/adjoint", {"cotangent": {"groups": {"floor": 1}}, "at": "faces"})
            self.assertEqual((adjoint.status, adjoint.json()["pointer"]), (422, "/at"))
            self.assertIsNone(daemon.get("/v1/scenes/older").json()["faces"])

    def test_solve(self):
        again = self.path("again.h5")
        must("precompute", write_scene(self.base, "plain"), "-o", again, *QUICK, "--mesh", "faces")
        with h5py.File(again, "r+") as f:
            del f["mesh/face"], f["mesh/face_area"]
            add_checksums(f)
        self.refused(1, "the store does not know the faces of its scene file", "solve", again, "--at", "faces")
        must("solve", again)
        for wanted, *options in (("--at corners: must be one of: elements faces", "--at", "corners"),
                                 ("leave out --reduce", "--at", "faces", "--reduce", "floor=mean"),
                                 ("leave out --smooth", "--at", "faces", "--smooth", "-o", self.path("x.npy")),
                                 *(("--at faces goes into .npy, .json or .csv only", "--at", "faces", "-o", self.path("x." + extension))
                                   for extension in ("ply", "vtu", "glb"))):
            self.refused(2, wanted, "solve", self.store, *options)
        self.assertEqual(os.listdir(self.folder), ["again.h5"])


class LongAnswers(unittest.TestCase):
    def test_answers_that_are_encoded_while_they_are_sent(self):
        """Of made-up stores, of which faces are in no order; parts of elements are of others."""
        rng = np.random.default_rng(5)
        n, n_faces = 3000, 2000
        face = rng.integers(0, n_faces, n).astype(np.uint32)
        face[:100] = NONE
        parts = np.array([(i, k) for i in range(100) for k in sorted(rng.choice(n_faces, 3, replace=False))], np.uint32)
        scene = Scene(n)
        areas = np.zeros((n_faces, n))
        inside = face != NONE
        areas[face[inside], np.flatnonzero(inside)] = scene.area[inside]
        shares = rng.random(len(parts)) + .1
        areas[parts[:, 1], parts[:, 0]] = shares
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "long.h5"
            scene.write(path, "long")
            with h5py.File(path, "r+") as f:
                for name, values in {"face": face, "face_area": areas.sum(axis=1), "face_part": parts, "face_part_area": shares}.items():
                    f.create_dataset(f"mesh/{name}", data=values)
                add_checksums(f)
            E = (rng.integers(0, 64, (720, n)) / 64).astype("<f4")
            with Daemon(path) as daemon:
                whole = np.load(io.BytesIO(
                    daemon.radiosity("long", npy(E), kind="application/x-npy", accept="application/x-npy").body))
                wanted = means(areas, whole)
                self.assertTrue(np.isnan(wanted).any())
                body = {"emissions": E.tolist(), "at": "faces"}
                given = daemon.radiosity("long", body)
                self.assertGreater(len(given.body), 12 << 20)
                np.testing.assert_allclose(numbers(given.json()["radiosity"]), wanted, rtol=1.01 * SINGLE)
                for dtype in "f2", "f4", "f8":
                    array = np.load(io.BytesIO(
                        daemon.radiosity("long", body, accept=f"application/x-npy; dtype={dtype}").body))
                    np.testing.assert_allclose(array, wanted, rtol=2**-10 if dtype == "f2" else 1.01 * SINGLE)


if __name__ == "__main__":
    unittest.main()
