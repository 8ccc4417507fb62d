# SPDX-License-Identifier: MIT
"""A plain scene pays nothing for what it does not have.

    plain_scene_test.py PLAIN_COST SCENE_COST BUILD_DIR COMPILER [--record]

PLAIN_COST links heights and contact only, SCENE_COST every component. Both play the same flight and drop over a plane and
over a fractal while callgrind counts instructions. The test fails where

- the two programs differ in their meshes or bodies, in allocations or bytes, in threads begun, or by more than 1 % in instructions,
  of the whole or of a part: a linked component costs something that nobody asked for;
- PLAIN_COST loads a library of a component that it does not link;
- more than 1 % of the instructions of PLAIN_COST are in units of features that the scene does not use (FEATURES);
- the instructions of PLAIN_COST, or of a part, differ by more than 1 % from those in instructions.json: a change of the library for
  volumes, objects or anything else made scenes without them slower. Counts depend on the compiler: for one without a
  row this is not checked.

--record writes the counts of this compiler to instructions.json. Record where the change of the plain scene's cost is meant, and
say why in the commit.
"""
import concurrent.futures
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from unit_profile import Profile, functions_of_units

SKIPPED = 77
FRAMES = 24
SCENES = ("plane", "fractal")
PLAY = "_ZN7terrane4test15play_cost_scene"
# What is compared besides the whole: calls of the flight and drop.
PARTS = {
    "Pager::update": "_ZN7terrane5Pager6updateE",
    "Pager::finish": "_ZN7terrane5Pager6finishE",
    "Pager::ground": "_ZNK7terrane5Pager6groundE",
    "World::step": "_ZN7terrane5World4stepE",
    "Triangulator::update": "_ZN7terrane12Triangulator6updateE",
}
MOST_DIFFERENCE = 0.01
RECORDED = pathlib.Path(__file__).with_name("instructions.json")
FOREIGN = re.compile(r"lib(gdal|zstd|expat|openvdb|tbb|png|epoxy|EGL|GL|GLX|GLdispatch|OpenGL|Half|Imath)[^a-z]")
# Translation units of the release build that neither the flight nor the drop over a plane needs: volumes, objects,
# batches, windows of engines, meshes, vehicles, characters and queries. The CMakeLists.txt of both components list the
# sources of "features".
FEATURES = {
    "terrain": ["features", "mesh"],
    "collision": ["features", "world/vehicle"],
}
SAME = ("hash", "allocations", "allocated_bytes", "threads_begun", "ground_triangles", "awake_bodies", "fell_through")


def count(program, scene):
    """What a program prints of a scene, and the profile of the flight and drop without setup."""
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "callgrind.out"
        command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", "--demangle=no",
                   "--collect-atstart=no", f"--toggle-collect={PLAY}*", program, scene, str(FRAMES)]
        # Functions of shared libraries are looked up before main(), not while instructions are counted.
        run = subprocess.run(command, capture_output=True, text=True, check=False, env={**os.environ, "LD_BIND_NOW": "1"})
        if run.returncode != 0:
            sys.exit(f"plain_scene_test: {' '.join(command)} ended with {run.returncode}:\n{run.stderr}")
        profile = Profile(out.read_text())
        parts = {"all": profile.total, **{part: profile.called_by(PLAY, name) for part, name in PARTS.items()}}
        return {**json.loads(run.stdout), "profile": profile, "instructions": parts}


def loaded_libraries(program):
    listed = subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout
    return [line.split()[0] for line in listed.splitlines() if line.strip()]


def ratio_faults(what, counts, expected):
    return [f"{what}, {part}: {counts[part]} instructions, {count} expected, {100 * (counts[part] / max(count, 1) - 1):+.2f} %"
            for part, count in expected.items() if count == 0 or abs(counts[part] - count) > MOST_DIFFERENCE * count]


def feature_faults(scene, profile, features):
    spent = profile.entered(features)
    print(f"{scene}: {spent} of {profile.total} instructions in units of features that it does not use, {100 * spent / profile.total:.3f} %")
    return [] if spent <= MOST_DIFFERENCE * profile.total else [f"{scene}: features that it does not use take more than 1 %"]


def faults_of(scene, plain, full, recorded):
    """What is wrong with the counts of a scene, one line each."""
    faults = [f"{scene}: {key} is {plain[key]} in the plain program and {full[key]} in the one with all components"
              for key in SAME if plain[key] != full[key]]
    faults += ratio_faults(f"{scene} with all components linked", full["instructions"], plain["instructions"])
    if plain["fell_through"] or not plain["awake_bodies"] or not plain["ground_triangles"]:
        faults.append(f"{scene}: nothing was played, or bodies fell through")
    if scene in recorded:
        faults += ratio_faults(f"{scene}, against instructions.json", plain["instructions"], recorded[scene])
    return faults


def main():
    programs, build_dir, compiler = sys.argv[1:3], pathlib.Path(sys.argv[3]), sys.argv[4]
    if shutil.which("valgrind") is None:
        print("plain_scene_test: skipped, because valgrind, which counts the instructions, is not installed")
        return SKIPPED
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        runs = {(scene, program): pool.submit(count, program, scene) for scene in SCENES for program in programs}
        results = {key: run.result() for key, run in runs.items()}

    table = json.loads(RECORDED.read_text()) if RECORDED.exists() else {}
    recorded = table.get(compiler, {})
    faults = [f"{programs[0]} loads {name}" for name in loaded_libraries(programs[0]) if FOREIGN.match(name)]
    if not any(FOREIGN.match(name) for name in loaded_libraries(programs[1])):
        faults.append(f"{programs[1]} loads no library of a component: the check of libraries cannot fail")
    features = set().union(*(functions_of_units(build_dir, *rooms) for rooms in FEATURES.items()))
    for scene in SCENES:
        plain, full = (results[scene, program] for program in programs)
        for part, plain_count in plain["instructions"].items():
            print(f"{scene}, {part}: {plain_count} instructions, {full['instructions'][part]} with all components linked, "
                  f"{recorded.get(scene, {}).get(part, 'none')} recorded")
        faults += faults_of(scene, plain, full, {} if "--record" in sys.argv else recorded)
        faults += feature_faults(scene, plain["profile"], features)
    if not recorded:
        print(f"plain_scene_test: instructions.json has no counts of {compiler}")
    for fault in faults:
        print(f"plain_scene_test: {fault}", file=sys.stderr)
    if faults:
        return 1
    if "--record" in sys.argv:
        table[compiler] = {scene: results[scene, programs[0]]["instructions"] for scene in SCENES}
        RECORDED.write_text(json.dumps(table, indent=4, sort_keys=True) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
