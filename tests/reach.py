#!/usr/bin/env python3
"""Names the tests of a build folder that a change since a revision can reach, as a regular expression for ctest -R: tests whose
program is made of a changed file by ninja's graph of build/asan, where all is built, and scripts that change, that import or name
what changed, or that run a program that did. A change of a file that nothing is known of reaches all tests.

usage: tests/reach.py FOLDER REVISION [REGEX]     REGEX: only the tests whose names it finds
       tests/reach.py --sources REVISION          the C files of both programs whose objects the change can reach
"""
import json
import os
import re
import subprocess
import sys

HERE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
IMPORT = re.compile(r"^\s*(?:from|import) (\w+)", re.M)
# Changes of these show in no test but those that name them.
TEXTS = re.compile(r"README\.md|CHANGELOG\.md|LICENSE|\.github/.*|\.ci/.*|\.clang-(format|tidy)|deploy/(docs|examples|python|js)/.*|"
                   r"deploy/[^/]*\.(sh|py|png)|store/FORMAT\.md|tests/(quick\.sh|layers\.py|comments\.py|reach\.py|soak/.*|bench/[^/]*\.(py|md))")


def output(*command):
    return subprocess.run(command, cwd=HERE, check=True, capture_output=True, text=True).stdout


def changed_since(revision):
    names = output("git", "diff", "--name-only", "--no-renames", "-z", revision) + output(
        "git", "ls-files", "--others", "--exclude-standard", "-z")
    return {name for name in names.split("\0") if name}


class Graph:
    """The files that each object and each program is made of, by their names in the repository."""

    def __init__(self, folder="build/asan"):
        self.folder = os.path.join(HERE, folder)
        self.known = set()
        self.headers = {}  # object: source and headers, as its last compilation noted them
        name = None
        for line in output("ninja", "-C", folder, "-t", "deps").split("\n"):
            if line.startswith("    "):
                self.headers[name].add(self.in_repository(line.strip()))
            elif ": #deps" in line:
                name = line.split(": #deps")[0]
                self.headers[name] = set()
        self.known.update(*self.headers.values())

    def in_repository(self, path):
        return os.path.relpath(os.path.normpath(os.path.join(self.folder, path)), HERE)

    def inputs(self, target):
        """Sources and objects of a target, recursively; None where the folder has no such target."""
        done = subprocess.run(["ninja", "-C", self.folder, "-t", "inputs", target], capture_output=True, text=True)
        names = [line for line in done.stdout.split("\n") if line and not line.startswith("ninja: ")]
        self.known.update(self.in_repository(name) for name in names if not name.endswith(".o"))
        return names if done.returncode == 0 else None

    def reached(self, target, changed, test_file=None):
        """True where a target is made of a changed file, or its making is unknown; of its test files only the named one counts."""
        for name in self.inputs(target) or [None]:
            if name is None or (name.endswith(".c.o") and name not in self.headers):
                return True
            other = test_file is not None and re.search(r"/test_\w+\.c(\.o)?$", name) and test_file not in name
            if not other and (self.in_repository(name) in changed or self.headers.get(name, set()) & changed):
                return True
        return False


def script_files(script):
    """A script and the modules beside it, or in another folder of tests, that it imports, with those that these do."""
    found, waiting = set(), [script]
    while waiting:
        path = waiting.pop()
        if path in found or not os.path.exists(path):
            continue
        found.add(path)
        for module in IMPORT.findall(read(path)):
            waiting += [os.path.join(HERE, "tests", folder, module + ".py")
                        for folder in ("service", "bench", "support", "soak", "fuzz")]
    return found


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def named_in(change, text):
    """True where a text names a file; a program beside the tests goes by its name alone."""
    path, extension = os.path.splitext(os.path.basename(change))
    return (path if re.match(r"tests/(bench|faults)/.*\.c$", change) else path + extension) in text


class Reach:
    def __init__(self, changed):
        self.graph = Graph()
        self.changed = changed
        self.programs = {name: self.graph.reached(name, changed) for name in ("lambert", "lambertd", "lambert-bench")}
        self.graph.inputs("all")
        # The page, its client and openapi.json are parts of the daemon.
        self.page = any(name.startswith(("server/", "deploy/js/")) and not name.endswith((".c", ".h")) for name in changed)
        self.programs["lambertd"] |= self.page
        self.unknown = sorted(name for name in changed if not self.knows(name))

    def knows(self, name):
        return (name in self.graph.known or TEXTS.fullmatch(name) is not None or name.startswith("server/viewer/") or
                name == "server/route/openapi.json" or re.fullmatch(r"tests/(service(/javascript)?|browser)/[^/]*", name) is not None)

    def test(self, folder, name, command):
        """True where the change can reach a test of a build folder."""
        program = os.path.relpath(command[0], os.path.join(HERE, folder))
        if program.startswith("tests/"):
            seeded = name.startswith("fuzz.") and self.programs["lambert"]
            named = any(os.path.relpath(os.path.realpath(part), HERE) in self.changed for part in command[1:])
            return seeded or named or self.graph.reached(program, self.changed, f"/test_{command[1]}.c" if len(command) == 2 else None)
        if name.startswith("browser."):
            return self.page or self.programs["lambert"] or self.programs["lambertd"] or any(
                change.startswith("tests/browser/") for change in self.changed)
        files = set().union(*(script_files(part) for part in command[1:] if part.endswith(".py")))
        text = "".join(read(path) for path in files)
        return (any(os.path.relpath(path, HERE) in self.changed for path in files) or self.programs["lambert"] or
                (self.programs["lambertd"] and "LAMBERTD" in text) or
                (self.programs["lambert-bench"] and "bench" in text) or
                any(named_in(change, name + text) for change in self.changed) or
                ("lambert_python" in text and any(change.startswith("deploy/python/") for change in self.changed)) or
                (name == "service.javascript" and any(change.startswith("tests/service/javascript/") for change in self.changed)) or
                (name in ("service.documents", "service.install") and any(TEXTS.fullmatch(c) for c in self.changed)))


def main(folder, revision, only=""):
    changed = changed_since(revision)
    reach = Reach(changed)
    if folder == "--sources":
        reached = {file for files in reach.graph.headers.values() if files & changed or reach.unknown for file in files}
        print("\n".join(sorted(file for file in reached if re.match(r"(solver|server|store|tests/bench/suites)/.*\.c$", file))))
        return 0
    tests = json.loads(output("ctest", "--test-dir", folder, "--show-only=json-v1"))["tests"]
    tests = [test for test in tests if re.search(only, test["name"])]
    reached = [test["name"] for test in tests
               if reach.unknown or "command" not in test or reach.test(folder, test["name"], test["command"])]
    why = f", as {reach.unknown[0]} may reach all" if reach.unknown else ""
    print(f"reach: {len(changed)} changed files, {len(reached)} of {len(tests)} tests of {folder}{why}", file=sys.stderr)
    print("^(" + "|".join(re.escape(name) for name in reached) + ")$")
    return 0


if __name__ == "__main__":
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
