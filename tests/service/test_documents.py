"""README and manual: every command in them runs, every link leads somewhere, every option and file they name exists.

Blocks of a document are one script, run in an empty folder. ```sh runs as it stands. ```sh slow runs on small scenes
(--elements at most 600, suites of bench with --quick). ```sh elsewhere is run by .ci/run: the test looks the line up
there. A ```json block is the answer that the request before it has to get, up to times and rounding. A ```python block is a
program behind the first one of its page, with the package of the tree; ```python NAME runs where the module NAME is installed.
"""
import importlib.util
import json
import math
import os
import pathlib
import re
import shutil
import socket
import subprocess
import tempfile
import unittest

import weather
from patience import PATIENCE

ROOT = pathlib.Path(__file__).resolve().parents[2]
MANUAL = ROOT / "deploy" / "docs"
DOCUMENTS = [path.resolve() for path in (ROOT / "README.md", *sorted(MANUAL.glob("*.md")))]
LAMBERT, LAMBERTD = os.environ["LAMBERT"], os.environ["LAMBERTD"]
PORT_IN_DOCUMENTS = "127.0.0.1:8317"
PACKAGE = {"PYTHONPATH": str(ROOT / "deploy" / "python"), "PYTHONDONTWRITEBYTECODE": "1"}  # as if it were installed
# Options of other programs that the documents name.
FOREIGN = {"--once", "--all", "--data-binary", "--fail-with-body", "--target", "--build", "--prefix", "--cflags", "--libs", "--install", "--preset", "--static", "--test-dir"}

# Configurations of proxies, which test_proxies.py runs.
CONFIGURATIONS = ("nginx", "haproxy")


def blocks(document):
    """(language with its marks, text) of every fenced block."""
    return re.findall(r"^```([^\n]*)\n(.*?)^```", document.read_text(), re.M | re.S)


def python_programs(document):
    """The programs of a page by their marks and texts: its first block of Python, then each other one behind it."""
    texts = [(mark, text) for mark, text in blocks(document) if mark.split()[:1] == ["python"]]
    return {text: text if i == 0 else texts[0][1] + text for i, (mark, text) in enumerate(texts)
            if all(importlib.util.find_spec(name) for name in mark.split()[1:])}


def node_programs(document):
    """The same of JavaScript, where Node.js is installed."""
    texts = [text for mark, text in blocks(document) if mark == "js"] if shutil.which("node") else []
    return {text: text if i == 0 else texts[0] + text for i, text in enumerate(texts)}


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def made_small(text):
    text = re.sub(r"--elements (\d+)", lambda m: f"--elements {min(int(m[1]), 600)}", text)
    return re.sub(r"^(lambert bench .*)$", r"\1 --quick", text, flags=re.M)


def alike(expected, got, path=""):
    """The first difference of two answers, or None; numbers to 1 %, times and errors only by their names."""
    if isinstance(expected, dict) and isinstance(got, dict):
        if expected.keys() != got.keys():
            return f"{path}: members {sorted(got)} instead of {sorted(expected)}"
        for key in expected:
            if key not in ("time_ms", "error"):
                why = alike(expected[key], got[key], f"{path}/{key}")
                if why:
                    return why
        return None
    if isinstance(expected, list) and isinstance(got, list) and len(expected) == len(got):
        return next(filter(None, (alike(e, g, f"{path}/{i}") for i, (e, g) in enumerate(zip(expected, got)))), None)
    if isinstance(expected, float) and isinstance(got, (int, float)):
        return None if math.isclose(expected, got, rel_tol=.01) else f"{path}: {got} instead of {expected}"
    return None if expected == got else f"{path}: {got!r} instead of {expected!r}"


class Documents(unittest.TestCase):
    def run_document(self, document):
        port = free_port()
        script, answers = ["trap 'kill $(jobs -p) 2>/dev/null || true' EXIT"], []
        programs, scripts = python_programs(document), node_programs(document)
        for mark, text in blocks(document):
            if mark in ("sh", "sh slow"):
                script.append(made_small(text) if mark == "sh slow" else text)
            elif text in programs:
                script.append(f"/usr/bin/python3 - <<'END'\n{programs[text]}END\n")
            elif text in scripts:
                script.append(f"node --input-type=module - <<'END'\n{scripts[text]}END\n")
            elif mark == "json":
                # The answer is the text printed since the last mark.
                script.append(f"echo; echo '=== answer {len(answers)}'")
                answers.append(json.loads(text))
        with tempfile.TemporaryDirectory() as folder:
            tools = pathlib.Path(folder, "tools")
            work = pathlib.Path(folder, "work")
            tools.mkdir()
            work.mkdir()
            (tools / "lambert").symlink_to(LAMBERT)
            (tools / "lambertd").write_text(f'#!/bin/sh\nexec "{LAMBERTD}" --listen 127.0.0.1:{port} "$@"\n')
            (tools / "lambertd").chmod(0o755)
            (work / "examples").symlink_to(ROOT / "deploy" / "examples")
            (work / "node_modules").mkdir()
            (work / "node_modules" / "lambert-light").symlink_to(ROOT / "deploy" / "js")
            (work / "oakland.epw").write_text(weather.epw(weather.a_year()))
            path = f"{tools}:{pathlib.Path(LAMBERT).parent}:/usr/bin:{os.environ['PATH']}"
            text = "\n".join(script).replace(PORT_IN_DOCUMENTS, f"127.0.0.1:{port}")
            done = subprocess.run(["bash", "-eu", "-o", "pipefail", "-c", text], cwd=work, capture_output=True, text=True,
                                  timeout=2 * PATIENCE, check=False, env={**os.environ, "PATH": path, **PACKAGE})
            self.assertEqual(done.returncode, 0, f"{document.name}: {done.stderr[-2000:]}\n{done.stdout[-2000:]}")
        for i, expected in enumerate(answers):
            printed = done.stdout.split(f"=== answer {i}\n")[0].strip().splitlines()
            self.assertIsNone(alike(expected, json.loads(printed[-1])), f"{document.name}: answer {i}")

    def test_pictures_of_the_tutorial_show_its_light(self):
        """Lines of equal light are within the room's light, and a unit is named only where the light has it."""
        text = "".join(text for mark, text in blocks(MANUAL / "tutorial.md") if mark == "sh")
        script = text[:text.index("lambert precompute")]
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["bash", "-eu", "-c", script], cwd=folder, check=True, timeout=60)

            def light(*options, by=max):
                subprocess.run([LAMBERT, "solve", "room.h5", *options, "-o", "light.csv"], cwd=folder, capture_output=True, check=True)
                rows = [row.split(",") for row in pathlib.Path(folder, "light.csv").read_text().splitlines()[1:]]
                return sorted(by([*map(float, row[3:])]) for row in rows if row[1] != "lamp")

            subprocess.run([LAMBERT, "precompute", "room.obj", "-o", "room.h5", "--elements", "300", "--probes", "0", "--quiet"],
                           cwd=folder, capture_output=True, check=True)
            ranges = re.findall(r"^lambert render .*--range ([\d.]+),([\d.]+) --iso-lines (\d+)", text, re.M)
            units = re.findall(r"^lambert render room.h5 --quantity irradiance(?: --emit (\S+))? .*--unit-out lx", text, re.M)
            self.assertEqual((len(ranges), len(units)), (1, 1))
            values = light()
            low, high, lines = map(float, ranges[0])
            crossed = sum(values[0] < low + k * (high - low) / lines < values[-1] for k in range(1, int(lines) + 1))
            self.assertGreaterEqual(crossed, 4)  # most of its lines are in sight
            self.assertLess(values[int(.95 * len(values))], high)
            # Lux are 179 times the watts of white light (WHITEEFFICACY of Radiance), of a store that counts in W.
            light_of = ("--quantity", "irradiance", "--emit", units[0])
            lux, watts = light(*light_of, "--unit-out", "lx"), light(*light_of, by=lambda rgb: .2126 * rgb[0] + .7152 * rgb[1] + .0722 * rgb[2])
            self.assertAlmostEqual(lux[-1] / watts[-1], 179, delta=.01)

    def test_options_exist(self):
        verbs = re.findall(r"^  (\w+) ", subprocess.run([LAMBERT, "--help"], capture_output=True, text=True, check=True).stdout, re.M)
        self.assertGreater(len(verbs), 5)
        known = set(FOREIGN)
        for command in [[LAMBERTD, "--help"], [LAMBERT, "--help"], *([LAMBERT, verb, "--help"] for verb in verbs)]:
            known |= set(re.findall(r"--[a-z0-9-]+", subprocess.run(command, capture_output=True, text=True, check=True).stdout))
        for document in DOCUMENTS:
            if document.name == "CHANGELOG.md":  # it also names options that are gone
                continue
            text = document.read_text()
            named = set(re.findall(r"(?<![\w-])--[a-z][a-z0-9-]+", text))
            # Scripts of the tree that a document names say at their beginning which options they have.
            for script in set(re.findall(r"[\w./-]+\.(?:py|sh|mjs)", text)):
                for path in (ROOT / script, document.parent / script):
                    if path.is_file():
                        named -= set(re.findall(r"--[a-z]+", "".join(path.read_text().splitlines(True)[:25])))
            self.assertEqual(sorted(named - known), [], f"{document.name} names options that no program has")

    def test_links_lead_somewhere(self):
        count = 0
        for document in DOCUMENTS:
            text = re.sub(r"^```.*?^```", "", document.read_text(), flags=re.M | re.S)
            links = re.findall(r"\]\(([^)]+)\)", text) + re.findall(r"^\[[^\]]+\]: (\S+)", text, re.M)
            for link in links + re.findall(r'src="([^"]+)"', text):
                if link.startswith("http"):
                    continue
                name, _, anchor = link.partition("#")
                target = (document.parent / name).resolve() if name else document
                self.assertTrue(target.exists(), f"{document.name}: {link}")
                if anchor:
                    heads = re.findall(r"^#+ (.*)$", target.read_text(), re.M)
                    anchors = {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}
                    self.assertIn(anchor, anchors, f"{document.name}: {link}")
                count += 1
        self.assertGreater(count, 20)

    def test_commands_elsewhere_are_run_there(self):
        runs = "".join((ROOT / name).read_text() for name in (".ci/run", "deploy/demo.sh", "tests/run.sh", "tests/quick.sh"))
        runs += "".join(script.read_text() for script in (ROOT / "tests" / "service").glob("test_install*.py"))
        found = 0
        for document in DOCUMENTS:
            for mark, text in blocks(document):
                word = "python" if mark.startswith("python ") else mark
                self.assertIn(word, ("", "sh", "sh slow", "sh elsewhere", "json", "c", "text", "python", "js", *CONFIGURATIONS), document.name)
                if mark != "sh elsewhere":
                    continue
                for line in text.splitlines():
                    command = line.split("#")[0].strip()
                    if command:
                        found += 1
                        self.assertTrue(command in runs, f"{document.name}: nothing runs {command}")
        self.assertGreater(found, 1)

    def test_presets_are_named(self):
        presets = json.loads((ROOT / "CMakePresets.json").read_text())["configurePresets"]
        text = (MANUAL / "developing.md").read_text()
        names = [preset["name"] for preset in presets if not preset.get("hidden")]
        self.assertGreater(len(names), 5)
        for name in names:
            self.assertRegex(text, rf"`(cmake --preset )?{name}`", f"developing.md does not name the preset {name}")

    def test_files_of_the_tree_exist(self):
        """NAME, x and <room> stand for any name: at least one file or folder must have such a path."""
        count = 0
        for document in (ROOT / ".github" / "CONTRIBUTING.md", MANUAL / "developing.md", MANUAL / "releasing.md"):
            named = re.findall(r"(?<![\w/.])(?:\./)?((?:deploy|include|server|solver|store|tests)/[\w./*<>-]+)", document.read_text())
            for path in {re.sub(r"NAME|<\w+>|(?<=_)x(?=\.)", "*", name.rstrip(".")) for name in named}:
                self.assertTrue(list(ROOT.glob(path.rstrip("/"))), f"{document.name} names {path}")
                count += 1
        self.assertGreater(count, 20)

    def test_readme_is_short(self):
        self.assertLessEqual(len((ROOT / "README.md").read_text().splitlines()), 200)

    def test_changelog_is_short(self):
        """30 lines of 120 characters a version; the newest one is that of the programs."""
        _, *versions = re.split(r"^## ", (ROOT / "CHANGELOG.md").read_text(), flags=re.M)
        for text in versions:
            lines = text.splitlines()
            self.assertLessEqual(len(lines), 30, lines[0])
            self.assertLessEqual(max(map(len, lines)), 120, lines[0])
        version = subprocess.run([LAMBERT, "--version"], capture_output=True, text=True, check=True).stdout.split()[1]
        self.assertEqual(versions[0].split()[0], version)


def add_document(document):
    name = "test_commands_of_" + document.stem.lower().replace("-", "_")
    setattr(Documents, name, lambda self: self.run_document(document))


for each in DOCUMENTS:
    if any(mark in ("sh", "sh slow") for mark, _ in blocks(each)):
        add_document(each)

if __name__ == "__main__":
    unittest.main(verbosity=2)
