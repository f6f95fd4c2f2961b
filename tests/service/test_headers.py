"""Headers of answers: codings, entity tags, request ids; and /metrics as Prometheus reads it."""

import gzip
import io
import json
import pathlib
import re
import signal
import tempfile
import time
import unittest

import numpy as np
from prometheus_client.parser import text_string_to_metric_families

from codings import DECODERS, unzstd
from daemon import PATIENCE, Daemon
from make_store import Scene

N = 3000


class Headers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.path = cls.folder / "box.h5"
        cls.scene = Scene(N)
        # Every element reflects a little, or the zeros among the numbers would make them shrink.
        cls.scene.rho[:, ::7] = 0.5
        cls.scene.core = np.stack([np.linalg.inv(np.eye(5) - cls.scene.V.T @ (r[:, None] * cls.scene.U)) for r in cls.scene.rho])
        cls.scene.write(cls.path, "box")
        cls.log = cls.folder / "access.log"
        cls.daemon = Daemon(cls.path, "--access-log", cls.log)
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)
        cls.E = np.random.default_rng(1).random(N).astype("<f4")
        cls.body = json.dumps({"emission": cls.E.tolist()})

    def ask(self, accept_encoding, path="/v1/scenes/box/radiosity", body=None, accept=None, **headers):
        if accept_encoding is not None:
            headers["Accept-Encoding"] = accept_encoding
        if accept is not None:
            headers["Accept"] = accept
        if path.endswith("radiosity"):
            return self.daemon.ask("POST", path, body or self.body, {"Content-Type": "application/json", **headers})
        return self.daemon.get(path, headers=headers)

    def test_json_is_coded_when_asked_for(self):
        plain = self.ask(None).json()
        for asked, coding in ((None, None), ("", None), ("identity", None), ("gzip", "gzip"), ("zstd", "zstd"),
                              ("gzip, deflate, br, zstd", "zstd"), ("gzip;q=1, zstd;q=0.5", "gzip"), ("br", None),
                              ("*", "zstd"), ("zstd;q=0, *", "gzip"), ("gzip;q=0", None), ("identity;q=0, gzip", "gzip")):
            with self.subTest(asked=asked):
                answer = self.ask(asked)
                self.assertEqual((answer.status, answer.headers["Content-Encoding"]), (200, coding))
                self.assertEqual(answer.headers["Vary"], "Accept-Encoding")
                self.assertEqual(int(answer.headers["Content-Length"]), len(answer.body))
                told = json.loads(DECODERS[coding](answer.body))
                self.assertEqual(told["radiosity"], plain["radiosity"])

    def test_what_does_not_pay_is_not_coded(self):
        # Short: nothing is saved.
        short = json.dumps({"emission": {"groups": {"lamp": 1}}, "select": {"elements": [1]}})
        # Numbers as they are in memory hardly shrink.
        for body, accept in ((short, None), (self.body, "application/x-npy"), ("{", None)):
            for asked in "gzip", "zstd":
                self.assertIsNone(self.ask(asked, body=body, accept=accept).headers["Content-Encoding"])
        # But those that are mostly alike do.
        dark = json.dumps({"emission": [0] * N})
        answer = self.ask("zstd", body=dark, accept="application/x-npy")
        self.assertEqual(answer.headers["Content-Encoding"], "zstd")
        self.assertEqual(np.abs(np.load(io.BytesIO(unzstd(answer.body)))).max(), 0)
        # A client that takes nothing else gets it coded, whatever that saves.
        answer = self.ask("gzip, identity;q=0", body=short)
        self.assertEqual(len(json.loads(gzip.decompress(answer.body))["radiosity"]), 1)

    def test_bodies_of_requests_are_not_decoded(self):
        for coding in "gzip", "zstd", "br":
            answer = self.ask(None, **{"Content-Encoding": coding})
            self.assertEqual(answer.status, 415)
            self.assertIn("Content-Encoding", answer.json()["detail"])

    def test_tags(self):
        for path in "/v1/scenes", "/v1/scenes/box", "/v1/openapi.json":
            seen = set()
            for asked in None, "gzip", "zstd":
                first = self.ask(asked, path)
                tag, coding = first.headers["ETag"], first.headers["Content-Encoding"]
                self.assertRegex(tag, r'^"[0-9a-f]{16}(-gzip|-zstd)?"$')
                self.assertEqual(self.ask(asked, path).headers["ETag"], tag)
                self.assertEqual(tag.endswith(f'-{coding}"'), coding is not None)
                seen.add((tag, coding))
                for listed in (tag, f"W/{tag}", f'"x", {tag}', f'"a,b",{tag},"c"', "*", f',, {tag} ,'):
                    again = self.ask(asked, path, **{"If-None-Match": listed})
                    self.assertEqual((again.status, again.body, again.headers["ETag"]), (304, b"", tag), listed)
                    self.assertEqual(again.headers["Vary"], "Accept-Encoding")
                for listed in ('"x"', tag.strip('"'), f'{tag[:-1]}', f'"{tag[1:]}"'[:-2] + 'x"', '"', "W/", "", '""', "x, y"):
                    again = self.ask(asked, path, **{"If-None-Match": listed})
                    self.assertEqual((again.status, again.body), (200, first.body), listed)
                head = self.daemon.ask("HEAD", path, None, {"Accept-Encoding": asked or "identity"})
                self.assertEqual((head.status, head.body, head.headers["ETag"]), (200, b"", tag))
            self.assertEqual(len(seen), len({tag for tag, _ in seen}))
        # Not of what is asked for anew, nor of problems.
        for answer in self.ask(None), self.ask(None, "/metrics"), self.ask(None, "/v1/scenes/none"):
            self.assertIsNone(answer.headers["ETag"])
        self.assertEqual(self.ask(None, "/v1/scenes/none", **{"If-None-Match": "*"}).status, 404)

    def test_a_tag_changes_with_the_scene(self):
        path = self.folder / "other.h5"
        Scene(20).write(path, "other")
        with Daemon(path) as daemon:
            tags = [daemon.get(p).headers["ETag"] for p in ("/v1/scenes", "/v1/scenes/other")]
            Scene(21).write(path, "other")
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded: 1 scene")
            for tag, p in zip(tags, ("/v1/scenes", "/v1/scenes/other")):
                answer = daemon.get(p, headers={"If-None-Match": tag})
                self.assertEqual(answer.status, 200)
                self.assertNotEqual(answer.headers["ETag"], tag)

    def lines_of(self, ids):
        """The lines of the access log by their ids. A thread writes them, some time after the answers."""
        end = time.monotonic() + PATIENCE
        while True:
            whole = self.log.read_text().rpartition("\n")[0]
            lines = {e["id"]: e for e in map(json.loads, whole.splitlines()) if e["id"] in ids}
            if len(lines) == len(set(ids)):
                return lines
            self.assertLess(time.monotonic(), end, set(ids) - set(lines))
            time.sleep(.005)

    def test_request_ids(self):
        made, known = [], []
        for own in "a", "x" * 64, "2026-11-22T10:00:00.5_a+b/c=", "0af7651916cd43dd8448eb211c80319c":
            for path in "/healthz", "/v1/scenes/none", "/v1/scenes/box/radiosity":
                self.assertEqual(self.ask(None, path, **{"X-Request-Id": own}).headers["X-Request-Id"], own)
                known.append(own)
        for own in None, "", "x" * 65, "a b", 'a"b', "a\tb", "é", "a;b", "<a>":
            headers = {} if own is None else {"X-Request-Id": own}
            made.append(self.ask(None, "/healthz", **headers).headers["X-Request-Id"])
            self.assertRegex(made[-1], r"^[0-9a-f]{12}-\d+$")
        self.assertEqual(len(set(made)), len(made))
        self.assertEqual(len(self.lines_of(known + made)), len(set(known + made)))
        with Daemon(self.path) as other:
            self.assertNotEqual(other.get("/healthz").headers["X-Request-Id"].split("-")[0], made[0].split("-")[0])

    def test_the_log_knows_codings(self):
        self.ask("zstd", **{"X-Request-Id": "coded"})
        self.ask(None, **{"X-Request-Id": "plain"})
        lines = self.lines_of(("coded", "plain"))
        self.assertEqual((lines["coded"]["coding"], lines["plain"]["coding"]), ("zstd", "identity"))
        self.assertLess(lines["coded"]["sent"], lines["plain"]["sent"])

    def test_metrics_are_read_by_prometheus(self):
        with Daemon(self.path) as daemon:
            connection = daemon.connect()
            for _ in range(3):
                daemon.radiosity("box", self.body, connection=connection)
            daemon.radiosity("box", "{", connection=connection)
            daemon.get("/none", connection=connection)
            daemon.get("/v1/scenes", headers={"If-None-Match": "*"}, connection=connection)
            answer = daemon.get("/metrics", connection=connection)
            self.assertEqual(answer.headers["Content-Type"], "text/plain; version=0.0.4; charset=utf-8")
            text = answer.body.decode()
            self.assertTrue(text.endswith("\n"))
            families = {f.name: f for f in text_string_to_metric_families(text)}
            connection.close()
        kinds = {"lambertd_requests": "counter", "lambertd_request_duration_seconds": "histogram",
                 "lambertd_batch_size": "histogram", "lambertd_in_flight": "gauge", "lambertd_queued": "gauge",
                 "lambertd_body_bytes": "gauge", "lambertd_scenes": "gauge", "lambertd_operator_bytes": "gauge",
                 "lambertd_mapped_bytes": "gauge", "lambertd_scenes_damaged": "gauge", "lambertd_stores_refused": "gauge",
                 "lambertd_scenes_unverified": "gauge", "lambertd_connections": "gauge", "lambertd_connections_most": "gauge",
                 "lambertd_connections_cut": "counter", "lambertd_access_log_lost": "counter",
                 "lambertd_queue_wait_seconds": "histogram", "lambertd_refining": "gauge", "lambertd_solves_refused": "counter"}
        kinds |= {"lambertd_problems": "counter", "lambertd_connections_refused": "counter", "lambertd_malformed_requests": "counter",
                  "lambertd_verified_timestamp_seconds": "gauge", "lambertd_reload_success": "gauge",
                  "lambertd_connections_lingering": "gauge"}
        kinds |= {"lambertd_request_memory_bytes": "gauge", "lambertd_request_memory_limit_bytes": "gauge",
                  "lambertd_request_memory_refused": "counter", "lambertd_request_memory_waiting": "gauge",
                  "lambertd_request_memory_waited": "counter", "lambertd_kept_memory_bytes": "gauge"}
        self.assertEqual({name: f.type for name, f in families.items()}, kinds)
        for family in families.values():
            self.assertTrue(family.documentation)
            self.assertTrue(family.samples, family.name)
            keys = [(s.name, tuple(sorted(s.labels.items()))) for s in family.samples]
            self.assertEqual(len(set(keys)), len(keys))
        # Every line is a comment, a sample or nothing: what the parser leaves out is not said.
        for line in text.splitlines():
            self.assertRegex(line, r'^(# (HELP|TYPE) [a-z_]+ .+|[a-z_]+(\{([a-z_]+="[^"\\\n]*",?)+\})? [-+.0-9e]+|)$')
        counts = {(s.labels["route"], s.labels["status"]): s.value for s in families["lambertd_requests"].samples}
        self.assertEqual(counts, {("/v1/scenes/{name}/radiosity", "200"): 3, ("/v1/scenes/{name}/radiosity", "400"): 1,
                                  ("other", "404"): 1, ("/v1/scenes", "304"): 1})
        # Each solve waited once, whether passes followed (three) or its body was refused.
        waits = {s.name: s.value for s in families["lambertd_queue_wait_seconds"].samples}
        self.assertEqual(waits["lambertd_queue_wait_seconds_count"], 4)
        for name in "lambertd_request_duration_seconds", "lambertd_batch_size", "lambertd_queue_wait_seconds":
            series = {}
            for s in families[name].samples:
                series.setdefault(s.labels.get("route"), {}).setdefault(re.sub(f"^{name}_", "", s.name), []).append(s)
            for found in series.values():
                bounds = [float(s.labels["le"]) for s in found["bucket"]]
                values = [s.value for s in found["bucket"]]
                self.assertEqual((bounds, values), (sorted(bounds), sorted(values)))
                self.assertEqual((bounds[-1], values[-1]), (np.inf, found["count"][0].value))
                self.assertGreater(found["sum"][0].value, 0)
        self.assertEqual(families["lambertd_connections"].samples[0].value, 1)
        self.assertGreater(families["lambertd_operator_bytes"].samples[0].value, N * 5 * 4)


if __name__ == "__main__":
    unittest.main()
