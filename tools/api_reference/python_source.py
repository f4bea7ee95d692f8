"""Reads the public classes and functions of the Python client from its sources, without importing them.

Public are the names in `__all__` of the package, and the functions of the modules in MODULES. The sources of
the blocking client are made from those of the asyncio client (hatch_build.py), which are read here.
"""

import ast
import dataclasses
import functools
import inspect
import pathlib
import re

FOLDER = pathlib.PurePath("client_libs/python")
PACKAGE = FOLDER / "src/hypermap_client"
# Public modules whose functions are not exported by the package.
MODULES = ["plotting"]


@dataclasses.dataclass
class Parameter:
    """A field of a dataclass: its name, type and default as text; default None if it has none."""

    name: str
    type: str
    default: str | None
    keyword_only: bool


@dataclasses.dataclass
class Module:
    """A module: its name relative to the package, its text and its syntax tree."""

    name: str
    text: str
    tree: ast.Module

    def imported(self):
        """Returns the names that it imports from the package, as {name: (module, name there)}."""
        found = {}
        parents = self.name.split(".")
        for node in self.tree.body:
            if isinstance(node, ast.ImportFrom) and node.level:
                base = parents[:len(parents) - node.level] if self.name else []
                for alias in node.names:
                    module = ".".join([*base, *([node.module] if node.module else [])])
                    found[alias.asname or alias.name] = module, alias.name
        return found


class Package:
    """The modules of the package."""

    def __init__(self, root):
        self.root = root

    @functools.cache
    def module(self, name):
        """Returns a module by its name relative to the package; "" for the package itself."""
        path = self.root / PACKAGE / (name.replace(".", "/") + ".py" if name else "__init__.py")
        text = path.read_text(encoding="utf-8")
        return Module(name, text, ast.parse(text))

    def exported(self):
        """Returns `__all__`."""
        for node in self.module("").tree.body:
            if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
                return ast.literal_eval(node.value)
        raise ValueError("the package has no __all__")

    def find(self, module, name):
        """Returns (module, definition) of a class or function that a module has or imports."""
        for node in module.tree.body:
            if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and node.name == name:
                return module, node
        other, there = module.imported()[name]
        return self.find(self.module(other), there)

    def bases(self, module, node):
        """Returns the base classes that are classes of the package, as (module, definition)."""
        known = {*module.imported(), *(n.name for n in module.tree.body if isinstance(n, ast.ClassDef))}
        return [self.find(module, base.id) for base in node.bases
                if isinstance(base, ast.Name) and base.id in known]

    def with_bases(self, module, node):
        """Returns a class and all its base classes once, each before its own bases."""
        found = [(module, node)]
        for base in self.bases(module, node):
            found += self.with_bases(*base)
        names = [part.name for _, part in found]
        return [both for i, both in enumerate(found) if both[1].name not in names[i + 1:]]

    def methods(self, module, node):
        """Returns the public methods of a class, with those of base classes that are not exported."""
        return [function for _, part in self.with_bases(module, node)
                if part is node or part.name not in self.exported() for function in methods_of(part)]

    def blocking_names(self):
        """Returns the replacements that make the blocking client, as hatch_build.py has them."""
        tree = ast.parse((self.root / FOLDER / "hatch_build.py").read_text(encoding="utf-8"))
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "unasync.Rule":
                return ast.literal_eval(node.args[2])
        raise ValueError("hatch_build.py has no unasync.Rule")

    def aliases(self):
        """Returns the type aliases of all modules, as {name: (definition, comment above it)}."""
        found = {}
        for path in sorted((self.root / PACKAGE).rglob("*.py")):
            text = path.read_text(encoding="utf-8")
            for node in ast.parse(text).body:
                if isinstance(node, ast.AnnAssign) and ast.unparse(node.annotation) == "TypeAlias":
                    found[node.target.id] = code_of(node.value), comment_above(text, node.lineno)
        return found


def comment_above(text, line):
    """Returns the comment in the lines above a line (from 1) as one line."""
    lines, found = text.splitlines(), []
    for above in reversed(lines[:line - 1]):
        if not above.startswith("#"):
            break
        found.append(above.removeprefix("#").strip())
    return " ".join(reversed(found))


def code_of(node):
    """Returns an expression as code, with the quotes of the client's style."""
    return re.sub(r"'([^'\"\\]*)'", r'"\1"', ast.unparse(node))


def decorators(node):
    return {ast.unparse(d.func if isinstance(d, ast.Call) else d) for d in node.decorator_list}


def is_dataclass(node):
    return "dataclass" in decorators(node)


def is_enum(node):
    return any(ast.unparse(base) in ("Enum", "IntEnum") for base in node.bases)


def is_public(name):
    return not name.startswith("_")


def methods_of(node):
    """Returns the public functions of a class, properties included."""
    return [n for n in node.body
            if isinstance(n, (ast.FunctionDef, ast.AsyncFunctionDef)) and is_public(n.name)]


def documented_attributes(node):
    """Yields (name, assignment, docstring after it or "") for the public attributes of a class."""
    for i, part in enumerate(node.body):
        if not isinstance(part, (ast.Assign, ast.AnnAssign)):
            continue
        target = part.target if isinstance(part, ast.AnnAssign) else part.targets[0]
        if not isinstance(target, ast.Name) or not is_public(target.id):
            continue
        after = node.body[i + 1] if i + 1 < len(node.body) else None
        text = getattr(after.value, "value", "") if isinstance(after, ast.Expr) else ""
        yield target.id, part, inspect.cleandoc(text) if isinstance(text, str) else ""


def docstring(node):
    return ast.get_docstring(node) or ""


def default_of(value):
    """Returns the default of a field of a dataclass as text; None if it has none."""
    if not (isinstance(value, ast.Call) and ast.unparse(value.func) == "field"):
        return code_of(value) if value else None
    options = {option.arg: option.value for option in value.keywords}
    if "default_factory" in options:
        return f"{code_of(options['default_factory'])}()"
    return code_of(options["default"]) if "default" in options else None


def fields_of(package, module, node):
    """Returns the fields of a dataclass, inherited ones first."""
    fields = []
    for base in package.bases(module, node):
        fields += fields_of(package, *base)
    if not is_dataclass(node):
        return fields
    keyword_only = any(isinstance(d, ast.Call) and any(k.arg == "kw_only" for k in d.keywords)
                       for d in node.decorator_list)
    return fields + [
        Parameter(part.target.id, code_of(part.annotation), default_of(part.value), keyword_only)
        for part in node.body
        if isinstance(part, ast.AnnAssign) and is_public(part.target.id)
        and not ast.unparse(part.annotation).startswith("ClassVar")]


def constructor(package, module, node):
    """Returns the function __init__ of a class or its bases; None if programs do not call it.

    Programs cannot call it if one of its parameters has a type of a private module.
    """
    for where, part in package.with_bases(module, node):
        for function in part.body:
            if isinstance(function, ast.FunctionDef) and function.name == "__init__":
                arguments = [*function.args.args, *function.args.kwonlyargs]
                types = " ".join(ast.unparse(a.annotation) for a in arguments if a.annotation)
                private = {name for name, (other, there) in where.imported().items()
                           if any(not is_public(p) for p in other.split("."))}
                return None if private & set(re.findall(r"\w+", types)) else function
    return None


def without_docstring(package):
    """Returns the names of all public parts that have no docstring."""
    originals = {new: old for old, new in package.blocking_names().items()}
    for name in sorted({originals.get(name, name) for name in package.exported()}):
        module, node = find_public(package, name)
        parts = [(name, docstring(node))]
        if isinstance(node, ast.ClassDef):
            parts += [(f"{name}.{method.name}", docstring(method))
                      for method in package.methods(module, node)]
            parts += [(f"{name}.{member}", text)
                      for member, _, text in documented_attributes(node) if is_enum(node)]
        yield from (f"{module.name}: {part}" for part, text in parts if not text)
    for name in MODULES:
        functions = public_functions(package.module(name))
        yield from (f"{name}: {node.name}" for node in functions if not docstring(node))


def public_functions(module):
    return [n for n in module.tree.body if isinstance(n, ast.FunctionDef) and is_public(n.name)]


def find_public(package, name):
    """Returns (module, definition) of an exported name. A blocking class is found as its original."""
    originals = {new: old for old, new in package.blocking_names().items()}
    return package.find(package.module(""), originals.get(name, name))
