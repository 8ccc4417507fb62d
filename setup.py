# SPDX-License-Identifier: MIT
"""Builds the module by CMake, with this interpreter, and puts it into the package.

TERRANE_CMAKE_ARGS adds options of CMake, such as "-DTERRANE_RENDER=OFF", and TERRANE_BUILD_DIR keeps the build.
"""
import os
import pathlib
import re
import shlex
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = pathlib.Path(__file__).resolve().parent


class CMakeBuild(build_ext):
    def build_extension(self, ext):
        build = pathlib.Path(os.environ.get("TERRANE_BUILD_DIR", pathlib.Path(self.build_temp) / "cmake")).resolve()
        configure = ["cmake", "-S", ROOT, "-B", build, "-DCMAKE_BUILD_TYPE=Release", "-DTERRANE_TESTS=OFF", "-DTERRANE_TOOLS=OFF",
                     "-DTERRANE_VOLUME=OFF", "-DTERRANE_PYTHON_MODULE=ON", "-DBUILD_SHARED_LIBS=OFF",
                     f"-DPython_EXECUTABLE={sys.executable}", "-DTERRANE_PYTHON_DIR=python",
                     *shlex.split(os.environ.get("TERRANE_CMAKE_ARGS", ""))]
        subprocess.run(configure, check=True)
        subprocess.run(["cmake", "--build", build, "--target", "terrane_python", "--parallel"], check=True)
        subprocess.run(["cmake", "--install", build, "--component", "python", "--prefix", build / "installed"], check=True)
        target = pathlib.Path(self.get_ext_fullpath(ext.name)).resolve().parent
        self.copy_tree(str(build / "installed/python/terrane"), str(target))


version = re.search(r"project\(terrane VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"))[1]
setup(version=version, packages=["terrane"], package_dir={"terrane": "python/terrane"},
      package_data={"terrane": ["py.typed", "*.pyi"]}, ext_modules=[Extension("terrane._terrane", [])],
      cmdclass={"build_ext": CMakeBuild})
