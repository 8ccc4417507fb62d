# SPDX-License-Identifier: MIT
"""The module as CMake installs it.

    installed_test.py CMAKE BUILD_DIR PYTHON_DIR WORK_DIR     PYTHON_DIR: TERRANE_PYTHON_DIR
"""
import os
import pathlib
import shutil
import subprocess
import sys
import unittest

CMAKE, BUILD, PYTHON_DIR, WORK = sys.argv[1:5]
del sys.argv[1:]


class Installed(unittest.TestCase):
    def test_the_installed_package_is_whole_and_can_be_imported(self):
        prefix = pathlib.Path(WORK) / "prefix"
        shutil.rmtree(prefix, ignore_errors=True)
        subprocess.run([CMAKE, "--install", BUILD, "--component", "python", "--prefix", prefix], check=True,
                       capture_output=True)
        package = prefix / PYTHON_DIR / "terrane"
        names = sorted(path.name for path in package.iterdir())
        self.assertEqual([name for name in names if not name.startswith("_terrane")],
                         ["__init__.py", "__init__.pyi", "answers.py", "bake.py", "py.typed"])
        program = ("import terrane; print(terrane.__file__); "
                   "print(terrane.fractal(seed=7).heights([1.0, 2.0], [3.0, 4.0]).shape)")
        done = subprocess.run([sys.executable, "-B", "-c", program], check=True, capture_output=True, text=True,
                              env={**os.environ, "PYTHONPATH": str(package.parent)})
        self.assertEqual(done.stdout.split("\n")[:2], [str(package / "__init__.py"), "(2,)"])


unittest.main()
