# SPDX-License-Identifier: MIT
"""Installed headers: what they include of others, that all of them know the version, and where they are.

    public_headers.py PREFIX COMPILER WORK_DIR

All of them together include nothing but themselves, Eigen, tl::expected, and the C and C++ libraries: no GDAL, OpenVDB,
OpenGL, TBB or zstd; but for the adapters of Bullet and ODE. Those that include others of Terrane get version.h with
them, so that headers and library of different versions do not link. The include folder has the one name `terrane`.
"""
import pathlib
import re
import subprocess
import sys


def headers_without_engines(root):
    """Names of the headers below an include folder, without the adapters that include the headers of an engine."""
    return sorted(str(path.relative_to(root)) for path in root.glob("terrane/**/*.h")
                  if not re.match(r"(bullet|ode)_", path.name))


def included(compiler, source, text, flags):
    """All files that a source includes, directly or indirectly."""
    source.write_text(text, encoding="utf-8")
    done = subprocess.run([compiler, "-std=c++20", "-M", *flags, str(source)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(done.stderr)
    names = done.stdout.replace("\\\n", " ").split()[1:]
    return {pathlib.Path(name).resolve() for name in names} - {source.resolve()}


def closure(header, root, seen):
    """The headers of Terrane that a header includes."""
    for name in re.findall(r'#include <(terrane/[^>]+)>', (root / header).read_text(encoding="utf-8")):
        if name not in seen:
            seen.add(name)
            closure(name, root, seen)
    return seen


def main():
    root, compiler, work = pathlib.Path(sys.argv[1], "include"), sys.argv[2], pathlib.Path(sys.argv[3])
    work.mkdir(parents=True, exist_ok=True)
    headers = headers_without_engines(root)
    eigen = subprocess.run(["pkg-config", "--cflags", "eigen3"], capture_output=True, text=True, check=True).stdout.split()
    problems = [f"the include folder has {path.name}" for path in root.iterdir() if path.name != "terrane"]

    usual = included(compiler, work / "usual.cpp",
                     "#include <bits/stdc++.h>\n#include <Eigen/Geometry>\n#include <tl/expected.hpp>\n", eigen)
    ours = included(compiler, work / "ours.cpp", "".join(f"#include <{name}>\n" for name in headers), [f"-I{root}", *eigen])
    inside = root.resolve()
    for path in sorted(ours - usual):
        if inside not in path.parents:
            problems.append(f"public headers include {path}")
    if len(ours & usual) < 100 or len(headers) < 50:
        problems.append("the check does not see what headers include")

    for name in headers:
        of_terrane = closure(name, root, set())
        if of_terrane and "terrane/base/version.h" not in of_terrane:
            problems.append(f"{name} does not include version.h, directly or through others")
    print("\n".join(problems) or f"{len(headers)} headers include nothing but Eigen, tl::expected and standard headers")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
