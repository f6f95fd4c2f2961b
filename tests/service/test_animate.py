"""Black box: `lambert render --animate` draws what single pictures show, with one exposure, and videos by a stand-in for
ffmpeg."""

import json
import os
import pathlib
import resource
import signal
import stat
import subprocess
import sys
import tempfile
import time
import unittest

import h5py
import numpy as np

from command import ENVIRONMENT, LAMBERT, lambert, must
from exr_file import decode_exr
from png_file import decode_png
from yard import write_yard
from patience import PATIENCE

# Joins the frames that its options name, and keeps its options beside itself. A video called refused.mp4 fails.
FFMPEG = """#!{python}
import pathlib, sys, time
at = sys.argv
pathlib.Path(at[0]).with_name("options").write_text("\\n".join(at[1:]))
value = lambda name: at[at.index(name) + 1]
if "slow" in at[-1]:
    pathlib.Path(at[0]).with_name("runs").touch()
    time.sleep(300)
if "refused" in at[-1]:
    sys.exit("first line\\nUnknown encoder 'none'\\n\\n")
frames = [open(value("-i") % k, "rb").read() for k in range(1, int(value("-frames:v")) + 1)]
open(at[-1], "wb").write(b"video" + b"".join(frames))
"""


class Animate(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="lambert-animate-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.box, cls.lamps = cls.folder / "box.h5", cls.folder / "lamps.h5"
        must("generate", "cornell", "--elements", 500, "-o", cls.folder / "box.obj")
        must("precompute", cls.folder / "box.obj", "-o", cls.box, "--method", "exact", "--rays", 256, "--probes", 0,
             "--keep-form-factors", "--quiet")
        must("precompute", cls.box, "-o", cls.lamps, "--emitters", "group=lamp,tall-block,floor", "--probes", 0, "--quiet")
        with h5py.File(cls.box) as file:
            mesh = file["mesh"]
            cls.n = len(mesh["area"])
            names = [name.decode() for name in mesh["group_names"][()]]
            cls.group = {name: mesh["group"][()] == k for k, name in enumerate(names)}
        tools = cls.folder / "tools"
        tools.mkdir()
        (tools / "ffmpeg").write_text(FFMPEG.format(python=sys.executable))
        (tools / "ffmpeg").chmod(stat.S_IRWXU)
        cls.tools = {"env": dict(ENVIRONMENT, PATH=str(tools))}

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="frames-", dir=self.folder)
        self.addCleanup(folder.cleanup)
        self.at = pathlib.Path(folder.name)

    def emission(self, name, value):
        E = np.zeros((3, self.n))
        E[:, self.group[name]] = np.broadcast_to(value, 3)[:, None]
        return E

    def save(self, array, name="frames.npy"):
        np.save(self.at / name, array)
        return self.at / name

    def animate(self, store, frames, *options, name="f.png"):
        """The bytes of the pictures, in the order of their names; no other new file is there."""
        before = set(os.listdir(self.at))
        must("render", store, "--animate", frames, "--size", "70x50", *options, "-o", self.at / name)
        new = sorted(set(os.listdir(self.at)) - before)
        found = [(self.at / file).read_bytes() for file in new]
        self.assertEqual(new, [f"{name.rpartition('.')[0]}-{k + 1:04}.png" for k in range(len(new))])
        for file in new:
            (self.at / file).unlink()
        return found

    def same(self, one, other):
        """Pictures, which are too long for the differences that unittest would look for."""
        self.assertTrue(one == other)

    def run_ffmpeg(self, *arguments):
        return subprocess.run([LAMBERT, "render", *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE,
                              check=False, **self.tools)

    def test_one_frame_is_the_picture(self):
        E = self.emission("lamp", [5, 3, 1])
        single = self.save(E, "single.npy")
        frames = self.save(E[None])
        for options in (), ("--smooth",), ("--false-color",), ("--smooth", "--quantity", "indirect", "--exposure", 1):
            found = self.animate(self.box, frames, *options)
            must("render", self.box, "--emission", single, "--size", "70x50", *options, "-o", self.at / "s.png")
            self.same(found, [(self.at / "s.png").read_bytes()])
            (self.at / "s.png").unlink()

    def test_one_exposure(self):
        E = self.emission("lamp", 4)
        dim, bright, dark, again = self.animate(self.box, self.save(np.stack([E, 4 * E, 0 * E, E])))
        self.same(dim, again)
        means = []
        for picture in dark, dim, bright:
            (self.at / "x.png").write_bytes(picture)
            means.append(decode_png(self.at / "x.png").mean())
        self.assertGreater(means[1], means[0] + 10)
        self.assertGreater(means[2], means[1] + 10)
        # Dark frames, which say nothing about exposure, do not change it.
        self.same(self.animate(self.box, self.save(np.stack([E, E, 4 * E]))), [dim, dim, bright])

    def test_batches_and_threads(self):
        """70 frames are more than one batch; every frame is of its own light."""
        weights = np.linspace(1, 2, 70)
        E = self.emission("lamp", 3)
        frames = self.save(weights[:, None, None] * E)
        found = self.animate(self.box, frames, "--smooth")
        self.assertEqual(len(found), 70)
        self.assertEqual(len(set(found)), 70)
        order = np.random.default_rng(3).permutation(70)
        shuffled = self.animate(self.box, self.save(weights[order, None, None] * E, "other.npy"), "--smooth")
        self.same(shuffled, [found[k] for k in order])
        must("render", self.box, "--animate", frames, "--size", "70x50", "--smooth", "-o", self.at / "f.png", threads=1)
        self.same([(self.at / f"f-{k:04}.png").read_bytes() for k in range(1, 71)], found)

    def test_shapes(self):
        """Two axes are frames by elements, alike in all channels."""
        grey = np.stack([self.emission("lamp", k)[0] for k in (1, 2, 3)])
        one = self.animate(self.box, self.save(grey))
        self.same(self.animate(self.box, self.save(np.repeat(grey[:, None], 3, axis=1))), one)
        listed = self.at / "list.json"
        listed.write_text(json.dumps({"emissions": [{"groups": {"lamp": k}} for k in (1, 2, 3)]}))
        self.same(self.animate(self.box, listed), one)

    def test_emitters(self):
        names = "lamp", "tall-block", "floor"
        alone = self.animate(self.lamps, "emitters", "--smooth")
        self.assertEqual(len(alone), 3)
        self.same(self.animate(self.lamps, self.save(np.eye(3)), "--smooth"), alone)
        self.same(self.animate(self.lamps, self.save(np.eye(3)[::-1]), "--smooth"), alone[::-1])
        self.same(self.animate(self.lamps, self.save(np.repeat(np.eye(3)[:, None], 3, axis=1)), "--smooth"), alone)
        listed = self.at / "list.json"
        listed.write_text(json.dumps({"emissions": [{"emitters": list(row)} for row in np.eye(3)]}))
        self.same(self.animate(self.lamps, listed, "--smooth"), alone)
        # The same light as emissions, of which the operator finds the weights, and of the other operator: not all bits.
        E = self.save(np.stack([self.emission(name, 1) for name in names]))
        self.same(self.animate(self.lamps, E, "--smooth"), alone)
        for one, other in zip(alone, self.animate(self.box, E, "--smooth")):
            (self.at / "one.png").write_bytes(one)
            (self.at / "other.png").write_bytes(other)
            # The solutions are the same to 1e-5, codes of colours to one step.
            self.assertLessEqual(np.abs(decode_png(self.at / "one.png") - decode_png(self.at / "other.png")).max(), 1)

    def test_skies(self):
        write_yard(self.at)
        store = self.at / "yard.h5"
        must("precompute", self.at / "yard.obj", "-o", store, "--elements", 150, "--rays", 256, "--probes", 0,
             "--sky", "grid:4x3", "--quiet", "--method", "exact")
        skies = np.random.default_rng(1).random((3, 12))
        sky = self.save(np.repeat(skies[:, None], 3, axis=1), "sky.npy")
        plain = self.animate(store, "sky", "--sky", sky)
        self.assertEqual(len(set(plain)), 3)
        lit = self.animate(store, "sky", "--sky", sky, "--emit", "lamp=3")
        self.assertEqual(len(set(lit + plain)), 6)
        # One sky goes with every frame of other light.
        self.save(np.repeat(skies[:1, None], 3, axis=1), "one.npy")
        (self.at / "l.json").write_text(json.dumps({"emissions": [{"groups": {"lamp": k}} for k in (3, 0)]}))
        self.assertEqual(len(set(self.animate(store, self.at / "l.json", "--sky", self.at / "one.npy"))), 2)

    def test_names(self):
        """An older, longer animation is pointed out, and nothing of it is touched."""
        E = self.emission("lamp", 1)[None]
        (self.at / "a.b-0003.png").write_text("older")
        said = must("render", self.box, "--animate", self.save(np.repeat(E, 2, axis=0)), "--size", "9x9", "-o",
                    self.at / "a.b.png").stderr
        self.assertIn("warning: ", said)
        self.assertIn("a.b-0003.png is there", said)
        self.assertIn("2 frames from", said)
        self.assertEqual(sorted(os.listdir(self.at)), [f"a.b-000{k}.png" for k in (1, 2, 3)] + ["frames.npy"])
        self.assertEqual((self.at / "a.b-0003.png").read_text(), "older")

    def test_values_of_frames(self):
        # Light is linear, and values know no exposure: the frame of a lamp twice as bright has twice the values.
        lamp = self.emission("lamp", 1)
        frames = self.save(np.array([lamp, 2 * lamp, 0 * lamp]))
        must("render", self.box, "--animate", frames, "--smooth", "--float", "--size", "50x40", "-o", self.at / "f.exr")
        self.assertEqual(sorted(path.name for path in self.at.iterdir()),
                         ["f-0001.exr", "f-0002.exr", "f-0003.exr", "frames.npy"])
        one, two, dark = (decode_exr(self.at / f"f-000{k}.exr")[0] for k in (1, 2, 3))
        for name in "RGB":
            self.assertGreater(one[name].max(), 0)
            self.assertTrue(np.allclose(two[name], 2 * one[name], rtol=1e-5, atol=1e-6 * one[name].max()))
            self.assertEqual(np.abs(dark[name]).max(), 0)

    def test_wrong_usage_is_one_line(self):
        E = self.emission("lamp", 1)
        good = self.save(E[None], "good.npy")
        negative, nan, empty, short, dark = (
            self.save(array, f"bad{k}.npy") for k, array in enumerate(
                (-E[None], E[None] * np.nan, np.zeros((0, 3, self.n)), np.ones((4, 7)), 0 * E[None])))
        image, video = self.at / "never.png", self.at / "never.mp4"
        for status, words, arguments in (
                (1, "missing.npy", [self.box, "--animate", self.at / "missing.npy", "-o", image]),
                (1, "must end in .npy or .json", [self.box, "--animate", "frames", "-o", image]),
                (1, "must not be negative", [self.box, "--animate", negative, "-o", image]),
                (1, "NaN", [self.box, "--animate", nan, "-o", image]),
                (1, "empty", [self.box, "--animate", empty, "-o", image]),
                (1, f"is (4, 7), must be (frames, {self.n}), alike in all channels, or (frames, 3, {self.n})",
                 [self.box, "--animate", short, "-o", image]),
                (1, "or weights of the 3 emitters", [self.lamps, "--animate", short, "-o", image]),
                (1, "must not be negative", [self.lamps, "--animate", self.save(-np.eye(3), "w.npy"), "-o", image]),
                (1, "no frame has any light", [self.box, "--animate", dark, "-o", image]),
                (1, "which the store's 3 emitters do not",
                 [self.lamps, "--animate", self.save(self.emission("left-wall", 1)[None], "e.npy"), "-o", image]),
                (1, "no named emitters", [self.box, "--animate", "emitters", "-o", image]),
                (1, "has no sky", [self.box, "--animate", good, "--sky", good, "-o", image]),
                (1, "nowhere", [self.box, "--animate", good, "-o", self.at / "nowhere" / "a.png"]),
                (1, "File name too long", [self.box, "--animate", good, "-o", self.at / ("a" * 240 + ".png")]),
                (2, "of the skies of --sky", [self.box, "--animate", "sky", "-o", image]),
                (2, "not both", [self.box, "--animate", good, "--emit", "lamp=1", "-o", image]),
                (2, "not both", [self.box, "--animate", good, "--emission", good, "-o", image]),
                (2, "none to animate", [self.box, "--animate", good, "--quantity", "patch", "-o", image]),
                (2, "must end in .png or .exr, or .mp4", [self.box, "--animate", good, "-o", self.at / "a.avi"]),
                (2, "must end in .png", [self.box, "-o", video]),
                (2, "--fps is for", [self.box, "--animate", good, "--fps", 20, "-o", image]),
                (2, "--fps", [self.box, "--animate", good, "--fps", 0, "-o", video]),
                (1, "give them to --animate", [self.box, "--emission", self.save(np.stack([E, E]), "two.npy"), "-o", image])):
            before = sorted(os.listdir(self.at))
            done = lambert("render", *arguments, "--size", "9x9")
            self.assertEqual(done.returncode, status, (arguments, done.stderr))
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            self.assertIn(words, done.stderr)
            self.assertEqual(sorted(os.listdir(self.at)), before)

    def test_full_disk_leaves_whole_frames(self):
        """A limit on the size of files stands for the full disk: dark frames are smaller than it, lit ones are not."""
        E = self.emission("lamp", 3)[None]
        frames = self.save(np.concatenate([0 * E, E]))
        done = lambert("render", self.box, "--animate", frames, "--size", "300x300", "--smooth", "-o", self.at / "f.png", threads=1,
                       preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192)))
        self.assertEqual(done.returncode, 1)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertIn("f-0002.png: cannot", done.stderr)
        self.assertEqual(sorted(os.listdir(self.at)), ["f-0001.png", "frames.npy"])
        decode_png(self.at / "f-0001.png")

    def test_interrupted_leaves_whole_frames(self):
        frames = self.save(np.linspace(1, 2, 500)[:, None] * self.emission("lamp", 3)[0])
        with subprocess.Popen([LAMBERT, "render", self.box, "--animate", frames, "--size", "600x600", "--smooth", "-o",
                               self.at / "f.png"], stderr=subprocess.PIPE, text=True, env=ENVIRONMENT) as process:
            until = time.monotonic() + PATIENCE
            while not (self.at / "f-0003.png").exists() and time.monotonic() < until:
                time.sleep(.02)
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 1, errors)
        found = sorted(set(os.listdir(self.at)) - {"frames.npy"})
        self.assertIn(f"cancelled; {len(found)} of 500 frames were written", errors)
        self.assertTrue(all(name.startswith("f-") and name.endswith(".png") for name in found), found)
        self.assertEqual(decode_png(self.at / found[-1]).shape[:2], (600, 600))

    def test_video(self):
        frames = self.save(np.stack([self.emission("lamp", k) for k in (1, 2, 3)]))
        for name, wanted in (("a 100%d.mp4", "bt709"), ("b.webm", "-crf"), ("c.GIF", "palettegen")):
            done = self.run_ffmpeg(self.box, "--animate", frames, "--size", "70x50", "--fps", 12.5, "-o", self.at / name)
            self.assertEqual(done.returncode, 0, done.stderr)
            stem, kind = name.rsplit(".", 1)
            pictures = b"".join((self.at / f"{stem}-000{k}.png").read_bytes() for k in (1, 2, 3))
            self.same((self.at / name).read_bytes(), b"video" + pictures)
            options = (self.folder / "tools" / "options").read_text().split("\n")
            self.assertEqual(options[options.index("-framerate") + 1], "12.5")
            self.assertEqual(options[options.index("-f") + 1], kind.lower())
            self.assertIn(wanted, "\n".join(options))
        self.assertEqual([name for name in os.listdir(self.at) if name.startswith(".")], [])

    def test_video_in_the_working_folder(self):
        """A name that looks like an option or a protocol is a file."""
        frames = self.save(self.emission("lamp", 1)[None])
        done = subprocess.run([LAMBERT, "render", self.box, "--animate", frames, "--size", "9x9", "-o", "http:a.mp4"],
                              capture_output=True, text=True, timeout=PATIENCE, check=False, cwd=self.at, **self.tools)
        self.assertEqual(done.returncode, 0, done.stderr)
        options = (self.folder / "tools" / "options").read_text().split("\n")
        self.assertEqual(options[options.index("-i") + 1], "./http:a-%04d.png")
        self.assertTrue(options[-1].startswith("./"), options[-1])
        self.assertTrue((self.at / "http:a.mp4").read_bytes().startswith(b"video"))

    def test_no_video(self):
        """Without ffmpeg, or where it fails, one line says so, frames stay and an older video does."""
        frames = self.save(self.emission("lamp", 1)[None])
        for name, words, environment in (("a.mp4", "is not installed", dict(ENVIRONMENT, PATH=str(self.at))),
                                         ("refused.mp4", "Unknown encoder 'none'", self.tools["env"])):
            (self.at / name).write_text("older")
            done = subprocess.run([LAMBERT, "render", self.box, "--animate", frames, "--size", "9x9", "-o", self.at / name],
                                  capture_output=True, text=True, timeout=PATIENCE, check=False, env=environment)
            self.assertEqual(done.returncode, 1, done.stderr)
            said = [line for line in done.stderr.splitlines() if line.startswith("lambert render: ")]
            self.assertEqual(len(said), 1, done.stderr)
            for word in words, name, "the numbered pictures are there":
                self.assertIn(word, said[0])
            self.assertEqual((self.at / name).read_text(), "older")
            self.assertTrue((self.at / name.replace(".mp4", "-0001.png")).exists())
        self.assertEqual([name for name in os.listdir(self.at) if name.startswith(".")], [])

    def test_interrupted_video(self):
        frames = self.save(self.emission("lamp", 1)[None])
        runs = self.folder / "tools" / "runs"
        with subprocess.Popen([LAMBERT, "render", self.box, "--animate", frames, "--size", "9x9", "-o", self.at / "slow.mp4"],
                              stderr=subprocess.PIPE, text=True, **self.tools) as process:
            until = time.monotonic() + PATIENCE
            while not runs.exists() and time.monotonic() < until:
                time.sleep(.02)
            process.send_signal(signal.SIGTERM)
            _, errors = process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 1, errors)
        self.assertIn("cancelled; 1 of 1 frames were written", errors)
        self.assertEqual(sorted(os.listdir(self.at)), ["frames.npy", "slow-0001.png"])


if __name__ == "__main__":
    unittest.main()
