# SPDX-License-Identifier: MIT
"""pip builds and installs the package into an environment of its own, which needs no network.

    pip_test.py SOURCE_DIR WORK_DIR [COMPILER_LAUNCHER...]
"""
import os
import pathlib
import shutil
import subprocess
import sys

SOURCE, WORK, LAUNCHER = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3:]
PROGRAM = """
import pathlib, sys, terrane
assert pathlib.Path(terrane.__file__).is_relative_to(sys.prefix), terrane.__file__
assert (pathlib.Path(terrane.__file__).parent / "py.typed").exists()
terrain = terrane.Terrain(terrane.fractal(seed=7), worker_count=0)
terrain.require((-9, -9, 9, 9))
answer = terrain.load([], None, 0.0).ground.heights([0.0, 1.0], [0.0, 1.0])
assert (answer.status == terrane.QueryStatus.ok).all(), answer
print(terrane.__version__, terrane.components, answer.height)
"""


def run(*command, **environment):
    clean = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    done = subprocess.run([str(word) for word in command], env={**clean, **environment}, cwd=WORK, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    if done.returncode != 0:
        sys.exit(f"failed with {done.returncode}: {command}\n{done.stdout}")
    return done.stdout


def main():
    WORK.mkdir(parents=True, exist_ok=True)
    environment = WORK / "environment"
    shutil.rmtree(environment, ignore_errors=True)
    # pip writes beside the sources: a copy of what it needs.
    copy = WORK / "terrane"
    shutil.rmtree(copy, ignore_errors=True)
    copy.mkdir()
    for path in SOURCE.iterdir():
        if path.name in ("build", "out", "tests", "tools") or path.name.startswith("."):
            continue
        if path.is_dir():
            shutil.copytree(path, copy / path.name, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
        else:
            shutil.copy(path, copy / path.name)
    missing = subprocess.run([sys.executable, "-c", "import ensurepip, setuptools, wheel"], capture_output=True, check=False)
    if missing.returncode != 0:
        print("python3-venv, python3-setuptools or python3-wheel is not installed")
        sys.exit(77)
    run(sys.executable, "-m", "venv", "--system-site-packages", environment)
    # What is slow to compile is left out.
    arguments = "-DCMAKE_BUILD_TYPE=None -DCMAKE_UNITY_BUILD=ON"
    arguments += "".join(f" -DTERRANE_{name}=OFF" for name in ("RENDER", "SCENE", "DEM", "REMOTE", "STORE"))
    if LAUNCHER:
        arguments += " '-DCMAKE_CXX_COMPILER_LAUNCHER=" + ";".join(LAUNCHER) + "'"
    run(environment / "bin/python", "-m", "pip", "install", "--no-build-isolation", "--no-index", "--no-deps", copy,
        TERRANE_CMAKE_ARGS=arguments, TERRANE_BUILD_DIR=str(WORK / "build"))
    print(run(environment / "bin/python", "-c", PROGRAM))


main()
