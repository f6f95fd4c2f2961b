"""Black box: `lambert bench service`. wrk and nginx take part where they are installed; figures are only looked at
where test_bench_servers.py makes up a wrk, as they must not depend on the machine."""

import os
import shutil
import unittest

from bench_service_case import Case

SERVERS = ["lambertd", "ready", "sleeping", "as many", "abreast", "nginx"]
NPY_HEADER = 128


class Whole(Case):
    def test_with_what_is_installed(self):
        tables = self.tables()
        n, k = 200, 32
        self.assertEqual(len(tables["load"]), 2 * 2 * len(SERVERS))
        for row in tables["load"]:
            self.assertEqual((row["n"], row["k"]), (str(n), str(k)))
            if shutil.which("wrk") is None:
                self.assertEqual(row["note"], "not run: wrk is not installed")
            elif row["server"] == "nginx" and row["note"] != "":
                self.assertIn("not run: nginx", row["note"])
            else:
                self.assertEqual(row["note"], "", row)
                self.assertLessEqual(float(row["p50_ms"]), float(row["p99_ms"]))
                for key in ("p50_ms", "per_second", "mb_per_second", "requests", "runs"):
                    self.assertGreater(float(row[key]), 0, row)
            # a body is what the format makes of n values; nginx is asked for a file
            if row["server"] == "nginx":
                self.assertEqual(row["bytes_sent"], "0")
            elif row["format"] == "npy":
                self.assertEqual(int(row["bytes_sent"]), NPY_HEADER + 4 * n)
                self.assertEqual(int(row["bytes_got"]), NPY_HEADER + 4 * n)
        self.assertEqual([row["threads"] for row in tables["solve"]], ["1", "2", "2"])
        for row in tables["solve"]:
            self.assertGreater(float(row["per_second"]), 0)
        loops = {(row["loop"], row["format"]): row for row in tables["loop"]}
        for form in "npy", "json":
            self.assertGreater(float(loops["forward", form]["per_second"]), 0)
        for row in tables["loop"]:
            self.assertTrue(row["note"].startswith("not run") if row["per_second"] == "" else row["note"] == "", row)
        self.assertGreaterEqual(float(tables["codec"][0]["codec_ms"]), float(tables["codec"][0]["codec_best_ms"]))
        ratios = {row["what"]: row for row in tables["ratios"]}
        bits = ratios["bits as in process (1: yes)"]
        self.assertEqual((bits["measured"], bits["outcome"]), ("1", "met"))
        for row in tables["ratios"]:
            self.assertEqual(row["outcome"] == "not run", row["measured"] == "", row)
        self.assertEqual(os.path.exists(os.path.join(self.out, "service-throughput.svg")),
                         shutil.which("wrk") is not None)


if __name__ == "__main__":
    unittest.main()
