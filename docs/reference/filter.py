# SPDX-License-Identifier: MIT
"""Public headers as Doxygen reads them: what every C++ programmer knows gets a line, the rest must have one.

    filter.py FOLDER LIST

Writes the headers that stand in LIST, one a line, to FOLDER, under their paths from terrane/ on. Copies, moves,
destructors and default comparisons are documented here, in the same words everywhere. Several variables of one
declaration become one declaration each, with the comment before or behind them, and overloads directly below each other
share a comment: Doxygen would give it to one of them alone.
"""
import pathlib
import re
import sys

KNOWN = [
    (r"(?P<type>\w+)\((?P=type)&&( \w+)?\)", "Moves."),
    (r"\w+& operator=\(\w+&&( \w+)?\)", "Moves."),
    (r"(?P<type>\w+)\(const (?P=type)&( \w+)?\)", "Copies."),
    (r"\w+& operator=\(const \w+&( \w+)?\)", "Copies."),
    (r"(virtual )?~\w+\(\)", "Destroys."),
    (r"(friend |constexpr |static )*(bool|auto) operator(==|<=>)\(.*= default", "Compares all members."),
]
FUNCTION = re.compile(r"\s+[\w:<>]+[\s&*]+(?:const )?(\w+)\(.*;$")
VALUE = r"\w+(?: = [^,;(){}]+|\{[^}]*\})?"
SEVERAL = re.compile(rf"(\s+)((?:[\w:<>*]+ )+)({VALUE}(?:, {VALUE})+);\s*(?:///< (.*))?$")


def split(line, comment):
    """One declaration for each variable, each behind the lines of the comment."""
    indent, kind, variables, behind = SEVERAL.match(line).groups()
    comment = [f"{indent}/// {behind}"] if behind else comment
    for variable in re.findall(VALUE, variables):
        yield from comment
        yield f"{indent}{kind}{variable};"


def filtered(lines):
    comment = []  # the lines directly before this one
    above, comment_above = None, []  # name of the function on the line before, and its comment
    for line in lines:
        if line.lstrip().startswith("/// "):
            comment.append(line)
            continue
        if SEVERAL.match(line) and not line.lstrip().startswith(("return", "using")):
            yield from split(line, comment)
        else:
            known = [words for pattern, words in KNOWN if re.match(r"\s+" + pattern, line)]
            function = FUNCTION.match(line)
            if known and not comment:
                comment = [f"/// {known[0]}"]
            elif function and function[1] == above and not comment:
                comment = comment_above
            yield from comment
            yield line
            above, comment_above = function and function[1], comment
        comment = []


def main():
    folder = pathlib.Path(sys.argv[1])
    for name in pathlib.Path(sys.argv[2]).read_text(encoding="utf-8").split():
        path = pathlib.Path(name)
        parts = path.parts[path.parts.index("terrane", path.parts.index("include")):]
        out = folder.joinpath(*parts)
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text("\n".join(filtered(path.read_text(encoding="utf-8").splitlines())) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
