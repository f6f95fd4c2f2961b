"""GET / and the files of the viewer: types, policy, tags, compression; a daemon without it says how to get it."""
import gzip
import pathlib
import re
import tempfile
import unittest

from daemon import Daemon
from make_store import Scene

FILES = {"/": "text/html", "/viewer.js": "text/javascript", "/viewer.css": "text/css", "/viewer.svg": "image/svg+xml",
         "/viewer.txt": "text/plain"}


class Viewer(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.path = pathlib.Path(folder.name) / "box.h5"
        cls.tokens = pathlib.Path(folder.name) / "tokens"
        cls.tokens.write_text("secret read\n")
        Scene(12).write(cls.path, "box")

    def daemon(self, *arguments):
        daemon = Daemon(self.path, *arguments)
        self.addCleanup(daemon.__exit__, None, None, None)
        return daemon

    def test_its_files(self):
        daemon = self.daemon("--token-file", self.tokens)
        if daemon.get("/viewer.js").status == 404:
            page = daemon.get("/")
            self.assertEqual(page.status, 200)
            self.assertIn(b"-DLAMBERT_VIEWER=ON", page.body)
            self.skipTest("this daemon was built without the viewer")
        for path, kind in FILES.items():
            with self.subTest(path=path):
                plain = daemon.get(path)
                self.assertEqual((plain.status, plain.headers["Content-Type"].split(";")[0]), (200, kind))
                self.assertEqual(plain.headers["X-Content-Type-Options"], "nosniff")
                self.assertNotIn("Content-Encoding", plain.headers)
                for accepted in ("gzip", "zstd, gzip", "*"):
                    packed = daemon.ask("GET", path, None, {"Accept-Encoding": accepted})
                    self.assertEqual(packed.headers["Content-Encoding"], "gzip")
                    self.assertEqual(gzip.decompress(packed.body), plain.body)
                    self.assertNotEqual(packed.headers["ETag"], plain.headers["ETag"])
                for refused in ("zstd", "gzip;q=0", "identity, gzip;q=.5"):
                    self.assertEqual(daemon.ask("GET", path, None, {"Accept-Encoding": refused}).body, plain.body)
                again = daemon.ask("GET", path, None, {"If-None-Match": plain.headers["ETag"]})
                self.assertEqual((again.status, again.body), (304, b""))
                self.assertEqual(daemon.ask("HEAD", path).body, b"")
        self.assertEqual(daemon.get("/v1/scenes").status, 401)

    def test_the_page_asks_its_own_origin_only(self):
        page = self.daemon().get("/")
        policy = dict(part.split(" ", 1) for part in page.headers["Content-Security-Policy"].split("; "))
        self.assertEqual(policy["default-src"], "'none'")
        for what in ("script-src", "style-src", "connect-src"):
            self.assertEqual(policy[what], "'self'")
        text = page.body.decode()
        self.assertEqual(re.findall(r"<script(?![^>]*\bsrc=)|<style|\bstyle=|\bon\w+=", text), [])
        links = re.findall(r'(?:src|href)="([^"]*)"', text)
        self.assertEqual(sorted(links), ["v1/openapi.json", "viewer.css", "viewer.js", "viewer.svg"])
        # The script names no path from the root of the host either: the page may stand below any path of a proxy.
        self.assertEqual(re.findall(rb"[\"'`]/(?:v1|readyz|viewer)\b", self.daemon().get("/viewer.js").body), [])

    def test_links_of_the_page_that_says_why(self):
        text = self.daemon("--no-viewer").get("/").body.decode()
        self.assertEqual(re.findall(r'(?:src|href)="([^"]*)"', text), ["v1/scenes", "v1/openapi.json"])

    def test_without_it(self):
        daemon = self.daemon("--no-viewer")
        page = daemon.get("/")
        self.assertEqual(page.status, 200)
        self.assertIn(b"--no-viewer", page.body)
        for path in FILES.keys() - {"/"}:
            self.assertEqual(daemon.get(path).status, 404)


if __name__ == "__main__":
    unittest.main()
