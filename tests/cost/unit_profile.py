# SPDX-License-Identifier: MIT
"""Instructions of translation units, from the profile of callgrind and the symbols of their objects in a build folder."""
import re
import subprocess

NAME = re.compile(r"\((\d+)\)(?: (.*))?")


class Profile:
    """Callgrind's counts of instructions: of functions, calls to others excluded, and of calls, all that they call included.
    Functions have mangled names (--demangle=no)."""

    def __init__(self, text):
        self.calls = {}  # (caller, callee) -> instructions
        self.total = int(re.search(r"^(?:totals|summary): (\d+)", text, re.MULTILINE)[1])
        names, caller, callee, is_call = {}, None, None, False
        for line in text.splitlines():
            if line.startswith(("fn=", "cfn=")):
                number, name = NAME.match(line.partition("=")[2]).groups()
                if name is not None:
                    names[number] = name.partition("'")[0]  # recursion has names of its own: f'2
                if line.startswith("fn="):
                    caller = names[number]
                else:
                    callee = names[number]
            elif line.startswith("calls="):
                is_call = True
            elif is_call:
                is_call = False
                edge = caller, callee
                self.calls[edge] = self.calls.get(edge, 0) + int(line.split()[1])

    def called_by(self, caller_prefix, callee_prefix):
        """Instructions of the calls of functions whose names begin so."""
        return sum(cost for (caller, callee), cost in self.calls.items()
                   if caller.startswith(caller_prefix) and callee.startswith(callee_prefix))

    def entered(self, functions):
        """Instructions of all calls from outside a set of functions into it."""
        return sum(cost for (caller, callee), cost in self.calls.items() if callee in functions and caller not in functions)


def functions_of(objects):
    """Functions that object files define, templates and inline functions excluded: these are in many objects."""
    if not objects:
        return set()
    listed = subprocess.run(["nm", "--defined-only", "--format=posix", *objects], capture_output=True, text=True, check=True)
    fields = [line.split() for line in listed.stdout.splitlines()]
    return {line[0] for line in fields if len(line) > 2 and line[1] in "tT"}


def functions_of_units(build_dir, component, units):
    """Functions that only these units of a component's unity build define: the objects of a room, numbered, or of a named
    group of sources. Fails where a unit has no object."""
    folder = build_dir / component / "CMakeFiles" / f"terrane_{component}.dir"
    found = []
    for unit in units:
        name = re.sub("[^A-Za-z0-9]", "_", unit)
        objects = [*folder.glob(f"Unity/unity_{name}_cxx.cxx.o"), *folder.glob(f"Unity/unity_{name}_[0-9]*_cxx.cxx.o")]
        if not objects:
            raise FileNotFoundError(f"no objects of {component}/{unit} in {folder}")
        found += objects
    others = [path for path in folder.rglob("*.o") if path not in found]
    return functions_of(found) - functions_of(others)
