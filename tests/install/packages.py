# SPDX-License-Identifier: MIT
"""What CMake finds is what packages ask for: vcpkg.json, conanfile.py, tools/setup, the Debian and pkg-config files.

    packages.py SOURCE_DIR

Every find_package() and pkg_check_modules() of a component must have a row in NAMES, and the names of that row must stand
in the packages' files, under the component; every dependency there must have a row. The versions are those of CMake.
"""
import json
import pathlib
import re
import sys

# As CMake finds it: names in Debian, vcpkg, Conan. None: not asked for there.
NAMES = {
    "Eigen3": ("libeigen3-dev", "eigen3", "eigen"),
    "tl-expected": ("libexpected-dev", "tl-expected", "tl-expected"),
    "Threads": (None, None, None),
    "PkgConfig": ("pkg-config", "pkgconf", None),
    "zstd": ("libzstd-dev", "zstd", "zstd"),
    "xxhash.h": ("libxxhash-dev", "xxhash", "xxhash"),
    "nlohmann/json.hpp": ("nlohmann-json3-dev", "nlohmann-json", "nlohmann_json"),
    "CURL": ("libcurl4-openssl-dev", "curl", "libcurl"),
    "GDAL": ("libgdal-dev", "gdal", "gdal"),
    "OpenVDB": ("libopenvdb-dev", "openvdb", "openvdb"),
    "epoxy": ("libepoxy-dev", "libepoxy", "libepoxy"),
    "PNG": ("libpng-dev", "libpng", "libpng"),
    "CLI11": ("libcli11-dev", "cli11", None),
    "EXPAT": ("libexpat1-dev", "expat", "expat"),
    "fmt": ("libfmt-dev", "fmt", None),
    "glfw3": ("libglfw3-dev", "glfw3", None),
    "imgui": ("libimgui-dev", "imgui", None),
    "nlohmann_json": ("nlohmann-json3-dev", "nlohmann-json", None),
    "GTest": ("libgtest-dev", "gtest", None),
}
# Folder of a CMakeLists.txt: the feature of vcpkg.json, the set of Debian's packages (terrane_packages.cmake).
FEATURES = {
    "base": ("", "dev"), "terrain": ("", "dev"), "collision": ("", "dev"), "render/scene": ("", "dev"), "terrain/store": ("store", "store"),
    "terrain/remote": ("remote", "remote"), "terrain/dem": ("dem", "dem"), "terrain/volume": ("volume", "volume"), "render": ("render", "render"),
    "playback": ("playback", "playback"), "collision/adapters": ("", "dev"),
    "tools": ("tools", None), "tests": ("tests", None), "tests/benchmark": ("tests", None),
}
# Found where present, or part of the build only.
OPTIONAL = {"terrane", "Python3", "Python", "pybind11", "Doxygen", "meshoptimizer", "Bullet", "ODE", "ode", "bullet"}
ONLY_TO_BUILD = {"PkgConfig", "xxhash.h", "nlohmann/json.hpp"}


def found_by_cmake(text):
    """Names of the packages that a CMakeLists.txt requires."""
    text = re.sub(r"#[^\n]*", "", text)
    names = [name for name, rest in re.findall(r"find_package\((\S+)([^)]*)\)", text) if "REQUIRED" in rest]
    names += [name for name in re.findall(r"pkg_check_modules\((\S+) REQUIRED", text)]
    return names + re.findall(r"find_path\(\S+ (\S+) REQUIRED\)", text)


def main():
    root = pathlib.Path(sys.argv[1])
    read = lambda path: (root / path).read_text(encoding="utf-8")
    problems = []
    setup = set(read("tools/setup").split())
    debian = dict(re.findall(r'set\(terrane_depends_of_(\w+) "([^"]*)"\)', read("cmake/terrane_packages.cmake")))
    vcpkg = json.loads(read("vcpkg.json"))
    recipe = read("conanfile.py")
    name_of = lambda entry: entry if isinstance(entry, str) else entry["name"]
    features = {"": {name_of(entry) for entry in vcpkg["dependencies"]}}
    for feature, content in vcpkg["features"].items():
        features[feature] = {name_of(entry) for entry in content["dependencies"]}
    # What a feature depends on, through the features that it builds on too.
    whole = {}
    for feature in features:  # those of the file come after what they build on
        whole[feature] = features[""] | features[feature]
        for entry in vcpkg["features"].get(feature, vcpkg)["dependencies"]:
            for other in entry.get("features", []) if isinstance(entry, dict) and entry["name"] == "terrane" else []:
                whole[feature] |= whole[other]
    conan = set(re.findall(r'self\.requires\("([\w-]+)/', recipe))

    used = set()
    for folder, (feature, package) in FEATURES.items():
        for name in found_by_cmake(read(f"{folder}/CMakeLists.txt")):
            if name in OPTIONAL:
                continue
            if name not in NAMES:
                problems.append(f"{folder}/CMakeLists.txt finds {name}, which tests/install/packages.py does not know")
                continue
            used.add(name)
            in_debian, in_vcpkg, in_conan = NAMES[name]
            if in_debian and in_debian not in setup:
                problems.append(f"tools/setup does not install {in_debian}")
            if in_debian and package and name not in ONLY_TO_BUILD and in_debian not in debian[package]:
                problems.append(f"the Debian package of {folder} does not depend on {in_debian}")
            if in_vcpkg and in_vcpkg not in whole[feature]:
                problems.append(f"vcpkg.json: feature \"{feature}\" does not depend on {in_vcpkg}, which {folder} finds")
            if package and in_conan and in_conan not in conan:
                problems.append(f"conanfile.py does not require {in_conan}, which {folder} finds")
    known = {names[1] for name, names in NAMES.items() if name in used} | {"terrane", "vcpkg-cmake", "vcpkg-cmake-config"}
    for feature, entries in features.items():
        problems += [f"vcpkg.json: feature \"{feature}\" depends on {entry}, which nothing finds"
                     for entry in sorted(entries - known)]
    problems += [f"conanfile.py requires {name}, which nothing finds"
                 for name in sorted(conan - {NAMES[name][2] for name in used})]

    project = re.search(r"project\(terrane VERSION (\S+)", read("CMakeLists.txt"))[1]
    header = ".".join(re.findall(r"#define TERRANE_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)",
                                 read("base/include/terrane/base/version.h")))
    symbol = re.search(r"name##_(\d+_\d+)", read("base/include/terrane/base/version.h"))[1]
    versions = {"CMakeLists.txt": project, "version.h": header, "vcpkg.json": vcpkg["version"],
                "conanfile.py": re.search(r'version = "([^"]+)"', recipe)[1],
                "TERRANE_VERSIONED": symbol.replace("_", ".") + project[project.rindex("."):]}
    problems += [f"{where} has version {version}, CMake has {project}"
                 for where, version in versions.items() if version != project]
    print("\n".join(problems) or f"{len(used)} dependencies and version {project} are the same everywhere")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
