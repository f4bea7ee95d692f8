"""The modules of the package must not import each other in a cycle.

Imports under TYPE_CHECKING and inside functions count: they hide a cycle from the interpreter, not
from a reader. The import of a parent package that Python adds to `import package.module` does not
count, because the package itself imports most of its modules.
"""

from __future__ import annotations

import ast
import graphlib
import pathlib
from collections.abc import Iterator

import pytest

import hypermap_client


def find_modules(package: pathlib.Path) -> dict[str, pathlib.Path]:
    """The source files in the folder of a package, by dotted module name."""
    modules = {}
    for path in package.rglob("*.py"):
        parts = path.relative_to(package.parent).with_suffix("").parts
        modules[".".join(parts).removesuffix(".__init__")] = path
    return modules


def imported_names(module: str, path: pathlib.Path) -> Iterator[str]:
    """The absolute dotted name of everything that a module imports, anywhere in its source."""
    package = module.split(".") if path.name == "__init__.py" else module.split(".")[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            source = [*base, *([node.module] if node.module else [])]
            yield from (".".join([*source, alias.name]) for alias in node.names)


def import_graph(package: pathlib.Path) -> dict[str, set[str]]:
    """For each module of a package, the modules of the same package that it imports."""
    modules = find_modules(package)

    def module_of(name: str) -> str:
        """The module that has a name: `a.b` for a class `a.b.C`. Empty for other packages."""
        while name and name not in modules:
            name = name.rpartition(".")[0]
        return name

    return {
        module: {module_of(name) for name in imported_names(module, path)} - {""}
        for module, path in modules.items()
    }


def find_cycle(package: pathlib.Path) -> list[str]:
    """The modules of one import cycle, the first repeated at the end. Empty if there is none."""
    try:
        graphlib.TopologicalSorter(import_graph(package)).prepare()
    except graphlib.CycleError as error:
        return list(error.args[1])
    return []


def test_the_package_has_no_import_cycle() -> None:
    package = pathlib.Path(hypermap_client.__file__).parent
    graph = import_graph(package)
    assert {"_async", "_sync", "_proto", "_wire"} <= {
        name.split(".")[1] for name in graph if "." in name
    }
    assert "hypermap_client.geometry" in graph["hypermap_client.grids"]
    assert find_cycle(package) == []


def write_package(folder: pathlib.Path, sources: dict[str, str]) -> pathlib.Path:
    """A package `shop` of the given files."""
    for name, text in {"__init__.py": "", "sub/__init__.py": "", **sources}.items():
        path = folder / "shop" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return folder / "shop"


@pytest.mark.parametrize(
    "back",
    [
        "from .a import A",
        "from . import a",
        "from shop.a import A",
        "from shop import a as other",
        "import shop.a",
        "if TYPE_CHECKING:\n    from .a import A",
        "def f():\n    from .a import A",
        "class C:\n    def f(self):\n        import shop.a as a",
        "try:\n    from .a import A\nexcept ImportError:\n    pass",
        "from .sub.c import C",
    ],
)
def test_a_planted_cycle_is_found(tmp_path: pathlib.Path, back: str) -> None:
    package = write_package(
        tmp_path, {"a.py": "from .b import B", "b.py": back, "sub/c.py": "from ..a import A"}
    )
    cycle = find_cycle(package)
    assert {"shop.a", "shop.b"} <= set(cycle) and cycle[0] == cycle[-1]


def test_a_cycle_through_the_package_itself_is_found(tmp_path: pathlib.Path) -> None:
    package = write_package(
        tmp_path, {"__init__.py": "from .a import A", "a.py": "from . import A"}
    )
    assert set(find_cycle(package)) == {"shop", "shop.a"}


def test_imports_without_a_cycle_are_accepted(tmp_path: pathlib.Path) -> None:
    """A diamond, a module with the same name in another package, and other distributions."""
    package = write_package(
        tmp_path,
        {
            "a.py": "import os\nfrom .b import B\nfrom .c import C",
            "b.py": "from .d import D",
            "c.py": "from .d import D",
            "d.py": "import shopping.a\nfrom a import A",
            "sub/a.py": "from ..a import A",
        },
    )
    assert import_graph(package)["shop.a"] == {"shop.b", "shop.c"}
    assert import_graph(package)["shop.sub.a"] == {"shop.a"}
    assert find_cycle(package) == []
