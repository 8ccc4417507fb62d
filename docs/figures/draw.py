#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Draws the figures of the documentation: every Figure that figures() of a *_figures.py in this folder returns.

    draw.py           writes NAME.svg for each
    draw.py --check   writes nothing; exit code 1 where a file differs from what is drawn, is absent, or is drawn by nobody
"""
import argparse
import importlib
import pathlib
import sys

FOLDER = pathlib.Path(__file__).resolve().parent


def draw_all():
    """{file name: SVG}"""
    sys.dont_write_bytecode = True
    sys.path.insert(0, str(FOLDER))
    drawn = {}
    for module in sorted(FOLDER.glob("*_figures.py")):
        for figure in importlib.import_module(module.stem).figures():
            name = f"{figure.name}.svg"
            if name in drawn:
                sys.exit(f"{module.name}: {name} is drawn twice")
            drawn[name] = figure.svg()
    return drawn


def find_faults(drawn):
    for name, svg in drawn.items():
        path = FOLDER / name
        if not path.is_file():
            yield f"{name} is absent"
        elif path.read_text(encoding="utf-8") != svg:
            yield f"{name} differs from what is drawn"
    for path in sorted(FOLDER.glob("*.svg")):
        if path.name not in drawn:
            yield f"{path.name} is drawn by no *_figures.py"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    options = parser.parse_args()
    drawn = draw_all()
    if options.check:
        faults = list(find_faults(drawn))
        for fault in faults:
            print(f"docs/figures: {fault}")
        print(f"{len(drawn)} figures, {len(faults)} faults")
        return 1 if faults else 0
    for name, svg in drawn.items():
        (FOLDER / name).write_text(svg, encoding="utf-8")
        print(name)
    return 0


if __name__ == "__main__":
    sys.exit(main())
