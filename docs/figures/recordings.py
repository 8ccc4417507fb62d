# SPDX-License-Identifier: MIT
"""Answers of the program terrane that figures show: NAME.json in the folder recordings, each made by a function NAME(program)
of the dictionary that recordings() of a *_figures.py returns. draw.py --terrane PROGRAM makes them again."""
import json
import pathlib
import subprocess

FOLDER = pathlib.Path(__file__).resolve().parent / "recordings"
ROOT = pathlib.Path(__file__).resolve().parents[2]


def load(name):
    return json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))


def text_of(recording):
    """One entry a line."""
    entries = (f"{json.dumps(key)}:{json.dumps(value, separators=(',', ':'))}" for key, value in recording.items())
    return "{" + ",\n".join(entries) + "}\n"


def ask(program, flags, questions):
    """Answers of `terrane query`, in the order of the questions."""
    lines = "".join(json.dumps(question) + "\n" for question in questions)
    done = subprocess.run([program, "query", *flags], input=lines, capture_output=True, text=True, check=True)
    return [json.loads(line) for line in done.stdout.splitlines()]
