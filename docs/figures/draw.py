#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Draws the figures of the documentation: every Figure that figures() of a *_figures.py in this folder returns.

    draw.py           writes NAME.svg for each
    draw.py --check   writes nothing; exit code 1 where a file differs from what is drawn, is absent, or is drawn by nobody
    draw.py --terrane build/release/tools/terrane [--check]   first makes the recordings of the program's answers again, which
                      some figures show, or compares them
"""
import argparse
import importlib
import pathlib
import sys

sys.dont_write_bytecode = True
import recordings  # noqa: E402

FOLDER = pathlib.Path(__file__).resolve().parent


def modules():
    for path in sorted(FOLDER.glob("*_figures.py")):
        yield path, importlib.import_module(path.stem)


def record_all(program):
    """{file: text}"""
    return {recordings.FOLDER / f"{name}.json": recordings.text_of(make(program))
            for _, module in modules() for name, make in getattr(module, "recordings", dict)().items()}


def draw_all():
    """{file name: SVG}"""
    drawn = {}
    for path, module in modules():
        for figure in module.figures():
            name = f"{figure.name}.svg"
            if name in drawn:
                sys.exit(f"{path.name}: {name} is drawn twice")
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
    parser.add_argument("--terrane", metavar="PROGRAM", help="make the recordings again")
    options = parser.parse_args()
    recorded = record_all(options.terrane) if options.terrane else {}
    if not options.check:
        for file, text in recorded.items():
            file.write_text(text, encoding="utf-8")
    drawn = draw_all()
    if options.check:
        faults = list(find_faults(drawn))
        faults += [f"{file.name} differs from the program's answers" for file, text in recorded.items()
                   if not file.is_file() or file.read_text(encoding="utf-8") != text]
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
