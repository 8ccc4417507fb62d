# SPDX-License-Identifier: MIT
"""Every public name has a docstring and stands in the stub, with its parameters; enumerators are those of C++."""
import ast
import enum
import inspect
import pathlib
import re
import unittest

import terrane
from grounds import main
from terrane import _terrane, answers

PACKAGE = pathlib.Path(terrane.__file__).parent
SOURCES = pathlib.Path(__file__).parents[2]


def public(names):
    return sorted(name for name in names if not name.startswith("_"))


def parameters(docstring):
    """Names of the parameters in the first line of a docstring of pybind11, without self."""
    inside = docstring.splitlines()[0]
    inside = inside[inside.index("(") + 1:inside.rindex(") ->")]
    depth, names, start = 0, [], True
    for word in re.findall(r"[\[\](),]|[\w.*']+|[^\w]", inside):
        if start and re.match(r"\w+$", word):
            names.append(word)
        start = (start and word == " ") or (depth == 0 and word == ",")
        depth += {"[": 1, "(": 1, "]": -1, ")": -1}.get(word, 0)
    return [name for name in names if name not in ("self", "arg0")]


class Stub:
    def __init__(self, path):
        tree = ast.parse(path.read_text())
        self.functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
        self.classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
        self.values = {node.target.id for node in tree.body if isinstance(node, ast.AnnAssign)}

    @staticmethod
    def parameters(node):
        arguments = node.args.posonlyargs + node.args.args + node.args.kwonlyargs
        return [a.arg for a in arguments if a.arg != "self"]


class Names(unittest.TestCase):
    def setUp(self):
        self.stub = Stub(PACKAGE / "__init__.pyi")

    def test_parameters_are_read_from_docstrings(self):  # the check of the checks
        self.assertEqual(parameters("f(self: t.X, a: Tuple[int, int] = (1, 2), *, b: str = 'x', c: object) -> int"),
                         ["a", "b", "c"])

    def test_every_public_name_has_a_docstring(self):
        for name in terrane.__all__:
            thing = getattr(terrane, name)
            if isinstance(thing, (int, tuple)) and not isinstance(thing, type):
                continue  # constants
            text = inspect.getdoc(thing) or ""
            self.assertGreater(len(text), 15, name)
            if isinstance(thing, type) and thing.__module__ != answers.__name__:
                for member in public(vars(thing)):
                    text = inspect.getdoc(inspect.getattr_static(thing, member)) or ""
                    value = inspect.getattr_static(thing, member)
                    if isinstance(value, staticmethod):
                        text = value.__func__.__doc__
                    if not isinstance(value, property):
                        text = "".join(text.splitlines()[1:])  # without the signature
                    self.assertGreater(len(text), 4, f"{name}.{member}")

    def test_every_field_of_an_answer_has_a_shape_or_a_unit(self):
        text = (PACKAGE / "answers.py").read_text()
        for line in re.findall(r"^    \w+: np.ndarray.*$", text, re.M):
            self.assertRegex(line, r"# (float64|bool|u?int\d+) \(")

    def test_the_stub_has_every_name_and_parameter_and_no_others(self):
        have = set(self.stub.functions) | set(self.stub.classes) | (self.stub.values - {"__version__"})
        absent = {name for name, component in terrane._OPTIONAL.items() if component not in terrane.components}
        self.assertEqual(sorted(have - absent), public(dir(_terrane)))
        for name in public(dir(_terrane)):
            thing = getattr(_terrane, name)
            if isinstance(thing, type):
                members = {node.name: node for node in self.stub.classes[name].body if isinstance(node, ast.FunctionDef)}
                self.assertEqual(public(members), public(vars(thing)), name)
                for member, node in members.items():
                    value = inspect.getattr_static(thing, member)
                    if isinstance(value, property) or member.startswith("__") and member != "__init__":
                        continue
                    text = (value.__func__ if isinstance(value, staticmethod) else value).__doc__
                    self.assertEqual(Stub.parameters(node), parameters(text), f"{name}.{member}")
            elif callable(thing):
                self.assertEqual(Stub.parameters(self.stub.functions[name]), parameters(thing.__doc__), name)

    def test_the_package_is_typed(self):
        self.assertTrue((PACKAGE / "py.typed").exists())
        self.assertRegex(terrane.__version__, r"^\d+\.\d+\.\d+$")

    def test_enumerators_are_those_of_the_headers(self):
        headers = "\n".join(path.read_text() for path in SOURCES.glob("**/include/terrane/*/*.h"))
        headers = re.sub(r"//[^\n]*", "", headers)
        for name in public(vars(answers)):
            thing = getattr(answers, name)
            if not (isinstance(thing, type) and issubclass(thing, enum.IntEnum)) or thing is enum.IntEnum:
                continue
            body = re.search(r"enum (?:class )?" + name + r"[^{;]*\{([^}]*)\}", headers)
            self.assertIsNotNone(body, name)
            self.assertEqual([e.name for e in thing], re.findall(r"\w+", body[1]), name)
            self.assertEqual([int(e) for e in thing], list(range(len(thing))), name)

    def test_a_component_that_is_left_out_is_named(self):
        with self.assertRaisesRegex(AttributeError, "no attribute 'Volumes'"):
            terrane.Volumes
        with self.assertRaisesRegex(AttributeError, "Renderer: .*without the component 'render'"):
            terrane.__getattr__("Renderer")
        with self.assertRaisesRegex(AttributeError, "read_track is in C.. only: the component 'playback'"):
            terrane.read_track
        for name in terrane._ONLY_IN_CPP:
            self.assertNotIn(name, terrane.__all__)


main()
