# SPDX-License-Identifier: MIT
"""Every test that a page names exists: `Suite.Name` in backticks, a trailing * standing for any end.

    named_tests.py SOURCE_DIR
"""
import pathlib
import re
import sys

GTEST = re.compile(r"^TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\)", re.M)
NAMED = re.compile(r"`([A-Z]\w+\.[A-Z]\w+)(\*?)`")
SCRIPTED = re.compile(r"`((?:cost|install|judge|python|tools)\.[a-z_]+)`")  # tests that are scripts


def scripted_tests(root):
    names = set()
    for path in root.glob("tests/*/CMakeLists.txt"):
        text = path.read_text()
        names.update(re.findall(r"add_test\(NAME ([\w.]+)", text))
        names.update("python." + name for name in re.findall(r"terrane_add_python_test\((\w+) ", text))
        names.update("install." + name for name in re.findall(r"terrane_add_script_test\((\w+) ", text))
        for scripts in re.findall(r"foreach\(script IN ITEMS ([\w ]+)\)", text):
            names.update(f"{path.parent.name}.{name}" for name in scripts.split())
    return names


def main():
    root = pathlib.Path(sys.argv[1])
    tests = {f"{suite}.{name}" for path in root.glob("tests/**/*.cpp") for suite, name in GTEST.findall(path.read_text())}
    scripted = scripted_tests(root)
    count, faults = 0, []
    for page in sorted([*root.glob("*.md"), *root.glob("docs/*.md"), *root.glob("*/README.md"), *root.glob("tests/*/README.md")]):
        text = page.read_text()
        for name, star in NAMED.findall(text):
            count += 1
            if not (any(test.startswith(name) for test in tests) if star else name in tests):
                faults.append(f"{page.relative_to(root)}: no test is called {name}{star}")
        for name in SCRIPTED.findall(text):
            count += 1
            if name not in scripted:
                faults.append(f"{page.relative_to(root)}: no test is called {name}")
    print("\n".join(faults + [f"{count} tests named, {len(faults)} faults"]))
    return 1 if faults or not count else 0


if __name__ == "__main__":
    sys.exit(main())
