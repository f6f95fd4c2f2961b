"""deploy/examples/godot lights a mesh in Godot, headless: its colours are the light of a plain request."""

import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import numpy as np

from command import must
from daemon import Daemon
from patience import PATIENCE

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "deploy" / "examples" / "godot" / "lit_mesh.gd"
GODOT = shutil.which("godot3-server")
DRIVER = """extends SceneTree

var node = null

func _initialize():
	node = load(OS.get_environment("SCRIPT")).new()
	node.port = int(OS.get_environment("PORT"))
	node.scene = "box"
	node.token = "secret"
	node.exposure = 0.5
	get_root().add_child(node)
	node.connect("lit", self, "_lit")
	for emission in OS.get_environment("EMISSIONS").split(";"):
		node.light(emission)

func _lit():
	var arrays = node.get_child(0).mesh.surface_get_arrays(0)
	for i in range(node._vertices.size()):
		var at = arrays[Mesh.ARRAY_VERTEX][i]
		var c = arrays[Mesh.ARRAY_COLOR][i]
		print("vertex %d %f %f %f %f %f %f" % [node._vertices[i][2], at.x, at.y, at.z, c.r, c.g, c.b])
	print("triangles %d" % (arrays[Mesh.ARRAY_INDEX].size() / 3))
	quit()

func _idle(_delta):
	if node.problem != "":
		print("problem ", node.problem)
		quit()
"""


@unittest.skipUnless(GODOT, "godot3-server is not installed")
class Godot(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        scene, store, tokens, driver = (pathlib.Path(cls.folder, name) for name in ("box.obj", "box.h5", "tokens", "driver.gd"))
        must("generate", "cornell", "--elements", 100, "-o", scene)
        must("precompute", scene, "--mesh", "faces", "--probes", 0, "-o", store, "--quiet")
        tokens.write_text("secret")
        tokens.chmod(0o600)
        driver.write_text(DRIVER)
        cls.daemon = cls.enterClassContext(Daemon(store, "--token-file", tokens))

    def run_script(self, *emissions, port=None):
        done = subprocess.run([GODOT, "-s", os.path.join(self.folder, "driver.gd")], cwd=self.folder, capture_output=True, text=True,
                              timeout=PATIENCE, check=False,
                              env={**os.environ, "HOME": self.folder, "SCRIPT": str(SCRIPT), "PORT": str(port or self.daemon.port), "EMISSIONS": ";".join(emissions)})
        self.assertNotIn("SCRIPT ERROR", done.stdout + done.stderr)
        return [line.split() for line in done.stdout.splitlines() if line.strip()]

    def test_its_colours_are_the_light(self):
        light = {"groups": {"lamp": [17, 12, 4]}}
        lines = self.run_script(json.dumps({"groups": {"lamp": 1}}), json.dumps(light))
        vertices = np.array([line[1:] for line in lines if line[:1] == ["vertex"]], float)
        answer = self.daemon.radiosity("box", {"emission": light}, headers={"Authorization": "Bearer secret"}).json()
        n, wanted = answer["elements"], np.array(answer["radiosity"]) / 2
        self.assertEqual(set(vertices[:, 0]), set(range(n)))
        triangles = int(next(line[1] for line in lines if line[:1] == ["triangles"]))
        self.assertEqual(triangles, len(vertices) - 2 * n)  # an element of k vertices is k - 2 of them
        # A mesh keeps colours in 8 bits, and nothing brighter than 1.
        np.testing.assert_allclose(vertices[:, 4:], wanted.clip(0, 1)[:, vertices[:, 0].astype(int)].T, atol=1 / 255)

    def test_problems_are_told(self):
        told = " ".join(self.run_script(json.dumps({"groups": {"lmap": 1}}))[-1])
        self.assertRegex(told, r'^problem .*did you mean')
        with Daemon(os.path.join(self.folder, "box.h5")) as gone:
            port = gone.port
        told = " ".join(self.run_script("{}", port=port)[-1])
        self.assertEqual(told, f"problem the daemon at 127.0.0.1:{port} does not answer")


if __name__ == "__main__":
    unittest.main(verbosity=2)
