# SPDX-License-Identifier: MIT
"""Comments: no line is wider than 120 columns, and every public name has one.

    comments.py SOURCE_DIR

A name of a public header is documented by a comment on its line, or by one above the block of lines (without an empty line
between) that it stands in. Exempt are what the language names: constructors, destructors, operators, and forward declarations.
"""
import pathlib
import re
import sys

WIDEST = 120
FOLDERS = ("base", "terrain", "collision", "playback", "render", "python", "tools", "tests", "examples", "cmake")
SUFFIXES = {".h", ".cpp", ".py", ".cmake"}

# What a declaration of a header begins with that names nothing a reader needs to be told of.
EXEMPT = re.compile(
    r"^(public|private|protected)\b|^(friend|using namespace|namespace|extern|#|static_assert)|^(class|struct|enum class) \w+;$"
    r"|^~|\boperator\b|^(explicit |constexpr |virtual )*(?P<name>[A-Z]\w*)\((?P=name)?|^virtual ~|= delete;|= default;|\boverride\b")


def wide_lines(path):
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if len(line) > WIDEST and re.match(r"\s*(//|#)", line):
            yield number, len(line)


def strip_strings(line):
    return re.sub(r'"(\\.|[^"\\])*"', '""', line)


class Header:
    """The declarations of a public header at the scopes that a user sees."""

    def __init__(self, text):
        self.lines = text.splitlines()

    def undocumented(self):
        scopes = []  # of open braces: "namespace", "type", "enum", "body"
        private = []  # of types: whether the section is private
        block_has_comment = False
        statement = ""
        in_macro = False
        for number, raw in enumerate(self.lines, 1):
            was_in_macro, in_macro = in_macro, raw.endswith("\\")
            if was_in_macro:
                continue
            line = strip_strings(raw)
            code, _, comment = line.partition("//")
            stripped = code.strip()
            if not stripped and not comment and "//" not in line:
                block_has_comment = False
                continue
            if "//" in line:
                block_has_comment = True
            visible = all(s in ("namespace", "type", "enum") for s in scopes) and not any(private)
            if stripped in ("public:", "private:", "protected:"):
                if private:
                    private[-1] = stripped != "public:"
                block_has_comment = False
                continue
            starts = not statement and bool(stripped)
            if starts and visible and not block_has_comment and self.names_something(stripped, scopes):
                yield number, stripped
            for letter in code:
                if letter == "{":
                    scopes.append(self.kind(statement + " " + code))
                    if scopes[-1] == "type":
                        private.append(bool(re.search(r"\bclass\b", statement + code)))
                    if scopes[-1] in ("namespace", "type", "enum"):
                        block_has_comment = block_has_comment and scopes[-1] == "enum" and "}" in code
                    statement = ""
                elif letter == "}":
                    if scopes and scopes.pop() == "type":
                        private.pop()
                    statement = ""
                elif letter == ";" or (letter == "," and scopes and scopes[-1] == "enum"):
                    statement = ""
                elif not letter.isspace():
                    statement += letter
            if stripped.startswith("#"):
                statement = ""

    @staticmethod
    def kind(text):
        head = text.split("{")[0]
        if re.search(r"\bnamespace\b", head):
            return "namespace"
        if re.search(r"\benum\b", head):
            return "enum"
        if re.search(r"\b(class|struct|union)\b", head) and "(" not in head and "=" not in head:
            return "type"
        return "body"

    @staticmethod
    def names_something(stripped, scopes):
        if stripped in ("{", "}", "};") or stripped.startswith("}"):
            return False
        return not EXEMPT.search(stripped)


def sources(root):
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*")):
            if path.suffix in SUFFIXES or path.name == "CMakeLists.txt":
                yield path


def check(root):
    for path in sources(root):
        for number, width in wide_lines(path):
            yield f"{path.relative_to(root)}:{number}: a comment of {width} columns, more than {WIDEST}"
    for path in sorted(root.glob("*/**/include/terrane/*/*.h")):
        if path.relative_to(root).parts[0] in ("terrain", "collision", "playback", "render"):
            for number, line in Header(path.read_text()).undocumented():
                yield f"{path.relative_to(root)}:{number}: no comment: {line}"


def main():
    faults = list(check(pathlib.Path(sys.argv[1])))
    print("\n".join(faults + [f"{len(faults)} faults"]))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
