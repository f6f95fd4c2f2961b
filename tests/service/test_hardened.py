"""The programs are built as those that read bytes from strangers should be."""

import os
import platform
import re
import subprocess
import unittest

PROGRAMS = [os.environ["LAMBERT"], os.environ["LAMBERTD"]]


def readelf(*arguments):
    return subprocess.run(["readelf", "-W", *arguments], capture_output=True, text=True, check=True).stdout


class Hardened(unittest.TestCase):
    def each(self):
        for program in PROGRAMS:
            with self.subTest(program=os.path.basename(program)):
                yield program

    def test_their_place_is_random(self):
        for program in self.each():
            self.assertRegex(readelf("-h", program), r"Type:\s+DYN")
            self.assertRegex(readelf("-d", program), r"FLAGS_1\).*\bPIE\b")
            self.assertNotIn("TEXTREL", readelf("-d", program))

    def test_tables_of_functions_are_read_only(self):
        for program in self.each():
            self.assertIn("GNU_RELRO", readelf("-l", program))
            self.assertRegex(readelf("-d", program), r"BIND_NOW|FLAGS_1\).*\bNOW\b")

    def test_no_memory_is_writable_and_executable(self):
        for program in self.each():
            segments = re.findall(r"^\s+(LOAD|GNU_STACK)\s.*?\s([R ][W ][E ])\s+0x", readelf("-l", program), re.M)
            self.assertIn("GNU_STACK", [name for name, _ in segments])
            self.assertGreater(len(segments), 3)
            for name, flags in segments:
                self.assertFalse("W" in flags and "E" in flags, (name, flags))

    def test_stacks_and_strings_are_guarded(self):
        for program in self.each():
            called = set(re.findall(r"UND (\w+)", readelf("--dyn-syms", program)))
            self.assertEqual({"__stack_chk_fail", "__snprintf_chk"} - called, set())
            # With _FORTIFY_SOURCE the checked forms stand for those that write to a buffer of known size.
            self.assertGreaterEqual(len({name for name in called if re.fullmatch(r"__\w+_chk", name)}), 5)

    @unittest.skipUnless(platform.machine() == "x86_64", "endbr64 is an instruction of x86-64")
    def test_jumps_have_marked_targets(self):
        """The crt files of the distribution may lack the property that turns the check on, so only code is looked at."""
        for program in self.each():
            with open(program, "rb") as file:
                self.assertGreater(file.read().count(b"\xf3\x0f\x1e\xfa"), 500)


if __name__ == "__main__":
    unittest.main()
