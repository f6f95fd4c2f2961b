"""Black box: the texts that both programs make from their tables of options: help, manual pages, completion, and what
a misspelt word is answered."""

import os
import re
import shutil
import subprocess
import tempfile
import unittest

from command import LAMBERT
from patience import PATIENCE

LAMBERTD = os.environ["LAMBERTD"]
VERBS = ("generate", "precompute", "info", "classify", "sky", "luminaire", "solve", "verify", "render")


def run(*arguments):
    return subprocess.run(arguments, capture_output=True, text=True, timeout=PATIENCE, check=False)


def text(*arguments):
    done = run(*arguments)
    assert (done.returncode, done.stderr) == (0, ""), (arguments, done.stderr)
    return done.stdout


def helps():
    yield "lambertd", text(LAMBERTD, "--help")
    for verb in VERBS:
        yield verb, text(LAMBERT, verb, "--help")


def options(help_text):
    """The long options that a help has a row for."""
    return re.findall(r"^ {2}(?:-\w, | {4})--([a-z-]+)", help_text, re.MULTILINE)


class Help(unittest.TestCase):
    def test_is_in_line(self):
        for name, shown in (*helps(), ("lambert", text(LAMBERT, "--help"))):
            head, _, rows = shown.partition("\n\n")
            for line in head.splitlines():
                self.assertLessEqual(len(line), 80)
            for line in rows.splitlines():
                with self.subTest(name, line=line):
                    self.assertLessEqual(len(line), 80)
                    self.assertEqual(line, line.rstrip())
                    # A row begins with its option; its explanation and what follows stand in one column.
                    if line.startswith("  -") or line.startswith("      --"):
                        explained = re.match(r" {2}(?:-\w, | {4})--\S+( {2,})?", line)
                        self.assertTrue(explained[1] is None and explained.end() == len(line) or
                                        explained.end() == 29, line)
                    elif line.startswith("  ") and name != "lambert":
                        self.assertRegex(line, r"^ {29}\S")

    def test_shows_presets(self):
        shown = dict(helps())
        for name, option, preset in (("lambertd", "max-body", "256M"), ("lambertd", "listen", "127.0.0.1:8317"),
                                     ("precompute", "epsilon", ".05"), ("precompute", "method", "auto"),
                                     ("generate", "size", "1,1,1 m"), ("verify", "probes", "16")):
            row = re.search(rf"--{option}=.*?(?=\n +(?:-\w, )?--|\n\n)", shown[name], re.DOTALL)[0]
            self.assertIn(f"(preset {preset})", " ".join(row.split()))

    def test_names_each_option_once(self):
        for name, shown in helps():
            found = options(shown)
            self.assertEqual(sorted(set(found)), sorted(found), name)
            self.assertIn("help", found)

    def test_help_verb(self):
        for verb in VERBS:
            self.assertEqual(text(LAMBERT, "help", verb), text(LAMBERT, verb, "--help"))
        self.assertEqual(text(LAMBERT, "help"), text(LAMBERT, "--help"))

    def test_has_a_letter(self):
        self.assertEqual(text(LAMBERT, "-h"), text(LAMBERT, "--help"))
        for name, shown in helps():
            self.assertEqual(text(*([LAMBERTD] if name == "lambertd" else [LAMBERT, name]), "-h"), shown)
            self.assertIn("\n  -h, --help ", shown)

    def test_nothing_is_promised(self):
        for name, shown in helps():
            self.assertNotIn("not supported", shown, name)


class Suggestions(unittest.TestCase):
    def test_a_file_wants_a_verb(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, wanted in (("room.obj", "a scene needs a verb: lambert precompute {0} -o room.h5"),
                                 ("lamp.IES", "a luminaire needs a verb: lambert luminaire {0}"),
                                 ("lamp.ldt", "a luminaire needs a verb: lambert luminaire {0}"),
                                 ("room.h5", "a store needs a verb: lambert view {0}, or lambert info {0}")):
                path = os.path.join(folder, name)
                with open(path, "w", encoding="ascii") as file:
                    file.write("v 0 0 0\n" * 400)
                done = run(LAMBERT, path)
                self.assertEqual((done.returncode, done.stdout, done.stderr), (2, "", f"lambert: {path}: {wanted.format(path)}\n"))
                done = run(LAMBERT, "solve", path)
                self.assertEqual(done.returncode, 1)
                self.assertIn(f"{path}: not a Lambert store; lambert precompute makes one of a scene", done.stderr)
            done = run(LAMBERT, os.path.join(folder, "none.obj"))
            self.assertIn("no such verb", done.stderr)

    def test_nearest(self):
        for wanted, arguments in (
                ("lambert: slove: no such verb; did you mean solve?", (LAMBERT, "slove", "a.h5")),
                ("lambert: rendr: no such verb; did you mean render?", (LAMBERT, "help", "rendr")),
                ("lambert: illuminate: no such verb; must be one of: help generate", (LAMBERT, "illuminate")),
                ("lambert: --frob: no such option; see lambert --help", (LAMBERT, "--frob")),
                ("lambert solve: --quantitiy: no such option; did you mean --quantity?",
                 (LAMBERT, "solve", "a.h5", "--quantitiy", "indirect")),
                ("lambert solve: --quantitiy: no such option; did you mean --quantity?",
                 (LAMBERT, "solve", "a.h5", "--quantitiy=indirect")),
                ("lambert precompute: --metod: no such option; did you mean --method?",
                 (LAMBERT, "precompute", "a.obj", "--metod", "exact")),
                ("lambert precompute: --frobnicate: no such option; see lambert precompute --help",
                 (LAMBERT, "precompute", "a.obj", "--frobnicate")),
                ("lambert generate: cornel: no such scene; did you mean cornell?",
                 (LAMBERT, "generate", "cornel", "-o", "a.obj")),
                ("lambertd: --max-bodi: no such option; did you mean --max-body?", (LAMBERTD, "a.h5", "--max-bodi", "1M")),
                ("lambertd: --" + "x" * 500 + ": no such option; see lambertd --help", (LAMBERTD, "--" + "x" * 500)),
                ("lambertd: --?[31m: no such option; see lambertd --help", (LAMBERTD, "--\x1b[31m"))):
            done = run(*arguments)
            with self.subTest(arguments[1:]):
                self.assertEqual((done.returncode, done.stdout), (2, ""))
                self.assertEqual(done.stderr.count("\n"), 1)
                self.assertEqual(done.stderr[:60], (wanted + "\n")[:60])


class Installed(unittest.TestCase):
    """Manual pages and completion, which the install target writes from the programs themselves."""

    PROGRAMS = (("lambert", LAMBERT), ("lambertd", LAMBERTD))

    def test_manual_pages(self):
        for name, program in self.PROGRAMS:
            page = text(program, "--print-manual")
            self.assertTrue(page.startswith(f".TH {name.upper()} 1 "))
            for section in ("NAME", "SYNOPSIS", "NOTES"):
                self.assertIn(f"\n.SH {section}\n", page)
            if shutil.which("groff"):
                done = subprocess.run(["groff", "-man", "-ww", "-Tutf8", "-P-cbou"], input=page, capture_output=True, text=True,
                                      timeout=PATIENCE, check=True)
                self.assertEqual(done.stderr, "")
                found = set(re.findall(r"^ +(?:-\w, )?--([a-z-]+)", done.stdout, re.MULTILINE))
                for command, shown in helps():
                    if (command == "lambertd") == (name == "lambertd"):
                        self.assertEqual(set(options(shown)) - {"help"} - found, set(), command)

    def test_completion_is_read_by_its_shell(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, program in self.PROGRAMS:
                for shell in ("bash", "zsh", "fish"):
                    script = text(program, f"--print-completion={shell}")
                    self.assertIn("--max-body" if (name, shell) == ("lambertd", "bash") else name, script)
                    if shutil.which(shell):
                        path = os.path.join(folder, name + shell)
                        with open(path, "w", encoding="utf-8") as file:
                            file.write(script)
                        done = run(shell, "-n", path)
                        self.assertEqual((done.returncode, done.stderr), (0, ""), (name, shell))
        self.assertEqual(run(LAMBERT, "--print-completion=csh").returncode, 2)

    def test_bash_completes(self):
        script = text(LAMBERT, "--print-completion=bash")
        for wanted, words in (("solve", "lambert so"), ("--quantity", "lambert solve --qu"),
                              ("irradiance", "lambert solve --quantity = irr"), ("render", "lambert help re"),
                              ("cornell", "lambert generate co"), ("exact", "lambert solve --sun exa")):
            count = len(words.split()) - 1
            done = run("bash", "-c", f"{script}\nCOMP_WORDS=({words}); COMP_CWORD={count}; _lambert; echo ${{COMPREPLY[*]}}")
            self.assertEqual(done.stdout.strip(), wanted, words)


if __name__ == "__main__":
    unittest.main()
