"""GET /v1/scenes/NAME/elements and .../groups: columns of numbers beside those of the store, in every encoding."""

import gzip
import io
import json
import os
import re
import shutil
import signal
import threading
import unittest
import zipfile

import h5py
import numpy as np

from codings import unzstd
from command import must
from daemon import Daemon
from daemon_case import Case
from guard_case import metrics
from make_store import NO_VERTEX, Scene, add_checksums

TOKEN = "s3cret"
FIELDS = ("area", "normal", "centre", "group", "face", "reflectance")
TYPES = {"area": "<f8", "normal": "<f4", "centre": "<f4", "group": "<u4", "face": "<i4", "reflectance": "<f4"}
JSON, NPY, ZIP = "application/json", "application/x-npy", "application/zip"
JSON_MOST = 65536


def centre_of(corners):
    """The area centroid of a flat polygon, by the triangles that its corners make with its first edge's middle."""
    apex = corners[:2].mean(axis=0)
    ring = np.roll(corners, -1, axis=0)
    normals = np.cross(corners - apex, ring - apex)
    weights = normals @ normals.sum(axis=0)
    return (((corners + ring + apex) / 3) * weights[:, None]).sum(axis=0) / weights.sum()


def columns_of(path):
    """The columns of a store, by h5py."""
    with h5py.File(path, "r") as f:
        mesh = {name: values[()] for name, values in f["mesh"].items()}
    vertices, elements = mesh["vertices"], mesh["elements"]
    n = len(elements)
    face = mesh.get("face", np.full(n, NO_VERTEX, np.uint32))
    rho = mesh["reflectance"]
    return {"area": mesh["area"], "normal": mesh["normal"], "group": mesh["group"],
            "centre": np.array([centre_of(vertices[e[e != NO_VERTEX]]) for e in elements]),
            "face": np.where(face == NO_VERTEX, -1, face.astype(np.int64)).astype(np.int32),
            "reflectance": rho[0] if len(rho) == 1 else rho,
            "names": [name.decode() for name in mesh["group_names"]]}


class Elements(Case):
    def scene(self, *generate, name="scene", **options):
        """The store of a generated scene."""
        path = self.folder / f"{name}.h5"
        must("generate", *generate, "-o", self.folder / f"{name}.obj")
        must("precompute", self.folder / f"{name}.obj", "-o", path, "--quiet", "--probes", 0,
             *(part for key, value in options.items() for part in (f"--{key.replace('_', '-')}", value)))
        return path

    @staticmethod
    def elements(daemon, name, fields=None, accept=None, coding=None, **more):
        headers = {"Accept": accept, "Accept-Encoding": coding, **more.pop("headers", {})}
        query = f"?fields={','.join(fields)}" if fields else ""
        return daemon.get(f"/v1/scenes/{name}/elements{query}", headers={k: v for k, v in headers.items() if v}, **more)

    def arrays(self, answer):
        """The members of a ZIP, which Python's own reader finds sound."""
        self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, ZIP), answer)
        with zipfile.ZipFile(io.BytesIO(answer.body)) as archive:
            self.assertIsNone(archive.testzip())
            self.assertEqual({m.compress_type for m in archive.infolist()}, {zipfile.ZIP_STORED})
        with np.load(io.BytesIO(answer.body)) as found:
            return {name: found[name] for name in found.files}

    def same(self, field, found, wanted, scale):
        """Bit for bit, but for centres: half a float's unit in the last place of a coordinate, and roundings in double."""
        self.assertEqual((found.dtype.str, found.shape), (TYPES[field], wanted.shape), field)
        if field == "centre":
            np.testing.assert_allclose(found, wanted, rtol=0, atol=scale * 2**-23)
        else:
            np.testing.assert_array_equal(found, wanted)

    def check(self, daemon, name, path, wanted=None):
        """Every field in every encoding, alone and with the others."""
        wanted = wanted or columns_of(path)
        n, scale = len(wanted["area"]), np.abs(wanted["centre"]).max()
        all_of_them = self.arrays(self.elements(daemon, name, accept=ZIP))
        self.assertEqual(tuple(all_of_them), FIELDS)
        told = self.elements(daemon, name)
        self.assertEqual((told.status, told.headers["Content-Type"]), (200, JSON), told)
        about = told.json()
        self.assertEqual(tuple(about), ("scene", "elements", "channels", "unit", "groups", *FIELDS))
        self.assertEqual([about[key] for key in ("scene", "elements", "unit", "groups")], [name, n, "m", wanted["names"]])
        self.assertEqual(about["channels"], daemon.get(f"/v1/scenes/{name}").json()["channels"])
        self.assertEqual(about["area"], wanted["area"].tolist())  # the shortest decimals read back as the same doubles
        for field in FIELDS:
            self.same(field, all_of_them[field], wanted[field], scale)
            alone = self.elements(daemon, name, [field], NPY)
            self.assertEqual((alone.status, alone.headers["Content-Type"]), (200, NPY), alone)
            self.same(field, np.load(io.BytesIO(alone.body)), wanted[field], scale)
            self.assertEqual(alone.body, zipfile.ZipFile(io.BytesIO(self.elements(daemon, name, [field], ZIP).body)).read(f"{field}.npy"))
            one = self.elements(daemon, name, [field]).json()
            self.assertEqual(one[field], about[field])
            self.assertFalse(set(FIELDS) - {field} & set(one) and set(FIELDS) & set(one) - {field})
            if field == "face":
                self.assertEqual([-1 if f is None else f for f in one[field]], wanted[field].tolist())
            else:
                self.same(field, np.array(one[field], TYPES[field]), wanted[field], scale)
        return all_of_them

    def test_it_has_what_the_store_has(self):
        stores = [self.scene("cornell", "--elements", 200, name="quads"),
                  self.scene("city", "--elements", 300, name="city", max_edge=40),
                  self.scene("box", "--divisions", 3, name="turned", up="x")]
        self.scene("cornell", "--elements", 200, name="box")
        sides = self.folder / "sides.h5"
        must("precompute", self.folder / "box.obj", "-o", sides, "--quiet", "--probes", 0, "--two-sided")
        with Daemon(*stores, sides) as daemon:
            seen = set()
            for path in *stores, sides:
                self.check(daemon, path.stem, path)
                with h5py.File(path, "r") as f:
                    seen |= {(len(f["mesh/reflectance"]), int((e != NO_VERTEX).sum())) for e in f["mesh/elements"][()]}
                    self.assertGreater(f["mesh/face"][()].max(), 0)
            self.assertGreaterEqual(seen, {(3, 4)})
            # Faces are those of answers by face, and areas, groups and normals those of the mesh in glTF.
            answer = daemon.radiosity("quads", {"emission": {"groups": {"lamp": 1}}, "at": "faces"}).json()
            faces = self.arrays(self.elements(daemon, "quads", ["face"], ZIP))["face"]
            self.assertEqual(faces.max() + 1, len(np.atleast_2d(answer["radiosity"])[0]))

    def test_triangles_and_channels(self):
        for channels in 1, 3, 4:
            Scene(60, channels=channels).write(self.folder / f"c{channels}.h5", kind="exact")
        with Daemon(*(self.folder / f"c{channels}.h5" for channels in (1, 3, 4))) as daemon:
            for channels in 1, 3, 4:
                found = self.check(daemon, f"c{channels}", self.folder / f"c{channels}.h5")
                self.assertEqual(found["reflectance"].shape, (60,) if channels == 1 else (channels, 60))
                self.assertTrue((found["face"] == -1).all())  # such a store does not know them

    def test_names_of_any_language(self):
        path = self.folder / "Küche 3.h5"
        Scene(60, groups=["kitchen.Tür", "床", 'a "b"\\c', "lamp 💡"]).write(path)
        with Daemon(path) as daemon:
            for what in "elements", "groups":
                about = daemon.get(f"/v1/scenes/K%C3%BCche%203/{what}").json()
                self.assertEqual(about["scene"], "Küche 3")
                names = [g["name"] if what == "groups" else g for g in about["groups"]]
                self.assertEqual(names, ["kitchen.Tür", "床", 'a "b"\\c', "lamp 💡"])

    def test_fields_of_a_query(self):
        path, _ = self.store()
        with Daemon(path) as daemon:
            get = lambda query, **headers: daemon.get(f"/v1/scenes/box/elements{query}", headers=headers)
            both = get("?fields=group,area").json()
            self.assertEqual([key for key in both if key in FIELDS], ["area", "group"])  # in their own order
            for query in "?fields=area,group", "?fields=area%2Cgroup", "?%66ields=%61rea,group", "?fields=area,grou%70":
                self.assertEqual(get(query).json(), both, query)
            for query in "", "?", "?fields=reflectance,face,group,centre,normal,area":
                self.assertEqual(tuple(get(query).json())[5:], FIELDS, query)
            known = "area, normal, centre, group, face, reflectance"
            for query, kind, words in (
                    ("?fields=colour", "unknown-word", f'fields[0] is "colour", must be one of {known}'),
                    ("?fields=area,Area", "unknown-word", f'fields[1] is "Area", must be one of {known}'),
                    ("?fields=area,", "unknown-word", 'fields[1] is ""'),
                    ("?fields=are%2561", "unknown-word", 'fields[0] is "are%61"'),  # escapes are resolved once
                    ("?fields=area%00", "unknown-word", 'fields[0] is "area%00"'),
                    ("?fields=area%2", "unknown-word", 'fields[0] is "area%2"'),
                    ("?fields=are%zz", "unknown-word", 'fields[0] is "are%zz"'),
                    ("?fields=area+group", "unknown-word", "area group"),
                    ("?fields=" + "x" * 9000, "unknown-word", "x" * 60),
                    ("?fields=area,normal,area", "given-twice", 'fields[2] gives "area" a second time'),
                    ("?fields=area&fields=area", "given-twice", "fields a second time"),
                    ("?fields=", "wrong-length", f"fields is empty, must list some of {known}"),
                    ("?fields", "wrong-length", "fields is empty"),
                    ("?field=area", "wrong-members", 'the query has "field", may have fields alone'),
                    ("?fields=area&unit=ft", "wrong-members", '"unit"'),
                    ("?=area", "wrong-members", '""')):
                answer = get(query)
                self.assertEqual((answer.status, answer.headers["ETag"]), (422, None), query)
                self.assertEqual(answer.json()["type"], f"deploy/docs/api.md#{kind}", query)
                self.assertIn(words, answer.json()["detail"])
                self.assertNotIn("\n", answer.json()["detail"])
            for query, accept, words in (("?fields=area,group", NPY, f"holds one field; ask for one of {known}"), ("", NPY, "holds one field"),
                                         ("?fields=area", NPY + "; dtype=f4", "leave dtype out of Accept")):
                answer = get(query, Accept=accept)
                self.assertEqual((answer.status, answer.json()["type"]), (422, "deploy/docs/api.md#not-in-encoding"))
                self.assertIn(words, answer.json()["detail"])
            for accept, kind in ((f"{ZIP};q=.5, {NPY}", NPY), (f"{NPY};q=.5, {ZIP}", ZIP), (f"{ZIP}, {JSON}", ZIP), (f"{JSON}, {ZIP}", JSON),
                                 (f"{ZIP};q=0", JSON), ("*/*", JSON), ("text/html", JSON), (f"{JSON};q=.3, {ZIP};q=.4, {NPY};q=.4", ZIP)):
                answer = get("?fields=area", Accept=accept)
                self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, kind), accept)
                self.assertEqual(answer.headers["Vary"], "Accept, Accept-Encoding")

    def test_other_routes_go_on_without_a_query(self):
        path, _ = self.store()
        with Daemon(path) as daemon:
            for route in "/v1/scenes", "/v1/scenes/box", "/v1/scenes/box/sky", "/v1/scenes/box/groups", "/healthz":
                self.assertEqual(daemon.get(route + "?fields=colour&x").body, daemon.get(route).body, route)
            self.assertEqual(daemon.get("/v1/scenes/none/elements?x=1").status, 404)
            self.assertEqual(daemon.ask("OPTIONS", "/v1/scenes/box/elements?x=1").status, 204)
            wrong = daemon.post("/v1/scenes/box/elements", "{}")
            self.assertEqual((wrong.status, wrong.headers["Allow"]), (405, "GET, HEAD"))
            with daemon.raw() as s:  # the absolute form of a target
                s.sendall(b"GET http://127.0.0.1/v1/scenes/box/elements?fields=face HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n")
                self.assertIn(b'"face":[null,', self.read_all(s))

    def test_codings_and_tags(self):
        path, _ = self.store(n=2000)
        decoders = {"gzip": gzip.decompress, None: bytes}
        with Daemon(path) as daemon:
            tags = {}
            for fields, accept in ((None, None), (["area"], None), (["area"], NPY), (["normal"], NPY), (None, ZIP), (["normal"], ZIP)):
                plain = self.elements(daemon, "box", fields, accept)
                for coding in "gzip", "zstd", None:
                    for _ in range(2):
                        answer = self.elements(daemon, "box", fields, accept, coding)
                        self.assertEqual((answer.status, answer.headers["Content-Encoding"]), (200, coding))
                        decode = decoders.get(coding, lambda raw: unzstd(raw, len(plain.body)))
                        self.assertEqual(decode(answer.body), plain.body)
                        self.assertEqual(answer.headers["Cache-Control"], "no-cache")
                    tag = answer.headers["ETag"]
                    known = self.elements(daemon, "box", fields, accept, coding, headers={"If-None-Match": tag})
                    self.assertEqual((known.status, known.body, known.headers["ETag"]), (304, b"", tag))
                    query = "?fields=" + ",".join(fields) if fields else ""
                    head = daemon.ask("HEAD", f"/v1/scenes/box/elements{query}",
                                      headers={"Accept": accept or "*/*", "Accept-Encoding": coding or "identity"})
                    self.assertEqual((head.status, head.body, head.headers["ETag"]), (200, b"", tag))
                    self.assertEqual(head.headers["Content-Length"], str(len(answer.body)))
                    tags[tag] = fields, accept, coding
            self.assertEqual(len(tags), 18)
            self.assertEqual(daemon.get("/v1/scenes/box/elements?fields=area", headers={"If-None-Match": ", ".join(tags)}).status, 304)
        with Daemon(path) as daemon:  # a client may know the elements of a daemon that ended
            for tag, (fields, accept, coding) in tags.items():
                known = self.elements(daemon, "box", fields, accept, coding, headers={"If-None-Match": tag})
                self.assertEqual((known.status, known.body), (304, b""))

    def test_json_has_a_limit(self):
        """Of one element more the answer names the encodings that hold it."""
        names = []
        for n in JSON_MOST, JSON_MOST + 1:
            path, _ = self.store(f"n{n}.h5", n=n)
            names.append(path)
        with Daemon(*names) as daemon:
            self.assertEqual(len(self.elements(daemon, f"n{JSON_MOST}", ["area", "face"]).json()["area"]), JSON_MOST)
            above = f"n{JSON_MOST + 1}"
            refused = self.elements(daemon, above, ["area"])
            self.assertEqual((refused.status, refused.json()["type"]), (422, "deploy/docs/api.md#not-in-encoding"))
            for words in str(JSON_MOST + 1), str(JSON_MOST), ZIP, NPY:
                self.assertIn(words, refused.json()["detail"])
            with h5py.File(names[1], "r") as f:
                np.testing.assert_array_equal(self.arrays(self.elements(daemon, above, accept=ZIP))["area"], f["mesh/area"][()])

    def test_variants_have_their_reflectances(self):
        path = self.folder / "colour.h5"
        scene = Scene(60, channels=3)
        scene.write(path, "colour", keep_factors=True)
        (self.folder / "token").write_text(TOKEN)
        token = {"Authorization": f"Bearer {TOKEN}"}
        with Daemon(path, "--max-variants", 2, "--token-file", self.folder / "token") as daemon:
            tags = {kind: [self.elements(daemon, "colour", accept=kind, headers=token).headers["ETag"]] for kind in (JSON, ZIP)}
            base = daemon.get("/v1/scenes/colour/groups", headers=token)
            for variant, groups in ("red", {"wall": [.6, .1, .1]}), ("dark", {"wall": .05, "box": .1}):
                daemon.ask("PUT", "/v1/scenes/colour/reflectance", json.dumps({"variant": variant, "groups": groups}),
                           {"Content-Type": JSON, **token})
                while (answer := daemon.get(f"/v1/scenes/colour@{variant}", headers=token)).status == 202:
                    pass
                self.assertEqual(answer.status, 200, answer)
                relit = scene.relit(groups)
                answer = self.elements(daemon, f"colour@{variant}", accept=ZIP, headers=token)
                wanted = {**columns_of(path), "reflectance": relit.rho.astype(np.float32)}
                for field, found in self.arrays(answer).items():
                    self.same(field, found, wanted[field], 1)
                tags[ZIP].append(answer.headers["ETag"])
                answer = self.elements(daemon, f"colour@{variant}", headers=token)
                self.assertEqual(answer.json()["scene"], f"colour@{variant}")
                tags[JSON].append(answer.headers["ETag"])
                told = daemon.get(f"/v1/scenes/colour@{variant}/groups", headers=token).json()
                self.check_groups(told, path, relit.rho)
                self.assertEqual([g["emission"] for g in told["groups"]], [g["emission"] for g in base.json()["groups"]])
            for kind in tags:
                self.assertEqual(len(set(tags[kind])), 3)
            for what in "elements", "groups":
                self.assertEqual(daemon.get(f"/v1/scenes/colour/{what}").status, 401)

    def check_groups(self, told, path, rho=None):
        with h5py.File(path, "r") as f:
            mesh = {name: values[()] for name, values in f["mesh"].items()}
            lights = f["mesh"].attrs.get("lights", b"W").decode()
        n, rho, counted = len(mesh["area"]), mesh["reflectance"] if rho is None else rho, np.ones(len(mesh["area"]), bool)
        counted[mesh.get("buried", [])] = False
        self.assertEqual(tuple(told), ("scene", "elements", "channels", "lights", "units", "groups"))
        self.assertEqual((told["elements"], told["channels"], told["lights"]), (n, len(rho), lights))
        self.assertEqual(told["units"], {"area": "m2", "emission": f"{lights}/m2"})
        self.assertEqual([g["name"].encode() for g in told["groups"]], mesh["group_names"].tolist())
        for k, group in enumerate(told["groups"]):
            self.assertEqual(tuple(group), ("name", "area", "elements", "reflectance", "emission", "buried"))
            of = mesh["group"] == k
            self.assertEqual((group["elements"], group["buried"]), (of.sum(), (of & ~counted).sum()))
            A = mesh["area"] * (of & counted)
            # Sums of n doubles, in another order.
            self.assertAlmostEqual(group["area"], A.sum(), delta=n * 2**-53 * A.sum())
            for name, x in ("reflectance", rho), ("emission", mesh["emission"]):
                if A.sum() == 0:
                    self.assertEqual(group[name], [None] * len(rho))
                else:
                    np.testing.assert_allclose(group[name], x @ A / A.sum(), rtol=4 * n * 2**-53)

    def test_groups(self):
        stores = [self.scene("cornell", "--elements", 200, name="colour"),
                  self.scene("cornell", "--elements", 200, "--closed", name="grey", lights="lm")]
        path, scene = self.store("unlike.h5", n=90, channels=4, kind="exact")
        with h5py.File(path, "r+") as f:
            f["mesh/emission"][:] = np.random.default_rng(1).random((4, 90))
            f["mesh"].create_dataset("buried", data=np.concatenate(
                [np.flatnonzero(scene.group == 0), np.flatnonzero(scene.group == 2)[:3]]).astype(np.uint32))
            f["mesh/buried"][:] = np.sort(f["mesh/buried"][()])
            add_checksums(f)
        with Daemon(*stores, path) as daemon:
            for path in *stores, path:
                answer = daemon.get(f"/v1/scenes/{path.stem}/groups")
                self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, JSON), answer)
                self.check_groups(answer.json(), path)
                about = daemon.get(f"/v1/scenes/{path.stem}").json()
                self.assertEqual(answer.json()["lights"], about["lights"])
                known = daemon.get(f"/v1/scenes/{path.stem}/groups", headers={"If-None-Match": answer.headers["ETag"]})
                self.assertEqual((known.status, known.body), (304, b""))
            lamp = next(g for g in daemon.get("/v1/scenes/colour/groups").json()["groups"] if g["name"] == "lamp")
            self.assertGreater(min(lamp["emission"]), 0)
            self.assertTrue(any(g["buried"] and g["area"] for g in answer.json()["groups"]))
            packed = daemon.get("/v1/scenes/unlike/groups", headers={"Accept-Encoding": "gzip"})
            self.assertEqual(gzip.decompress(packed.body), answer.body)
            self.assertEqual(daemon.ask("HEAD", "/v1/scenes/unlike/groups").headers["Content-Length"], str(len(answer.body)))

    def test_a_reload_has_the_new_elements(self):
        """A client that kept an answer finds that the store is another one, though its shape is the same."""
        path, scene = self.store(n=60)
        keep = shutil.copy(path, self.folder / "keep.h5")
        others = []
        for k, change in enumerate((lambda s: s.rho.__setitem__((0, 3), .25), lambda s: s.area.__setitem__(3, 9), lambda s: s.group.__setitem__(30, (s.group[30] + 1) % 5))):
            other = Scene(60)
            change(other)
            other.write(self.folder / f"other{k}.h5")
            others.append(self.folder / f"other{k}.h5")
        with Daemon(path) as daemon:
            first = self.elements(daemon, "box", accept=ZIP)
            tags, told = {first.headers["ETag"]}, {daemon.get("/v1/scenes/box/groups").headers["ETag"]}
            posts = (("radiosity", {"emission": {"groups": {"lamp": 1}}, "reduce": {"groups": ["lamp"], "with": ["mean"]}}), ("radiosity", {"emission": {"groups": {"lamp": 1}}}),
                     ("adjoint", {"cotangent": {"groups": {"lamp": 1}}}), ("jacobian", {"of": {"groups": ["lamp"]}}), ("radiosity", {}))

            def scene_tag():
                """That of answers of every kind, errors included, which is one."""
                answers = [self.elements(daemon, "box", ["area"]), daemon.get("/v1/scenes/box"), *(daemon.post("/v1/scenes/box/" + route, body) for route, body in posts)]
                self.assertEqual([answer.status for answer in answers], [200] * 6 + [422])
                tag, = {answer.headers["Lambert-Scene"] for answer in answers}
                self.assertRegex(tag, '^"[0-9a-f]{16}"$')
                return tag

            scenes = {scene_tag()}
            self.assertIsNone(daemon.get("/v1/scenes").headers["Lambert-Scene"])
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: ")
            self.assertEqual(self.elements(daemon, "box", accept=ZIP).headers["ETag"], first.headers["ETag"])
            self.assertEqual({scene_tag()}, scenes)
            for k, other in enumerate(others):
                shutil.copy(other, self.folder / "spare")
                os.replace(self.folder / "spare", path)
                daemon.signal(signal.SIGHUP)
                daemon.wait_for("reloaded: ", 2 + k)
                answer = self.elements(daemon, "box", accept=ZIP, headers={"If-None-Match": first.headers["ETag"]})
                for field, values in self.arrays(answer).items():
                    self.same(field, values, columns_of(other)[field], 1)
                tags.add(answer.headers["ETag"])
                told.add(daemon.get("/v1/scenes/box/groups").headers["ETag"])
                scenes.add(scene_tag())
            self.assertEqual((len(tags), len(told), len(scenes)), (4, 4, 4))
            os.replace(keep, path)
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: ", 5)
            shutil.copy(others[0], self.folder / "spare")
            os.replace(self.folder / "spare", path)
            # It is not read yet. Columns that the scene holds are its own; its geometry is gone.
            held = self.elements(daemon, "box", ["area", "reflectance"], ZIP)
            np.testing.assert_array_equal(self.arrays(held)["area"], scene.area)
            for field in "normal", "centre":
                lost = self.elements(daemon, "box", [field], NPY)
                self.assertEqual((lost.status, lost.headers["Retry-After"]), (503, "1"), lost)
                self.assertIn("another one than was read", lost.json()["detail"])
                self.assertNotIn(str(self.folder), lost.json()["detail"])
            os.remove(path)
            self.assertEqual(self.elements(daemon, "box", ["normal"], NPY).status, 503)
            self.assertEqual(daemon.radiosity("box", {"emission": {"groups": {"lamp": 1}}}).status, 200)

    def held(self, daemon):
        found = metrics(daemon)
        return found[("lambertd_kept_memory_bytes",)], found[("lambertd_request_memory_bytes",)]

    def test_what_is_kept_has_a_limit(self):
        """Each answer is made once; the eight that were asked for last stay."""
        path, _ = self.store(n=3000)
        with Daemon(path, "--threads", 1) as daemon:
            before = self.held(daemon)[0]
            lengths = []
            for k in range(1, 12):
                fields = [field for bit, field in enumerate(FIELDS) if k >> bit & 1]
                lengths.append(len(self.elements(daemon, "box", fields, ZIP).body))
                self.assertAlmostEqual(self.held(daemon)[0] - before, sum(lengths[-8:]), delta=64 * 8)
            self.assertEqual(self.held(daemon)[1], 0)
            os.remove(path)
            self.assertEqual(self.elements(daemon, "box", FIELDS[:2] + FIELDS[3:4], ZIP).status, 200)  # the last of them
            self.assertEqual(self.elements(daemon, "box", ["normal"], ZIP).status, 503)

    def test_within_max_memory(self):
        """An answer that has no room is made for its request alone."""
        path, _ = self.store(n=3000)
        with Daemon(path, "--threads", 1) as daemon:
            before = int(self.held(daemon)[0])
            whole = self.elements(daemon, "box", accept=ZIP).body
        with Daemon(path, "--threads", 1, "--max-memory", before + len(whole) // 2) as daemon:
            for _ in range(2):
                self.assertEqual(self.elements(daemon, "box", accept=ZIP).body, whole)
                self.assertEqual(self.held(daemon), (before, 0))

    def test_within_max_request_memory(self):
        path, _ = self.store(n=60000)
        for accept, fields in (ZIP, None), (NPY, ["centre"]), (JSON, ["area", "reflectance"]):
            with Daemon(path, "--threads", 1, "--max-request-memory", "1M") as daemon:
                refused = self.elements(daemon, "box", fields, accept)
                self.assertEqual(refused.status, 422, refused)
                found = re.search(r"takes (\d+) bytes of memory, at most 786432 \(", refused.json()["detail"])
                self.assertEqual(self.held(daemon)[1], 0)
                needed = int(found.group(1)) * 4 // 3 + 4
            with Daemon(path, "--threads", 1, "--max-request-memory", needed) as daemon:
                for coding in None, "zstd":
                    self.assertEqual(self.elements(daemon, "box", fields, accept, coding).status, 200)
                self.assertEqual(self.held(daemon)[1], 0)

    def test_a_deadline_that_has_passed(self):
        path, _ = self.store(n=3000)
        with Daemon(path, "--threads", 1) as daemon:
            before = self.held(daemon)
            late = self.elements(daemon, "box", headers={"Lambert-Timeout": "1e-9"})
            self.assertEqual(late.status, 503, late)
            self.assertIn("was not ready in time", late.json()["detail"])
            self.assertEqual(self.held(daemon), before)
            self.assertEqual(self.elements(daemon, "box").status, 200)

    def test_many_at_once(self):
        """The first demand of 24 clients, of more answers than are kept: all are those of a client alone."""
        path, _ = self.store(n=5000)
        asked = [(fields, accept) for fields in (["area"], ["normal"], ["centre"], ["group", "face"], None) for accept in (JSON, ZIP)]
        with Daemon(path, "--threads", 2) as daemon:
            wanted = [self.elements(daemon, "box", *ask).body for ask in asked]
        answers = [None] * 24
        with Daemon(path, "--threads", 2) as daemon:
            begin = threading.Barrier(len(answers))

            def ask(k):
                begin.wait()
                answers[k] = self.elements(daemon, "box", *asked[k % len(asked)], (None, "gzip")[k % 2])

            clients = [threading.Thread(target=ask, args=(k,)) for k in range(len(answers))]
            for c in clients:
                c.start()
            for c in clients:
                c.join()
            for k, answer in enumerate(answers):
                body = gzip.decompress(answer.body) if k % 2 else answer.body
                self.assertEqual((answer.status, body), (200, wanted[k % len(asked)]))
            self.assertEqual(self.held(daemon)[1], 0)
            self.assertEqual(daemon.errors(), "")


if __name__ == "__main__":
    unittest.main()
