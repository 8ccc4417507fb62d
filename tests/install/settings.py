# SPDX-License-Identifier: MIT
"""docs/settings.md has every field of every public struct of settings, with the default of its header.

    settings.py SOURCE_DIR
"""
import pathlib
import re
import sys

# Public structs that hold settings.
WANTED = re.compile(r"(Settings|Storage|Field|Need|Controls)$|^(Lattice|View)$")
WORD_FOR_NOTHING = {"std::vector": "empty", "std::string": "empty", "std::optional": "absent"}


def strip_comments(text):
    return re.sub(r"//[^\n]*", "", text)


def body_at(text, begin):
    """The text between the brace at `begin` and its closing brace."""
    depth = 0
    for i in range(begin, len(text)):
        depth += {"{": 1, "}": -1}.get(text[i], 0)
        if depth == 0:
            return text[begin + 1:i]
    raise ValueError("a brace is not closed")


def split_outside(text, separator):
    """Splits at separators outside brackets."""
    parts, depth, part = [], 0, ""
    for letter in text:
        depth += {"{": 1, "(": 1, "<": 1, "}": -1, ")": -1, ">": -1}.get(letter, 0)
        if letter == separator and depth == 0:
            parts.append(part)
            part = ""
        else:
            part += letter
    return parts + [part]


def without_functions(body):
    """Replaces bodies of member functions by a semicolon."""
    while True:
        match = re.search(r"\)\s*(?:const)?\s*\{", body)
        if not match:
            return body
        inside = body_at(body, match.end() - 1)
        body = body[:match.start() + 1] + ";" + body[match.end() + len(inside) + 1:]


def fields_of(body):
    """Name and default of every data member, in order."""
    found = []
    body = without_functions(body)
    for statement in split_outside(body.replace("<<", "\x00"), ";"):
        statement = " ".join(statement.split())
        if not statement or re.match(r"(static|friend|constexpr|using|enum|struct|bool operator)\b", statement):
            continue
        declared = re.match(r"((?:[\w:]+(?:<.*?>+)?\s+)+?)(\w+\s*(?:=.*|,.*|\{.*\})?)$", statement)
        if not declared or "(" in statement.split("=")[0]:
            continue
        type_name = declared.group(1).strip()
        for declarator in split_outside(declared.group(2), ","):
            name, _, default = (part.strip() for part in declarator.partition("="))
            if "{" in name:  # Type name{default}
                name, default = name[:name.index("{")], name[name.index("{"):]
            for kind, word in WORD_FOR_NOTHING.items():
                if type_name.startswith(kind) and default in ("", "{}", "std::nullopt"):
                    default = word
            if type_name.startswith("std::span") and default == "{}":
                default = "empty"
            found.append((name, default.replace("\x00", "<<") or "its own"))
    return found


def read_headers(source):
    structs = {}
    for header in sorted(source.glob("**/include/terrane/**/*.h")):
        text = strip_comments(header.read_text())
        for match in re.finditer(r"^struct (\w+) \{", text, re.M):
            if WANTED.search(match.group(1)):
                structs[match.group(1)] = fields_of(body_at(text, match.end() - 1))
    return structs


def read_page(page):
    sections, section = {}, None
    for line in page.read_text().splitlines():
        heading = re.match(r"### (\w+)", line)
        if heading:
            section = sections.setdefault(heading.group(1), [])
        row = re.match(r"\| `(\w+)` \| ([^|]*) \| ([^|]*) \| ([^|]*) \|$", line)
        if row and section is not None:
            section.append(tuple(cell.strip() for cell in row.groups()))
    return sections


def main():
    source = pathlib.Path(sys.argv[1])
    structs = {name: fields for name, fields in read_headers(source).items()}
    sections = read_page(source / "docs" / "settings.md")
    wrong = []
    if len(structs) < 15:
        wrong.append(f"only {len(structs)} structs of settings were found in the headers")
    for name in sorted(set(structs) ^ set(sections)):
        where = "the headers" if name in sections else "docs/settings.md"
        wrong.append(f"{name} is not in {where}")
    for name in sorted(set(structs) & set(sections)):
        rows = {row[0]: row for row in sections[name]}
        for field, default in structs[name]:
            if field not in rows:
                wrong.append(f"{name}.{field} is not in docs/settings.md: | `{field}` | `{default}` | range | effect |")
            elif rows[field][1].split("`")[1 if "`" in rows[field][1] else 0].strip() != default:
                wrong.append(f"{name}.{field} is {default} in its header and {rows[field][1]} in docs/settings.md")
            elif not rows[field][2] or not rows[field][3]:
                wrong.append(f"{name}.{field} has no range or no effect in docs/settings.md")
        for field in sorted(set(rows) - {field for field, _ in structs[name]}):
            wrong.append(f"{name}.{field} is in docs/settings.md and not in its header")
    if wrong:
        sys.exit("\n".join(wrong))
    print(f"{len(structs)} structs, {sum(map(len, structs.values()))} settings")


main()
