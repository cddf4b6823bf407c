#!/usr/bin/env python3
"""habits.py on made tests: each rule is broken once, and must be found."""
import os
import tempfile
import unittest

import habits

GOOD = {
    "tests/browser/look.mjs": "await page.waitForFunction(() => window.ready);\n",
    "tests/server/fixture.h": "std::this_thread::sleep_for(std::chrono::milliseconds(5));\n",
    "tests/server/run.sh": 'until ready; do sleep 0.1; done\nstart program >"$work/log" 2>&1\n[[ $a && $b ]] &&\n  true\n',
    "tests/server/look.py": "subprocess.run(['true'], check=True)\n",
}
BROKEN = {
    "tests/browser/a.mjs": "await page.waitForTimeout(1000);\n",
    "tests/server/a.cpp": "std::this_thread::sleep_for(std::chrono::milliseconds(50));\n",
    "tests/server/b.cpp": "std::this_thread::sleep_for(std::chrono::seconds(1));\n",
    "tests/server/a.sh": "sleep 2\n",
    "tests/server/b.sh": 'program serve >log 2>&1 &\n',
    "tests/server/a.py": "subprocess.Popen(['program'])\n",
}


def findings(files):
    with tempfile.TemporaryDirectory() as root:
        for path, text in files.items():
            os.makedirs(os.path.dirname(os.path.join(root, path)), exist_ok=True)
            with open(os.path.join(root, path), "w", encoding="utf-8") as file:
                file.write(text)
        return list(habits.findings_in(root))


def limited(*properties):
    return list(habits.limits_in({"tests": [{"name": "a", "properties": list(properties)}]}))


class Habits(unittest.TestCase):
    def test_good_ones_pass(self):
        self.assertEqual(findings(GOOD), [])

    def test_each_bad_one_is_named(self):
        for path, text in BROKEN.items():
            found = findings({**GOOD, path: text})
            self.assertEqual(len(found), 1, found)
            self.assertTrue(found[0].startswith(path + ":1:"), found)

    def test_limits(self):
        self.assertEqual(limited({"name": "TIMEOUT", "value": 60.0}), [])
        self.assertEqual(len(limited()), 1)
        self.assertEqual(len(limited({"name": "TIMEOUT", "value": 1500.0})), 1)


if __name__ == "__main__":
    unittest.main()
