# SPDX-License-Identifier: MIT
"""The rooms of docs/rooms.md: every include goes down, no component sees another's private files, every private header is shared,
and no two headers define a type of one name.

    rooms.py SOURCE_DIR
"""
import pathlib
import re
import sys

SOURCES = {".h", ".cpp"}

# Component -> components whose public headers it may include.
SEES = {
    "base": {"base"},
    "terrain": {"terrain", "base"},
    "store": {"store", "terrain", "base"},
    "remote": {"remote", "store", "terrain", "base"},
    "dem": {"dem", "store", "terrain", "base"},
    "volume": {"volume", "store", "terrain", "base"},
    "collision": {"collision", "terrain", "base"},
    "adapters": {"adapters", "collision", "terrain", "base"},
    "playback": {"playback", "terrain", "base"},
    "scene": {"scene", "terrain", "base"},
    "render": {"render", "scene", "terrain", "base"},
    "python": {"render", "scene", "collision", "dem", "remote", "store", "terrain", "base"},
    "tools": {"tools", "playback", "render", "scene", "adapters", "collision", "volume", "dem", "remote", "store", "terrain", "base"},
}
FOLDER = {"store": "terrain/store", "remote": "terrain/remote", "dem": "terrain/dem", "volume": "terrain/volume", "scene": "render/scene"}  # others are named after their component
# Rooms of another component that a component may include, beside base: a store writes what chunks hold, and keeps the
# samples of rasters; a device triangulates chunks as terrain does, and chooses the levels of objects as scene does.
LENT = {"dem": {"terrain/bilinear"}, "store": {"terrain/bilinear", "terrain/chunk"}, "render": {"terrain/chunk", "terrain/lod", "render/scene/objects"}}


def read_tables(page):
    """{component: [room, ...]} from the lowest floor up."""
    tables, component = {}, None
    for line in page.splitlines():
        if heading := re.match(r"## (\w+)$", line):
            component = heading[1] if heading[1] in SEES else None
        elif component and (row := re.match(r"\| `([^`]+)` \|", line)):
            tables.setdefault(component, []).append(row[1])
    return tables


class Rooms:
    def __init__(self, root):
        self.root = root
        self.tables = read_tables((root / "docs/rooms.md").read_text())
        self.component = {room: name for name, rooms in self.tables.items() for room in rooms}
        self.floor = {room: i for rooms in self.tables.values() for i, room in enumerate(rooms)}
        self.faults = []

    def files(self):
        for top in ("base", "terrain", "collision", "playback", "render", "python", "tools"):
            for path in sorted((self.root / top).rglob("*")):
                if path.suffix in SOURCES and "include" not in path.relative_to(self.root).parts:
                    yield path.relative_to(self.root)

    def public_headers(self):
        for path in sorted(self.root.glob("**/include/terrane/*/*.h")):
            relative = path.relative_to(self.root)
            if relative.parts[0] in ("base", "terrain", "collision", "playback", "render"):
                yield relative

    def fault(self, text):
        self.faults.append(text)

    def check_room(self, room):
        if room not in self.component:
            self.fault(f"{room} has no row in docs/rooms.md")

    def check_shared(self):
        """A private header has two includers, tests counted: with one it belongs into that file. Parts of build variants
        (*_impl.h) may have one."""
        headers = {str(path): set() for path in self.files() if path.suffix == ".h" and not path.stem.endswith("_impl")}
        tests = [path.relative_to(self.root) for path in sorted((self.root / "tests").rglob("*")) if path.suffix in SOURCES]
        for path in [*self.files(), *tests]:
            text = (self.root / path).read_text()
            for include in re.findall(r'^\s*#\s*include "([^"]+)"', text, re.M):
                for header in headers:
                    if header == include or header.endswith("/" + include):
                        headers[header].add(str(path))
        for header, users in headers.items():
            if len(users) == 1:
                self.fault(f"{header} is included by {min(users)} alone: merge it into that file")

    def check_names(self):
        """Two headers do not define types of one name in one namespace: programs that link both would be undefined."""
        places = {}
        for path in [*self.files(), *self.public_headers()]:
            if path.suffix != ".h":
                continue
            open_namespaces = []
            for line in (self.root / path).read_text().splitlines():
                if opened := re.match(r"(?:inline )?namespace ?([\w:]*) ?\{$", line):
                    open_namespaces.append(opened[1])
                elif line.startswith("}  // namespace"):
                    open_namespaces.pop()
                elif defined := re.match(r"(?:struct|class|enum class|enum) (?:alignas\(\w+\) )?(\w+)(?!::)\b[^;(]*\{", line):
                    if open_namespaces and all(open_namespaces):
                        places.setdefault(("::".join(open_namespaces), defined[1]), []).append(path)
        for (namespace, name), paths in places.items():
            if len(paths) > 1:
                self.fault(f"{' and '.join(map(str, paths))} define {namespace}::{name}")

    def check_rows(self, seen):
        for room in self.component:
            if room not in seen:
                self.fault(f"docs/rooms.md has a row for {room}, which has no sources")
        page = (self.root / "docs/rooms.md").read_text()
        for room, first in re.findall(r"^\| `([^`]+)` \|[^|]*\| `([^`]+)` \|$", page, re.M):
            if not (self.root / room / first).is_file():
                self.fault(f"docs/rooms.md: {room} is to be read from {first}, which it does not have")

    def resolve(self, path, include, component):
        """The room of a private include, or None where there is no such file."""
        folder = FOLDER.get(component, component)
        lending = sorted({pathlib.PurePosixPath(room).parts[0] for room in LENT.get(component, ())})
        for base in [folder, "", *lending]:
            if (self.root / base / include).is_file():
                return str((pathlib.PurePosixPath(base) / include).parent)
        return None

    def check_include(self, path, room, include):
        component = self.component.get(room)
        if component is None:
            return
        target = self.resolve(path, include, component)
        if target is None:
            if not re.search(r"assets\.h$", include):
                self.fault(f"{path} includes \"{include}\", which does not name a room from {component}'s folder")
        elif target == room or target == "base":
            pass
        elif target in LENT.get(component, ()):
            pass
        elif self.component.get(target) != component:
            self.fault(f"{path} includes \"{include}\": private to {self.component.get(target, target)}")
        elif self.floor[target] > self.floor[room]:
            self.fault(f"{path} includes \"{include}\": {target} is above {room} in docs/rooms.md")

    def check_public_includes(self, path, component, text):
        for other in re.findall(r"^\s*#\s*include <terrane/(\w+)/", text, re.M):
            if other not in SEES[component]:
                self.fault(f"{path} includes <terrane/{other}/...>: {component} must not see {other}")

    def run(self):
        counts = {}
        for path in self.files():
            room = str(path.parent)
            counts[room] = counts.get(room, 0) + 1
            text = (self.root / path).read_text()
            for include in re.findall(r'^\s*#\s*include "([^"]+)"', text, re.M):
                self.check_include(path, room, include)
            if room in self.component:
                self.check_public_includes(path, self.component[room], text)
        for room in sorted(counts):
            self.check_room(room)
        self.check_shared()
        self.check_names()
        self.check_rows(counts)
        for path in self.public_headers():
            text = (self.root / path).read_text()
            self.check_public_includes(path, path.parts[-2], text)
            for include in re.findall(r'^\s*#\s*include "([^"]+)"', text, re.M):
                self.fault(f"{path} is public and includes \"{include}\"")
        return counts


def main():
    rooms = Rooms(pathlib.Path(sys.argv[1]))
    counts = rooms.run()
    for text in rooms.faults:
        print(text)
    print(f"{len(counts)} rooms, {sum(counts.values())} files; {len(rooms.faults)} faults")
    return 1 if rooms.faults or not counts else 0


if __name__ == "__main__":
    sys.exit(main())
