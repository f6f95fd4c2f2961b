"""The words of /metrics about refused requests, and the rules of Prometheus that all of it keeps."""

import json
import re
import socket
import unittest

from daemon import Daemon
from daemon_case import Case
from guard_case import metrics, until

# Of promtool's `check metrics`: names, help and types; units that are not abbreviated; "_total" for counters only.
NAME = re.compile(r"lambertd_[a-z]+(_[a-z]+)*\Z")
LABEL = re.compile(r"[a-z]+(_[a-z]+)*\Z")
ABBREVIATED = {"s", "ms", "us", "ns", "sec", "kb", "mb", "gb", "b", "milliseconds", "microseconds", "kilobytes", "kibibytes", "mebibytes",
               "minutes", "hours", "percent"}
TYPE_WORDS = {"counter", "gauge", "histogram", "summary", "metric"}
LINE = re.compile(r'([a-z_]+)(?:\{(.*)\})? (\S+)\Z')


def families(test, text):
    """{name: (type, [(sample name, labels, value)])}; the text is read strictly."""
    found, name = {}, None
    test.assertTrue(text.endswith("\n"))
    for line in text.splitlines():
        if line.startswith("# HELP "):
            _, _, name, words = line.split(" ", 3)
            test.assertNotIn(name, found)
            test.assertTrue(words.strip() and words[0].isupper() and words.endswith("."), line)
            found[name] = [None, []]
        elif line.startswith("# TYPE "):
            test.assertEqual(line.split(" ")[2], name)
            test.assertIsNone(found[name][0])
            found[name][0] = line.split(" ")[3]
        else:
            sample = LINE.match(line)
            test.assertIsNotNone(sample, line)
            labels = dict(re.findall(r'([a-z_]+)="((?:[^"\\]|\\.)*)"', sample[2] or ""))
            test.assertEqual(sample[2] or "", ",".join(f'{k}="{v}"' for k, v in labels.items()), line)
            found[name][1].append((sample[1], labels, float(sample[3])))
    return found


class Seen(Case):
    def test_the_rules_of_prometheus(self):
        path, _ = self.store()
        with Daemon(path, "--max-variants", 1) as daemon:
            daemon.radiosity("box", {"emission": [1] * 60})
            found = families(self, daemon.get("/metrics").body.decode())
        self.assertGreater(len(found), 15)
        for name, (kind, samples) in found.items():
            with self.subTest(name=name):
                words = name.split("_")
                self.assertRegex(name, NAME)
                self.assertIn(kind, ("counter", "gauge", "histogram"))
                self.assertEqual(name.endswith("_total"), kind == "counter")
                self.assertEqual(set(words) & ABBREVIATED, set())
                self.assertEqual(set(words) & TYPE_WORDS, set())
                self.assertNotIn(words[-1], ("bucket", "count", "sum", "info") if kind != "histogram" else ("bucket", "sum"))
                self.assertTrue(samples)
                series = [(n, tuple(sorted(labels.items()))) for n, labels, _ in samples]
                self.assertEqual(len(set(series)), len(series))
                for sample, labels, value in samples:
                    self.assertTrue(all(LABEL.match(label) for label in labels))
                    if kind == "histogram":
                        self.assertIn(sample, (name + "_bucket", name + "_sum", name + "_count"))
                        self.assertEqual("le" in labels, sample.endswith("_bucket"))
                    else:
                        self.assertEqual(sample, name)
                        self.assertEqual(set(labels) & {"le", "quantile"}, set())
                    self.assertGreaterEqual(value, 0)
                if kind == "histogram":
                    self.check_histogram(name, samples)

    def check_histogram(self, name, samples):
        rest = lambda labels: tuple(sorted((k, v) for k, v in labels.items() if k != "le"))
        for group in {rest(labels) for _, labels, _ in samples}:
            of = [(n, labels, v) for n, labels, v in samples if rest(labels) == group]
            buckets = [(labels["le"], v) for n, labels, v in of if n.endswith("_bucket")]
            self.assertEqual(buckets[-1][0], "+Inf")
            bounds = [float(b) for b, _ in buckets]
            self.assertEqual(bounds, sorted(bounds))
            counts = [v for _, v in buckets]
            self.assertEqual(counts, sorted(counts))
            self.assertEqual([v for n, _, v in of if n == name + "_count"], [counts[-1]])
            self.assertEqual(len([v for n, _, v in of if n == name + "_sum"]), 1)

    def test_refusals_by_cause(self):
        token = self.folder / "token"
        token.touch(0o600)
        token.write_text("all\nreader read\n")
        path, _ = self.store()
        solve, kind = "/v1/scenes/box/radiosity", {"Content-Type": "application/json"}
        with Daemon(path, "--token-file", token) as daemon:
            def count(problem):
                return metrics(daemon)[("lambertd_problems_total", ("problem", problem))]

            bearer = {"Authorization": "Bearer all"}
            for problem, ask in (("wrong-host", lambda: daemon.get("/v1/scenes", headers={"Host": "evil"})),
                                 ("wrong-origin", lambda: daemon.get("/v1/scenes", headers={"Origin": "http://evil"})),
                                 ("no-token", lambda: daemon.get("/v1/scenes")),
                                 ("no-right", lambda: daemon.ask("DELETE", "/v1/scenes/box", None, {"Authorization": "Bearer reader"})),
                                 ("malformed-head", lambda: daemon.get("/v1/scenes", headers={"X(Y": "z"})),
                                 ("media-type", lambda: daemon.ask("POST", solve, "{}", bearer)),
                                 ("not-json", lambda: daemon.ask("POST", solve, "{", {**bearer, **kind})),
                                 ("wrong-length", lambda: daemon.ask("POST", solve, json.dumps({"emission": [1]}), {**bearer, **kind})),
                                 ("not-found", lambda: daemon.get("/none"))):
                self.assertEqual(count(problem), 0, problem)
                for n in 1, 2:
                    self.assertEqual(ask().json()["type"], f"deploy/docs/api.md#{problem}")
                    until(lambda: count(problem) >= n)
                    self.assertEqual(count(problem), n)
            requests = metrics(daemon)
            self.assertEqual(requests[("lambertd_requests_total", ("route", "/v1/scenes"), ("status", "403"))], 4)
            self.assertEqual(requests[("lambertd_requests_total", ("route", "/v1/scenes"), ("status", "other"))]
                             if ("lambertd_requests_total", ("route", "/v1/scenes"), ("status", "other")) in requests else 0, 0)

    def test_requests_that_are_none(self):
        """The bytes that libmicrohttpd refuses by itself leave a trace."""
        path, _ = self.store()
        log = self.folder / "access.log"
        with Daemon(path, "--access-log", log) as daemon:
            def lines():
                return [line for line in map(json.loads, log.read_text().splitlines()) if "reason" in line]

            def total():
                return sum(v for k, v in metrics(daemon).items() if k[0] == "lambertd_malformed_requests_total")

            self.assertEqual(total(), 0)
            bad = (b"GET\r\n\r\n", b"GET /healthz HTTP/9.9\r\nHost: localhost\r\n\r\n",
                   b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Length: -5\r\n\r\n",
                   b"POST /v1/scenes/box/radiosity HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                   b"Transfer-Encoding: chunked\r\n\r\nzz\r\n",
                   b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nX: " + b"y" * 70000 + b"\r\n\r\n",
                   b"GET /" + b"y" * 70000 + b" HTTP/1.1\r\nHost: localhost\r\n\r\n")
            seen = 0
            for sent in bad:
                source = f"127.0.0.{seen + 2}"
                with socket.create_connection(("127.0.0.1", daemon.port), source_address=(source, 0)) as s:
                    s.sendall(sent)
                    answer = self.read_all(s)
                if answer.startswith(b"HTTP/1."):
                    seen += 1
                    until(lambda: total() >= seen and len(lines()) >= seen)
                    self.assertEqual(len(lines()), seen)
                    line = lines()[-1]
                    self.assertEqual((line["client"], line["status"]), (source, int(answer[9:12])), line)
                    self.assertGreater(len(line["reason"]), 3)
                    self.assertGreater(line["received"], 0)
                    self.assertLessEqual(line["received"], len(sent) + 1)  # TCP counts the end of the stream as one
                self.assertEqual(total(), seen, (sent[:60], answer[:100]))
            self.assertGreaterEqual(seen, 4)
            self.assertEqual(metrics(daemon)[("lambertd_malformed_requests_total", ("status", "other"))], 0)
            self.assertEqual(daemon.errors(), "")


if __name__ == "__main__":
    unittest.main()
