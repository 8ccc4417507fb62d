# SPDX-License-Identifier: MIT
"""A simulator compiled with other flags than the library sees the same layouts and gets the same answers.

    flags.py PREFIX COMPILER WORK_DIR [LAUNCHER...]

PREFIX is an installed Terrane. The layouts of all public classes come from the compiler (-fdump-lang-class of g++); the
answers from flags/answers.cpp, built with each set of flags and linked to the same library. Skips with code 77 where
the compiler is another one, or the machine is not x86-64.
"""
import concurrent.futures
import os
import pathlib
import platform
import re
import subprocess
import sys

from public_headers import headers_without_engines

FOLDER = pathlib.Path(__file__).parent
# Sizes and alignments: the widest vectors, and Eigen's own macros, which some simulators define.
LAYOUT_FLAGS = [[], ["-march=x86-64-v4"], ["-DEIGEN_MAX_ALIGN_BYTES=0"]]
# Answers: inline functions that are not inlined are one copy in a program, and it may be the simulator's.
ANSWER_FLAGS = [["-O2"], ["-O2", "-march=native"], ["-O0", "-march=native", "-DEIGEN_MAX_ALIGN_BYTES=0"]]


def run(command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, **options)
    if done.returncode != 0:
        sys.exit(f"{' '.join(str(word) for word in command)}\n{done.stdout}{done.stderr}")
    return done.stdout


class Package:
    """An installed Terrane through pkg-config."""

    def __init__(self, prefix):
        folder = next(pathlib.Path(prefix).glob("lib*/**/pkgconfig"))
        self.environment = dict(os.environ, PKG_CONFIG_PATH=str(folder))
        self.modules = sorted(path.stem for path in folder.glob("terrane-*.pc"))
        self.headers = headers_without_engines(pathlib.Path(prefix, "include"))

    def flags(self, *words):
        return run(["pkg-config", *words], env=self.environment).split()


def layouts(compiler, package, work, flags):
    """Size and alignment of every class of namespace terrane, by name."""
    work.mkdir(parents=True, exist_ok=True)
    source = work / "headers.cpp"
    source.write_text("".join(f"#include <{name}>\n" for name in package.headers), encoding="utf-8")
    dump = work / "classes.txt"
    run([compiler, "-std=c++20", "-fsyntax-only", *package.flags("--cflags", *package.modules), *flags,
         f"-fdump-lang-class={dump}", source])
    found = re.findall(r"^Class (terrane::[^\n]*)\n\s+(size=\d+ align=\d+)", dump.read_text(encoding="utf-8"), re.M)
    return dict(found)


def answers(compiler, launcher, package, work, flags):
    work.mkdir(parents=True, exist_ok=True)
    compile_flags = package.flags("--cflags", "terrane-collision")
    run([*launcher, compiler, "-std=c++20", *compile_flags, *flags, "-c", FOLDER / "flags" / "answers.cpp",
         "-o", work / "answers.o"])
    run([compiler, work / "answers.o", *package.flags("--libs", "terrane-collision"), "-o", work / "answers"])
    return run([work / "answers"])


def main():
    prefix, compiler, work = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    launcher = sys.argv[4:]
    is_gcc = "Free Software Foundation" in run([compiler, "--version"])
    if platform.machine() != "x86_64" or not is_gcc:
        print("skipped: needs g++ on x86-64")
        return 77
    package = Package(prefix)
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        found = [pool.submit(layouts, compiler, package, work / f"layout{i}", flags)
                 for i, flags in enumerate(LAYOUT_FLAGS)]
        told = [pool.submit(answers, compiler, launcher, package, work / f"answer{i}", flags)
                for i, flags in enumerate(ANSWER_FLAGS)]
        found = [future.result() for future in found]
        told = [future.result() for future in told]

    failures = 0
    for flags, classes in zip(LAYOUT_FLAGS, found):
        for name in sorted(set(found[0]) | set(classes)):
            if found[0].get(name) != classes.get(name):
                print(f"{name}: {found[0].get(name)}, with {' '.join(flags)} {classes.get(name)}")
                failures += 1
    for flags, text in zip(ANSWER_FLAGS, told):
        if text != told[0]:
            print(f"with {' '.join(flags)}:\n{text}with {' '.join(ANSWER_FLAGS[0])}:\n{told[0]}")
            failures += 1
    if len(found[0]) < 100 or "terrane::Pose" not in found[0]:
        print(f"only {len(found[0])} classes were found")
        failures += 1
    print(f"{len(found[0])} classes with {len(LAYOUT_FLAGS)} sets of flags, answers with {len(ANSWER_FLAGS)}: "
          f"{failures} differ")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
