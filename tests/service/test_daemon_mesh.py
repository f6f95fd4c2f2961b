"""GET /v1/scenes/NAME/mesh: binary glTF of what the store holds, its tag, codings, memory and variants."""

import gzip
import json
import os
import re
import shutil
import signal
import threading
import unittest

import h5py
import numpy as np

import glb
from codings import unzstd
from command import must
from daemon import Daemon
from daemon_case import Case
from guard_case import metrics
from make_store import Scene

TOKEN = "s3cret"


class Mesh(Case):
    def scene(self, *generate, name="scene", **options):
        """The store of a generated scene."""
        path = self.folder / f"{name}.h5"
        must("generate", *generate, "-o", self.folder / f"{name}.obj")
        must("precompute", self.folder / f"{name}.obj", "-o", path, "--quiet", "--probes", 0,
             *(part for key, value in options.items() for part in (f"--{key.replace('_', '-')}", value)))
        return path

    @staticmethod
    def mesh(daemon, name, coding=None, **more):
        headers = {"Accept-Encoding": coding} if coding else {}
        return daemon.get(f"/v1/scenes/{name}/mesh", headers={**headers, **more.pop("headers", {})}, **more)

    def test_it_has_what_the_store_has(self):
        stores = [self.scene("cornell", "--elements", 400, name="cornell"),
                  self.scene("cornell", "--elements", 300, "--closed", name="grey"),
                  self.scene("city", "--elements", 300, name="city", max_edge=40),
                  self.scene("box", "--divisions", 3, name="turned", up="x")]
        Scene(60, channels=4).write(self.folder / "four.h5", "four", kind="exact")  # its areas are not those of its corners
        with Daemon(*stores, self.folder / "four.h5") as daemon:
            for path in *stores, self.folder / "four.h5":
                answer = self.mesh(daemon, path.stem)
                self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, "model/gltf-binary"), answer)
                found = glb.check(self, answer.body, path)
                self.assertEqual(found.about["name"], path.stem)
                self.assertEqual(found.about["kind"], daemon.get(f"/v1/scenes/{path.stem}").json()["kind"])
                if path in stores:
                    with h5py.File(path, "r") as f:
                        area = f["mesh/area"][()].sum()
                    self.assertAlmostEqual(sum(g.areas().sum() for g in found.groups.values()) / area, 1, places=5)

    def test_both_sides(self):
        self.scene("cornell", "--elements", 300, name="box")
        path = self.folder / "sides.h5"
        must("precompute", self.folder / "box.obj", "-o", path, "--quiet", "--probes", 0, "--two-sided", "--up", "y")
        with Daemon(f"{path}:sides") as daemon:
            found = glb.check(self, self.mesh(daemon, "sides").body, path)
        names = list(found.groups)
        fronts, backs = names[:len(names) // 2], names[len(names) // 2:]
        self.assertEqual(backs, [name + ".back" for name in fronts])
        for front, back in zip(fronts, backs):
            front, back = found.groups[front], found.groups[back]
            np.testing.assert_allclose(front.normal.sum(axis=0), -back.normal.sum(axis=0), atol=1e-3)
            self.assertFalse(front.material["doubleSided"] or back.material["doubleSided"])

    def test_our_importer_reads_it(self):
        path = self.scene("rooms", "--elements", 600, name="rooms")
        file, back = self.folder / "back.glb", self.folder / "back.h5"
        with Daemon(path) as daemon:
            file.write_bytes(self.mesh(daemon, "rooms").body)
        must("precompute", file, "-o", back, "--quiet", "--probes", 0)
        with h5py.File(path, "r") as a, h5py.File(back, "r") as b:
            triangles = (a["mesh/elements"][()] != glb.NO_VERTEX).sum() - 2 * len(a["mesh/elements"])
            self.assertEqual(len(b["mesh/elements"]), triangles)
            self.assertAlmostEqual(b["mesh/area"][()].sum() / a["mesh/area"][()].sum(), 1, places=6)
            self.assertEqual(set(b["mesh/group_names"][()]), set(a["mesh/group_names"][()]))
            for name in a["mesh/group_names"][()]:
                of = [f["mesh/group_names"][()].tolist().index(name) for f in (a, b)]
                areas = [f["mesh/area"][()][f["mesh/group"][()] == g].sum() for f, g in zip((a, b), of)]
                self.assertAlmostEqual(areas[1] / areas[0], 1, places=5)
                rho = [f["mesh/reflectance"][()][:, f["mesh/group"][()] == g].mean() for f, g in zip((a, b), of)]
                self.assertAlmostEqual(rho[1], rho[0], places=5)
                lit = [f["mesh/emission"][()][:, f["mesh/group"][()] == g].mean() for f, g in zip((a, b), of)]
                self.assertAlmostEqual(lit[1], lit[0], delta=1e-5 * lit[0])

    def test_codings_and_tags(self):
        path, _ = self.store(n=2000)
        with Daemon(path) as daemon:
            plain = self.mesh(daemon, "box")
            tags = set()
            for coding, decode in ("gzip", gzip.decompress), ("zstd", lambda raw: unzstd(raw, len(plain.body))), (None, bytes):
                for _ in range(2):
                    answer = self.mesh(daemon, "box", coding)
                    self.assertEqual((answer.status, answer.headers["Content-Encoding"]), (200, coding))
                    self.assertEqual(decode(answer.body), plain.body)
                    self.assertEqual((answer.headers["Cache-Control"], answer.headers["Vary"]), ("no-cache", "Accept-Encoding"))
                    self.assertRegex(answer.headers["ETag"], '^"[^"]+"$')
                    tags.add(answer.headers["ETag"])
                for listed in answer.headers["ETag"], "*", '"other", W/' + answer.headers["ETag"]:
                    known = self.mesh(daemon, "box", coding, headers={"If-None-Match": listed})
                    self.assertEqual((known.status, known.body, known.headers["ETag"]), (304, b"", answer.headers["ETag"]))
                head = daemon.ask("HEAD", "/v1/scenes/box/mesh", headers={"Accept-Encoding": coding or "identity"})
                self.assertEqual((head.status, head.body, head.headers["ETag"]), (200, b"", answer.headers["ETag"]))
                self.assertEqual(head.headers["Content-Length"], str(len(answer.body)))
            self.assertEqual(len(tags), 3)
            wrong = daemon.post("/v1/scenes/box/mesh", "{}")
            self.assertEqual((wrong.status, wrong.headers["Allow"]), (405, "GET, HEAD"))
            self.assertEqual(self.mesh(daemon, "nothing").status, 404)
        with Daemon(path) as daemon:  # a client may know the mesh of a daemon that ended
            connection = daemon.connect()
            self.addCleanup(connection.close)
            for tag in tags:
                coding = tag[1:-1].partition("-")[2] or None
                known = self.mesh(daemon, "box", coding, headers={"If-None-Match": tag}, connection=connection)
                self.assertEqual((known.status, known.body), (304, b""))
            self.assertEqual(self.mesh(daemon, "box", connection=connection).body, plain.body)
        with Daemon(f"{path}:other") as daemon:
            self.assertNotIn(self.mesh(daemon, "other").headers["ETag"], tags)

    def test_names_of_any_language(self):
        names = ["kitchen.Tür", "床", 'a "b"\\c', "lamp 💡"]
        path = self.folder / "Küche 3.h5"
        Scene(60, groups=names).write(path)
        with Daemon(path) as daemon:
            answer = self.mesh(daemon, "K%C3%BCche%203")
            self.assertEqual(answer.status, 200, answer)
            self.assertEqual(glb.check(self, answer.body, path).about["name"], "Küche 3")

    def test_variants_have_their_reflectances(self):
        path = self.folder / "colour.h5"
        scene = Scene(60, channels=3)
        scene.write(path, "colour", keep_factors=True)
        (self.folder / "token").write_text(TOKEN)
        token = {"Authorization": f"Bearer {TOKEN}"}
        with Daemon(path, "--max-variants", 2, "--token-file", self.folder / "token") as daemon:
            tags = [self.mesh(daemon, "colour", headers=token).headers["ETag"]]
            for variant, groups in ("red", {"wall": [.6, .1, .1]}), ("dark", {"wall": .05, "box": .1}):
                answer = daemon.ask("PUT", "/v1/scenes/colour/reflectance", json.dumps({"variant": variant, "groups": groups}),
                                    {"Content-Type": "application/json", **token})
                while (answer := daemon.get(f"/v1/scenes/colour@{variant}", headers=token)).status == 202:
                    pass
                self.assertEqual(answer.status, 200, answer)
                answer = self.mesh(daemon, f"colour@{variant}", headers=token)
                rho = scene.relit(groups).rho.astype(np.float32)
                found = glb.check(self, answer.body, path, reflectance=rho)
                self.assertEqual(found.about["name"], f"colour@{variant}")
                tags.append(answer.headers["ETag"])
            self.assertEqual(len(set(tags)), 3)
            self.assertEqual(self.mesh(daemon, "colour").status, 401)

    def test_a_reload_has_the_new_mesh(self):
        path, _ = self.store(n=60)
        other, _ = self.store("other.h5", n=90)
        keep = shutil.copy(path, self.folder / "keep.h5")
        with Daemon(path) as daemon:
            first = self.mesh(daemon, "box")
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: ")
            self.assertEqual(self.mesh(daemon, "box").headers["ETag"], first.headers["ETag"])
            os.replace(other, path)
            # A form that is kept, and one that is made from it, are those of the store that is served.
            self.assertEqual(gzip.decompress(self.mesh(daemon, "box", "gzip").body), first.body)
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: ", 2)
            second = self.mesh(daemon, "box")
            self.assertNotEqual(second.headers["ETag"], first.headers["ETag"])
            self.assertEqual(glb.check(self, second.body, path).about["elements"], 90)
            os.replace(keep, path)
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: ", 3)
            os.remove(path)
            lost = self.mesh(daemon, "box")
            self.assertEqual((lost.status, lost.headers["Retry-After"]), (503, "1"), lost)
            self.assertNotIn(str(self.folder), lost.json()["detail"])
            self.assertEqual(daemon.radiosity("box", {"emission": {"groups": {"lamp": 1}}}).status, 200)

    def held(self, daemon):
        found = metrics(daemon)
        return found[("lambertd_kept_memory_bytes",)], found[("lambertd_request_memory_bytes",)]

    def sizes(self, path):
        """Bytes that a daemon of one thread holds without a mesh, and the mesh, plain and by gzip."""
        with Daemon(path, "--threads", 1) as daemon:
            before = self.held(daemon)[0]
            plain = self.mesh(daemon, "box")
            taken = self.held(daemon)[0] - before
            self.assertAlmostEqual(taken, len(plain.body), delta=64)
            packed = self.mesh(daemon, "box", "gzip")
            self.assertAlmostEqual(self.held(daemon)[0] - before - taken, len(packed.body), delta=64)
        return int(before), plain.body, packed.body

    def test_within_max_memory(self):
        """A form that has no room is made for its request alone: without the store there is none any more."""
        path, _ = self.store(n=3000)
        spare = shutil.copy(path, self.folder / "spare")
        before, plain, packed = self.sizes(path)
        for room, form in ((len(plain) // 2, len(packed)), (len(plain) + len(packed) // 2, len(plain))):
            shutil.copy(spare, path)
            with Daemon(path, "--threads", 1, "--max-memory", before + room) as daemon:
                for _ in range(2):
                    self.assertEqual(self.mesh(daemon, "box").body, plain)
                    self.assertEqual(gzip.decompress(self.mesh(daemon, "box", "gzip").body), plain)
                held, requests = self.held(daemon)
                self.assertAlmostEqual(held - before, form if form <= room else 0, delta=64)
                self.assertEqual(requests, 0)
                os.remove(path)
                self.assertEqual(self.mesh(daemon, "box").status, 200 if form == len(plain) else 503)
                self.assertEqual(self.mesh(daemon, "box", "gzip").status, 200)
                self.assertEqual(self.mesh(daemon, "box", "zstd").status, 200 if form == len(plain) else 503)

    def test_a_mesh_gives_its_room_to_a_store(self):
        path, _ = self.store(n=3000)
        before, plain, packed = self.sizes(path)
        folder = self.folder / "stores"
        folder.mkdir()
        shutil.copy(path, folder / "box.h5")
        with Daemon(path, f"{path}:later", "--threads", 1) as daemon:
            alone = self.held(daemon)[0] - before
        # While it is read, a store has the groups of its elements twice, and their names.
        limit = before + max(len(plain), int(alone)) + 4 * 3000 + 1000
        with Daemon("--stores", folder, "--threads", 1, "--max-memory", limit) as daemon:
            self.assertEqual(self.mesh(daemon, "box").body, plain)
            self.assertGreater(self.held(daemon)[0], before)
            os.replace(shutil.copy(path, self.folder / "later.h5"), folder / "later.h5")
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: 2 scenes")
            self.assertEqual(self.names(daemon), ["box", "later"])
            self.assertEqual(self.held(daemon)[0], before + alone)
            self.assertEqual(self.mesh(daemon, "box").body, plain)
            self.assertEqual(daemon.errors(), "")

    def limit_for(self, refused):
        """The --max-request-memory that has room for this request: a request alone has three quarters of it."""
        self.assertEqual(refused.status, 422, refused)
        found = re.search(r"takes (\d+) bytes of memory, at most 786432 \(", refused.json()["detail"])
        return int(found.group(1)) * 4 // 3 + 4

    def test_within_max_request_memory(self):
        path, _ = self.store(n=30000)
        with Daemon(path, "--threads", 1, "--max-request-memory", "1M") as daemon:
            refused = self.mesh(daemon, "box")
            self.assertEqual(self.held(daemon)[1], 0)
            needed = self.limit_for(refused)
        with Daemon(path, "--threads", 1, "--max-request-memory", needed) as daemon:
            self.assertEqual(self.mesh(daemon, "box").status, 200)
            self.assertEqual(self.mesh(daemon, "box", "zstd").status, 200)
            self.assertEqual(self.held(daemon)[1], 0)

    def test_requests_wait_for_memory(self):
        """Room for one that makes the mesh, and none to keep it: the others wait, and make it anew."""
        path, _ = self.store(n=20000)
        with Daemon(path, "--threads", 2) as daemon:
            before = self.held(daemon)[0]
        limit = ("--threads", 2, "--max-memory", int(before) + 1000, "--max-request-memory")
        with Daemon(path, *limit, "1M") as daemon:
            needed = self.limit_for(self.mesh(daemon, "box", "gzip"))
        answers = [None] * 9
        with Daemon(path, *limit, needed) as daemon:
            def ask(k):
                answers[k] = self.mesh(daemon, "box", ("gzip", "zstd", None)[k % 3])
            clients = [threading.Thread(target=ask, args=(k,)) for k in range(len(answers))]
            for c in clients:
                c.start()
            for c in clients:
                c.join()
            self.assertEqual({a.status for a in answers}, {200}, [a for a in answers if a.status != 200])
            self.assertEqual(len({a.body for a in answers}), 3)
            self.assertEqual(self.held(daemon), (before, 0))

    def test_a_deadline_that_has_passed(self):
        """Nothing is made for nobody, and the next request finds no trace of it."""
        path, _ = self.store(n=3000)
        with Daemon(path, "--threads", 1) as daemon:
            before = self.held(daemon)
            late = self.mesh(daemon, "box", headers={"Lambert-Timeout": "1e-9"})
            self.assertEqual(late.status, 503, late)
            self.assertIn("was not ready in time", late.json()["detail"])
            self.assertEqual(self.held(daemon), before)
            self.assertEqual(self.mesh(daemon, "box").status, 200)

    def test_many_at_once(self):
        """The first demand of 24 clients: one answer for all, and what is kept is one of each coding."""
        path, _ = self.store(n=20000)
        codings = (None, "gzip", "zstd")
        answers = [None] * 24
        with Daemon(path, "--threads", 2) as daemon:
            before = self.held(daemon)[0]
            begin = threading.Barrier(len(answers))

            def ask(k):
                begin.wait()
                answers[k] = self.mesh(daemon, "box", codings[k % 3])

            clients = [threading.Thread(target=ask, args=(k,)) for k in range(len(answers))]
            for c in clients:
                c.start()
            for c in clients:
                c.join()
            self.assertEqual({a.status for a in answers}, {200})
            self.assertEqual(len({a.body for a in answers}), 3)
            kept = sum(len(body) for body in {a.body for a in answers})
            self.assertAlmostEqual(self.held(daemon)[0] - before, kept, delta=256)
            self.assertEqual(self.held(daemon)[1], 0)
            self.assertEqual(daemon.errors(), "")
        glb.check(self, answers[0].body, path)


if __name__ == "__main__":
    unittest.main()
