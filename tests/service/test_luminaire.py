"""`lambert luminaire`: files of makers and files of formulas against an independent reader, faults of files in one line each, texts
that are safe to print, polar curves, and lists of placed luminaires."""
import csv
import json
import math
import os
import pathlib
import subprocess
import sys
import unittest
import xml.etree.ElementTree

from case import Case
from command import ENVIRONMENT, LAMBERT, lambert, must

FILES = pathlib.Path(os.environ["FIXTURES"], "luminaires")
QUADRANT, ISYM2 = "quadrant-0-90.ies", "isym2.ldt"

# A change of a file, (line, its new text, where None drops it) or bytes of all of it, and words of the message.
# The file of LM-63 has 119 lines: the lamp is line 7, the angles begin in lines 9 and 19. The EULUMDAT has 1,520.
LM63_FAULTS = (
    ("empty", b"", "the file is empty"),
    ("no TILT", (6, None), "has no line TILT="),
    ("words", (8, "1 one 10"), "line 8, column 3: number after the ballast factor = one, must be a number"),
    ("descending", (9, "0 1 2 4 3 5 6 7 8 9"), "line 9, column 9: vertical angle 5 of 91 = 3, must be above 4, the one before"),
    ("twice", (9, "0 1 2 3 3 5 6 7 8 9"), "line 9, column 9: vertical angle 5 of 91 = 3, must be above 3"),
    ("from 10", (19, "10 20 30 40 50 60 70 80 85 90"), "line 19, column 1: the first horizontal angle = 10, must be 0, or 90"),
    ("to 135", (19, "0 15 30 45 60 75 90 105 120 135"), "line 19, column 29: the last horizontal angle = 135, must be 90, 180, 360"),
    ("negative", (118, "-5 64 56 49 42 35 28 20 13 6"), "line 118, column 1: candela value = -5, must not be negative"),
    ("nan", (118, "nan 64 56 49 42 35 28 20 13 6"), "line 118, column 1: candela value = nan, must be a number"),
    ("huge", (7, "1 -1 1 2000000000 2000000000 1 2 0 0 0"), "line 7, column 8: number of vertical angles = 2000000000, more than the rest"),
    ("huge in all", (7, "1 -1 1 4000 4000 1 2 0 0 0"), "of 16000000 candela values (4000 by 4000"),
    ("none", (7, "1 -1 1 0 10 1 2 0 0 0"), "line 7, column 8: number of vertical angles = 0, must be at least 2"),
    ("fraction", (7, "1 -1 1 91.5 10 1 2 0 0 0"), "line 7, column 8: number of vertical angles = 91.5, must be a whole number"),
    ("dark", (7, "1 -1 0 91 10 1 2 0 0 0"), "line 7, column 6: candela multiplier = 0, must be above 0; at 0 the luminaire is dark"),
    ("inverse", (7, "1 -1 -1 91 10 1 2 0 0 0"), "line 7, column 6: candela multiplier = -1, must be above 0"),
    ("type 9", (7, "1 -1 1 91 10 9 2 0 0 0"), "line 7, column 14: photometric type = 9, must be 1 (C), 2 (B) or 3 (A)"),
    ("unit 7", (7, "1 -1 1 91 10 1 7 0 0 0"), "line 7, column 16: type of units = 7, must be 1 (feet) or 2 (metres)"),
    ("tilt file", (6, "TILT=tilt.tlt"), "line 6: TILT=tilt.tlt is not there: put it beside the file, or name its folder by --assets"),
    ("tilt table", (6, "TILT=INCLUDE\r\n1\r\n7\r\n0 15 30\r\n1 1 1"), "tilt angle 4 of 7 = 1, must be above 30, the one before"),
    ("binary", bytes(range(256)) * 8, "line 1 holds a zero byte; not a text file"),
    ("UTF-16", "IESNA91\r\nTILT=NONE\r\n".encode("utf-16"), "is a text in UTF-16; save it as UTF-8 or Latin-1"))
EULUMDAT_FAULTS = (
    ("symmetry", (3, "7"), "line 3: symmetry indicator = 7, must be from 0 to 4"),
    ("odd", (4, "71"), "line 4: number of C-planes = 71, must be an even number for symmetry 2"),
    ("one angle", (6, "1"), "line 6: number of intensities of a plane = 1, must be at least 2"),
    ("no set", (26, "0"), "line 26: number of lamp sets = 0, must be at least 1"),
    ("many sets", (26, "10000000"), "line 26: number of lamp sets = 10000000, must be at most 1000"),
    ("flux 0", (29, "0"), "line 29: lumens of a lamp set = 0, must be above 0"),
    ("flux below 0", (29, "-1000"), "line 29: lumens of a lamp set = -1000, must be above 0; a negative number of lamps tells absolute"),
    ("no flux", (29, ""), "line 29: lumens of a lamp set = nothing, must be one number"),
    ("conversion", (24, "0"), "line 24: conversion factor for intensities = 0, must be above 0"),
    ("a line too many", (10, "\r\nx"), "line 13: length or diameter of the luminaire (mm) = 2026-11-28, must be one number"),
    ("planes", (48, "30\r\n25"), "line 49: C-plane (degrees) = 25, must be above 30, the one before (7 of 72)"),
    ("gammas", (120, "10"), "line 120: gamma (degrees) = 10, must be above 10, the one before (6 of 37)"),
    ("negative", (1517, "-3"), "line 1517: intensity (cd per 1,000 lm) = -3, must not be negative"))


def expected():
    with open(FILES / "expected.csv", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def about(file, *options):
    return json.loads(must("luminaire", file, "--json", *options).stdout)


# Runs a command and prints the largest memory, KiB, of it and its children: a small process, as a child begins with the
# memory of its parent.
MEASURED = "import resource, subprocess, sys; r = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL).returncode; " \
           "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss); sys.exit(r)"
SANITIZED = b"__asan_init" in pathlib.Path(LAMBERT).read_bytes()


class Truth(Case):
    @classmethod
    def setUpClass(cls):
        pass

    @classmethod
    def tearDownClass(cls):
        pass

    def test_files_against_an_independent_reader(self):
        rows = expected()
        self.assertEqual(len(rows), 55)
        for row in rows:
            keys = [key for key in row if key.startswith("cd_")]
            directions = [key[4:].replace("_g", ",") for key in keys]
            with self.subTest(row["file"]):
                got = about(FILES / row["file"], *(word for d in directions for word in ("--candela", d)))
                self.assertEqual((got["format"], "type " + got["type"], got["photometry"]), (row["format"], row["photometry"], row["flux"]))
                # Numbers of the table have 6 digits; lumens of type B were integrated over C and gamma.
                exact = {"rel_tol": 1e-4, "abs_tol": 1e-6}
                lumens = float(row["total_lm"])
                self.assertTrue(math.isclose(got["lumens"], lumens, rel_tol=1e-3 if got["type"] == "B" else 1e-4), got["lumens"])
                self.assertTrue(math.isclose(got["peak"]["candela"], float(row["peak_cd"]), **exact), got["peak"])
                self.assertEqual(len(got["candela"]), len(keys))
                for key, answer in zip(keys, got["candela"]):
                    self.assertTrue(math.isclose(answer["candela"], float(row[key]), **exact), (key, answer))
                self.assertTrue(math.isclose(got["lamp_sets"][0]["lumens"] or 0, float(row["lamp_flux_lm"]), **exact))
                opening = [float(side) for side in row["opening_width_length_height_m"].split(" x ")]
                for side, wanted in zip(("width", "length", "height"), opening):
                    self.assertTrue(math.isclose(got["opening"][side], wanted, rel_tol=6e-4), (side, got["opening"]))

    def test_one_luminaire_in_four_versions(self):
        directions = [word for gamma in range(0, 181, 5) for word in ("--candela", f"{2 * gamma},{gamma}")]
        first, *others = (about(FILES / "made" / f"cos4-{year}.ies", *directions) for year in (1986, 1991, 1995, 2019))
        for other in others:
            self.assertTrue(math.isclose(other["lumens"], first["lumens"], rel_tol=1e-6))
            for one, same in zip(first["candela"], other["candela"]):
                self.assertTrue(math.isclose(one["candela"], same["candela"], rel_tol=1e-6, abs_tol=1e-3), same)
            self.assertEqual([other["opening"][key] for key in ("shape", "size")], [first["opening"][key] for key in ("shape", "size")])
        self.assertEqual(first["opening"]["shape"], "disc")

    def test_what_is_printed(self):
        done = must("luminaire", FILES / "made" / "two-lamp-sets.ldt", "--set", 2, "--candela", "30,0")
        for line in ("two-lamp-sets.ldt: EULUMDAT, type C, relative photometry", "company           Lambert",
                     "symmetry          rotational, 1 plane of 37",
                     "opening           rectangle, 0.58 m along C0-C180 x 0.58 m along C90-C270",
                     "lamp set 2 *      2 x T16 54W, 8900 lm, colour nw, rendering 1B, 117 W",
                     "candela           C 30, gamma 0: 1711.54 cd"):
            self.assertIn(line, done.stdout)
        self.assertIn("lambert luminaire: warning: ", done.stderr)
        tilted = about(FILES / "made" / "tilt-include.ies")["tilt"]
        self.assertEqual((tilted["geometry"], tilted["angles"][3], tilted["factors"][3]), (1, 45, .9))


class Faults(Case):
    setUpClass = tearDownClass = classmethod(lambda cls: None)

    def changed(self, name, base, change):
        path = pathlib.Path(self.path(name))
        if isinstance(change, tuple):
            line, text = change
            lines = (FILES / "made" / base).read_bytes().split(b"\r\n")
            lines[line - 1:line] = [] if text is None else [text.encode()]
            change = b"\r\n".join(lines)
        path.write_bytes(change)
        return path

    def test_each_fault_has_one_line(self):
        for base, faults in ((QUADRANT, LM63_FAULTS), (ISYM2, EULUMDAT_FAULTS)):
            for name, change, wanted in faults:
                with self.subTest(name):
                    path = self.changed("a" + base[-4:], base, change)
                    for more in ((), ("--json",), ("-o", self.path("a.svg"))):
                        done = self.refused(1, f"{path}: ", "luminaire", path, *more)
                        self.assertIn(wanted, done.stderr)
                        self.assertEqual(done.stdout, "")
                    self.assertFalse(os.path.exists(self.path("a.svg")))

    def test_ends_and_rests(self):
        for base, cut, wanted in ((QUADRANT, 4233, "ends at line 66, after 432 of 910 candela values (10 by 91)"),
                                  (ISYM2, 2122, "ends after line 300, after 149 of 1369 intensities (37 by 37")):
            path = self.changed("a" + base[-4:], base, (FILES / "made" / base).read_bytes()[:cut])
            self.refused(1, wanted, "luminaire", path)
        path = self.changed("a.ies", QUADRANT, (FILES / "made" / QUADRANT).read_bytes() + b"\r\n1 2 3\r\n")
        self.refused(1, "column 1: a word after the last candela value = 1, must not be there: the table has 10 by 91", "luminaire", path)
        path = self.changed("a.ldt", ISYM2, (FILES / "made" / ISYM2).read_bytes() + b"5\r\n6\r\n7\r\n")
        self.refused(1, "line 1521: a line after the last intensity = 5, must not be there: the symmetry", "luminaire", path)

    def test_oddities_that_are_read(self):
        for base, change, warning in ((QUADRANT, (18, "89.5"), "the table ends at 89.5 degrees; light beyond it is 0"),
                                      (QUADRANT, (7, "1 -1 1 91 10 1 2 -1 2 3"),
                                       "no shape of LM-63-2002 has width -1, length 2 and height 3"),
                                      (QUADRANT, (7, "1 -1 1 91 10 3 2 0 0 0"), None),
                                      ("isym1-mc1.ldt", (9, "x"), None), (ISYM2, (7, "0"), None)):
            path = self.changed("a.ies", base, change)  # the text says which format it has, not the name
            got = about(path)
            self.assertEqual(got["format"], "EULUMDAT" if base.endswith("ldt") else "LM-63-2002")
            if warning:
                self.assertIn(warning, "\n".join(got["warnings"]))

    def test_large_texts_take_little(self):
        """Memory is what the file needs, and a text that is no luminaire's ends soon."""
        values = b"IESNA91\nTILT=NONE\n1 -1 1 1801 3000 1 2 0 0 0 1 1 1\n" + b" ".join(b"%g" % (k / 10) for k in range(1801))
        values += b"\n" + b" ".join(b"%.4f" % (k * 360 / 2999) for k in range(3000)) + b"\n" + b"1 " * (1801 * 3000)
        for text, wanted in ((b"IESNA91 " * 6250000, "has 50000000 bytes, more than the 16 MiB that a luminaire file may have"),
                             (b"1 2\n" * 4000000, "has no line TILT="), (b"\n" * 16000000 + b"x", "has no line TILT="),
                             (b"a\n1\n0\n4000000\n0\n4000000\n" + b"1\n" * 8000000, "line 44: C-plane (degrees) = 1, must be above 1"),
                             (values, None)):
            path = self.changed("a.ies", QUADRANT, text)
            done = subprocess.run([sys.executable, "-c", MEASURED, LAMBERT, "luminaire", str(path)], capture_output=True,
                                  text=True, check=False, env=ENVIRONMENT)
            self.assertEqual(done.returncode, 0 if wanted is None else 1, done.stderr)
            self.assertIn(wanted or "", done.stderr)
            if not SANITIZED:
                self.assertLess(int(done.stdout), 100 << 10)

    def test_wrong_usage(self):
        path = FILES / "made" / QUADRANT
        for wanted, line in (("too few arguments", ()), ("--candela 1: 1 numbers, needs 2", (path, "--candela", "1")),
                             ("GAMMA from 0 to 180", (path, "--candela", "1,181")),
                             ("C must be from -360 to 360", (path, "--candela", "999,1")),
                             ("must end in .svg or .csv", (path, "-o", "a.png")), ("--set 0: must be at least 1", (path, "--set", 0))):
            self.refused(2, wanted, "luminaire", *line)
        self.refused(1, "--set 2: an IES LM-63 has one lamp set", "luminaire", path, "--set", 2)
        self.refused(1, "--set 3: it has 2 lamp sets", "luminaire", FILES / "made" / "two-lamp-sets.ldt", "--set", 3)
        self.refused(1, "No such file", "luminaire", self.path("none.ies"))
        self.refused(1, "not a file", "luminaire", self.folder)


class Lists(Case):
    setUpClass = tearDownClass = classmethod(lambda cls: None)

    def setUp(self):
        super().setUp()
        self.made = FILES / "made"

    def listed(self, name, content):
        path = pathlib.Path(self.path(name))
        path.write_text(content if isinstance(content, str) else json.dumps(content))
        return path

    def test_a_list(self):
        path = self.listed("l.json", {"files": {"even": "lambertian-1000cd-1x1m.ies"}, "luminaires": [
            {"name": "desk", "group": "near", "file": "even", "at": [1, 2, 3], "aim_at": [4, 2, 0], "dim": .5, "maintenance": .8,
             "flux": 1000, "cct": 3000, "ignore": ["lid"]},
            {"name": "row", "file": "two-lamp-sets.ldt", "lamp_set": 2, "opening": "point", "from": [0, 0, 3], "steps": [[2, 0, 0]],
             "counts": [3], "turn": {"axis": [0, 0, 1], "degrees": 90}},
            {"name": "alone", "file": "./lambertian-1000cd-1x1m.ies", "at": [0, 0, 3], "dim": 0}]})
        got = about(path, "--assets", self.made)
        desk, first, second, third, alone = got["luminaires"]
        self.assertEqual((desk["name"], desk["group"], desk["at"], desk["ignore"]), ("desk", "near", [1, 2, 3], ["lid"]))
        for a, b in zip(desk["aim"] + desk["c0"] + desk["c90"], (.5 ** .5, 0, -.5 ** .5, .5 ** .5, 0, .5 ** .5, 0, 1, 0)):
            self.assertAlmostEqual(a, b, delta=1e-9)
        self.assertAlmostEqual(desk["lumens"], 400, delta=1e-6)
        self.assertEqual(desk["opening"], {"shape": "rectangle", "size": [1, 1, 0]})
        self.assertGreater(desk["colour"][0], desk["colour"][2])
        self.assertAlmostEqual(sum(w * c for w, c in zip((.2126, .7152, .0722), desk["colour"])), 1, delta=1e-9)
        self.assertEqual([third["name"], third["group"], third["at"], third["lamp_set"]], ["row.2", "row", [4, 0, 3], 2])
        self.assertEqual(third["opening"], {"shape": "point", "size": [0, 0, 0]})
        for a, b in zip(second["c0"], (0, 1, 0)):
            self.assertAlmostEqual(a, b, delta=1e-9)
        wanted = about(self.made / "two-lamp-sets.ldt", "--set", 2)["lumens"]
        self.assertAlmostEqual(first["lumens"], wanted, delta=1e-6)
        self.assertEqual((alone["group"], alone["lumens"], alone["scale"]), (None, 0, 0))
        self.assertEqual([(file["file"], file["lamp_set"]) for file in got["files"]],
                         [("lambertian-1000cd-1x1m.ies", 1), ("two-lamp-sets.ldt", 2)])
        self.assertEqual([(group["name"], group["luminaires"]) for group in got["groups"]], [("near", 1), ("row", 3)])
        self.assertAlmostEqual(got["groups"][1]["lumens"], 3 * wanted, delta=1e-5)
        self.assertAlmostEqual(got["lumens"], 400 + 3 * wanted, delta=1e-5)
        done = must("luminaire", path, "--assets", self.made)
        for line in ("l.json: 5 luminaires of 2 files", "gamma 0 to", "0.7071 0 -0.7071", "group row", "of 3 luminaires", "all "):
            self.assertIn(line, done.stdout)
        self.assertIn("warning: ", done.stderr)

    def test_csv_says_the_same(self):
        rows = self.listed("l.csv", "name;file;x;y;z;aim_x;aim_y;aim_z;c0_degrees;dim\na;cos4-2019.ies;1,5;2;3;1;0;-1;30;0,5\n")
        same = self.listed("l.json", {"luminaires": [{"name": "a", "file": "cos4-2019.ies", "at": [1.5, 2, 3], "aim": [1, 0, -1],
                                                      "c0": 30, "dim": .5}]})
        self.assertEqual(about(rows, "--assets", self.made), about(same, "--assets", self.made))

    def test_faults(self):
        """One line with the place; none of the list is printed."""
        one = {"name": "a", "file": "cos4-2019.ies", "at": [0, 0, 3]}
        for more, wanted in (({"dimm": 1}, "luminaires[1] has a member \"dimm\", which is not known: did you mean dim?"),
                             ({"name": "a"}, "luminaires[1]: name = a, which luminaires[0] has too"),
                             ({"file": "none.ies"}, "luminaires[1]: file none.ies is not there"),
                             ({"file": "/etc/passwd"}, "luminaires[1]: file /etc/passwd lies outside of the list's folder"),
                             ({"dim": -1}, "luminaires[1]: dim = -1, must not be negative"),
                             ({"aim": [0, 0, 0]}, "luminaires[1]: aim = [0,0,0], must have a length above 0"),
                             ({"c0": [0, 0, 1]}, "luminaires[1]: c0 = [0,0,1], must not lie along the aim"),
                             ({"lamp_set": 2}, "luminaires[1]: lamp_set = 2: an IES LM-63 has one lamp set"),
                             ({"name": "\x1b[2J"}, "luminaires[1]: name = \"\\u001B[2J\", must have no control character")):
            path = self.listed("l.json", {"luminaires": [one, {**one, "name": "b", **more}]})
            for form in ((), ("--json",)):
                done = self.refused(1, f"{path}: {wanted}", "luminaire", path, "--assets", self.made, *form)
                self.assertEqual(done.stdout, "")
        path = self.listed("l.csv", "name,file,x,y,z\na,cos4-2019.ies,0,0,x\n")
        self.refused(1, "l.csv: line 2: z = x, must be a number", "luminaire", path, "--assets", self.made)
        grid = {"name": "g", "file": "cos4-2019.ies", "from": [0, 0, 3], "steps": [[1, 0, 0], [0, 1, 0]], "counts": [1000, 1000]}
        self.refused(1, "counts make 1000000 luminaires, must be at most 65536", "luminaire", self.listed("l.json", {"luminaires": [grid]}))
        self.refused(1, "luminaires = [], must be an array of 1 to 65536", "luminaire", self.listed("l.json", {"luminaires": []}))
        path = self.listed("l.json", {"luminaires": [one]})
        for option in (("--set", 1), ("--candela", "0,0"), ("-o", self.path("a.svg"))):
            self.refused(2, f"is a list of luminaires, which {option[0]} is not for", "luminaire", path, "--assets", self.made, *option)

    def test_large_lists_take_little(self):
        """A list of many luminaires, and texts that cost a reader of JSON most for their bytes."""
        many = {"luminaires": [{"name": "g", "file": "cos4-2019.ies", "from": [0, 0, 3], "steps": [[1, 0, 0], [0, 1, 0]],
                                "counts": [256, 256]}]}
        for text, wanted in ((json.dumps(many), None), ('{"luminaires": [' + "[]," * 2790000 + "[]]}", "luminaires = ["),
                             ("[" * 4000000, "luminaire"),
                             ('{"luminaires": [' + "1," * 60000 + "1]}", "luminaires[0] = 1, must be an object"),
                             ('{"luminaires": ' + " " * (9 << 20) + "[]}", "more than the 8 MiB that a list of luminaires may have")):
            path = self.listed("l.json", text)
            done = subprocess.run([sys.executable, "-c", MEASURED, LAMBERT, "luminaire", str(path), "--assets", str(self.made)],
                                  capture_output=True, text=True, check=False, env=ENVIRONMENT)
            self.assertEqual(done.returncode, 0 if wanted is None else 1, done.stderr)
            self.assertIn(wanted or "", done.stderr)
            self.assertEqual(done.stderr.count("\n"), 0 if wanted is None else 1, done.stderr)
            if not SANITIZED:
                self.assertLess(int(done.stdout), 500 << 10)


class Outputs(Case):
    setUpClass = tearDownClass = classmethod(lambda cls: None)

    def test_texts_are_safe(self):
        """Control characters of a file reach no terminal, and its marks are text in JSON and SVG."""
        path = pathlib.Path(self.path("a.ies"))
        path.write_bytes(b"IESNA:LM-63-2002\n[MANUFAC] M\xfcller <&\"> \x1b]0;x\x07 \xe9\x9b\n[LUMINAIRE] a<b & \"c\" \x1b[2J\n"
                         + b"TILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n1 1\n")
        done = must("luminaire", path, "-o", self.path("a.svg"))
        self.assertFalse([c for c in done.stdout if ord(c) < 32 and c != "\n"])
        self.assertIn("MANUFAC           Müller <&\"> ?]0;x? é?\n", done.stdout)
        got = about(path)
        self.assertEqual((got["maker"], got["luminaire"]), ("Müller <&\"> ?]0;x? é?", "a<b & \"c\" ?[2J"))
        root = xml.etree.ElementTree.parse(self.path("a.svg")).getroot()
        texts = [text.text for text in root.iter("{http://www.w3.org/2000/svg}text")]
        self.assertIn("a<b & \"c\" ?[2J", texts)

    def test_polar_curves(self):
        for file in ("made/asymmetric-0-360.ies", "made/isym3.ldt", "made/type-b.ies", "real/three-007cfb11e343e2f42e3b476be4ab684e.ies"):
            table, picture = self.path("a.csv"), self.path("a.svg")
            must("luminaire", FILES / file, "-o", table)
            must("luminaire", FILES / file, "-o", picture)
            with open(table, encoding="utf-8") as stream:
                head, *rows = csv.reader(stream)
            self.assertEqual(head[:2], ["gamma [degrees]", "C0 [cd]"])
            planes = [float(name[1:].split()[0]) for name in head[1:]]
            k, row = len(planes) // 3, rows[len(rows) // 4]
            answer = about(FILES / file, "--candela", f"{planes[k]},{row[0]}")["candela"][0]["candela"]
            self.assertTrue(math.isclose(float(row[1 + k]), answer, rel_tol=1e-6, abs_tol=1e-9), (file, answer, row[1 + k]))
            root = xml.etree.ElementTree.parse(picture).getroot()
            curves = [line for line in root.iter("{http://www.w3.org/2000/svg}polyline") if len(line.get("points").split()) > 10]
            self.assertEqual(len(curves), 1 if "three" in file else 2)
            for curve in curves:
                for point in curve.get("points").split():
                    x, y = map(float, point.split(","))
                    self.assertLessEqual(math.hypot(x - 280, y - 300), 220.02)  # two decimals

    def test_files_of_tilt(self):
        numbers = "1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n1 1\n"
        os.mkdir(self.path("tilts"))
        path = pathlib.Path(self.path("a.ies"))
        path.write_text("IESNA:LM-63-1995\nTILT=t.tlt\n" + numbers)
        pathlib.Path(self.path("tilts/t.tlt")).write_text("1\n2\n0 90\n1 .5\n")
        self.refused(1, "TILT=t.tlt is not there", "luminaire", path)
        self.assertEqual(about(path, "--assets", self.path("tilts"))["tilt"]["factors"], [1, .5])
        path.write_text("IESNA:LM-63-1995\nTILT=/etc/passwd\n" + numbers)
        self.refused(1, "lies outside of the file's folder", "luminaire", path)

    def test_a_full_disk(self):
        path = FILES / "made" / QUADRANT
        with open("/dev/full", "wb") as full:
            done = subprocess.run([LAMBERT, "luminaire", path], stdout=full, stderr=subprocess.PIPE, text=True, check=False,
                                  env=ENVIRONMENT)
        self.assertEqual(done.returncode, 1)
        self.assertIn("No space left", done.stderr)
        self.assertEqual(lambert("luminaire", path, "-o", "/no/such/folder/a.svg").returncode, 1)


if __name__ == "__main__":
    unittest.main(verbosity=2)
