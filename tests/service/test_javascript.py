"""Lambert's client in JavaScript beside a daemon, by Node.js' own tests in javascript/, and its package in an empty folder."""

import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

from command import must
from daemon import Daemon
from lambert_python import ROOT, TOKEN, make_stores
from patience import PATIENCE

TESTS = pathlib.Path(__file__).resolve().parent / "javascript"
NODE, NPM = shutil.which("node"), shutil.which("npm")


@unittest.skipUnless(NODE, "Node.js is not installed")
class JavaScript(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="lambert-javascript-"))

    def node(self, *arguments, **environment):
        done = subprocess.run([NODE, *arguments], cwd=self.folder, capture_output=True, text=True, timeout=PATIENCE, check=False,
                              env={**os.environ, **environment})
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def run_tests(self, name, **environment):
        self.assertRegex(self.node("--test", TESTS / f"{name}.test.mjs", **environment), r"pass [1-9]")

    def test_its_parts(self):
        self.run_tests("parts")

    def test_scenes(self):
        stores = make_stores(self.folder, ("box", "paint", "office", "yard"))
        tokens = pathlib.Path(self.folder, "tokens")
        tokens.write_text(TOKEN)
        tokens.chmod(0o600)
        with Daemon(*stores.values(), "--token-file", tokens, "--max-variants", 4) as daemon:
            self.run_tests("scene", ADDRESS=f"http://127.0.0.1:{daemon.port}", TOKEN=TOKEN)

    def test_trouble(self):
        """Rooms: a, b of another geometry, c of other reflectances."""
        for name, size, reflectance in (("a", "1,1,1", .5), ("b", "1,1,2", .5), ("c", "1,1,1", .2)):
            files = [pathlib.Path(self.folder, f"{name}.{kind}") for kind in ("obj", "h5")]
            must("generate", "box", "--divisions", 3 if name != "b" else 4, "--size", size, "-o", files[0])
            must("precompute", files[0], "--reflectance", reflectance, "--probes", 0, "-o", files[1], "--quiet")
        self.run_tests("trouble", FOLDER=self.folder)

    @unittest.skipUnless(NPM, "npm is not installed")
    def test_package(self):
        """As npm packs it, in a folder with nothing else."""
        about = json.loads((ROOT / "deploy" / "js" / "package.json").read_text())
        cmake = (ROOT / "CMakeLists.txt").read_text()
        self.assertIn(f"VERSION {about['version']}", cmake)
        own = {**os.environ, "npm_config_cache": os.path.join(self.folder, "cache"), "npm_config_update_notifier": "false"}

        def npm(*arguments):
            return subprocess.run([NPM, *arguments, "--offline"], cwd=self.folder, capture_output=True, text=True, timeout=PATIENCE, check=True, env=own).stdout

        packed = json.loads(npm("pack", "--json", ROOT / "deploy" / "js"))[0]
        self.assertEqual(sorted(file["path"] for file in packed["files"]), ["README.md", "lambert.d.ts", "lambert.js", "openapi.d.ts", "package.json"])
        pathlib.Path(self.folder, "package.json").write_text("{}")
        npm("install", "--no-audit", "--no-fund", os.path.join(".", packed["filename"]))
        said = self.node("--input-type=module", "-e",
                         'import { connect, open } from "lambert-light"; console.log(await connect("http://127.0.0.1:1").health(), typeof open)')
        self.assertEqual(said, "false function\n")


if __name__ == "__main__":
    unittest.main(verbosity=2)
