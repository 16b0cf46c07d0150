"""The house of gammastar: every room stands on a floor, and imports point downward, without circles.

Imports are read from the source, wherever they stand: at the top, inside functions, or for type checkers only.
"""

import ast
import graphlib
import re
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

PACKAGE = "gammastar"
REPOSITORY = Path(__file__).parents[1]
SOURCE = REPOSITORY / "src" / PACKAGE

# A room is a module or a folder directly inside the package; the package's own __init__ is the room "gammastar".
FLOORS = {
    7: {"cli", "__main__", PACKAGE},
    6: {"report", "campaign"},
    5: {"mission", "figures"},
    4: {"flight", "certificate", "claims", "export", "adapters", "baselines"},
    3: {"law"},
    2: {"vehicle", "path", "engine", "frames"},
    1: {"errors", "checks", "so3", "taylor", "lookup", "version"},
}
FLOOR_OF = {room: floor for floor, rooms in FLOORS.items() for room in rooms}
LEAVES = {"claims", "adapters", "baselines"}
SIDEWAYS = {  # the only imports between two rooms of one floor
    ("checks", "errors"),
    ("so3", "checks"),
    ("so3", "errors"),
    ("taylor", "errors"),
    ("taylor", "so3"),
    ("lookup", "checks"),
    ("lookup", "errors"),
    ("claims", "flight"),
    ("adapters", "flight"),
    ("baselines", "flight"),
    ("report", "campaign"),
    ("cli", PACKAGE),
    ("__main__", "cli"),
}


@dataclass(frozen=True)
class Import:
    importer: str  # full name of the module in which the statement stands
    imported: str  # full name of the module it loads
    line: int
    runs_at_load: bool  # False inside functions and under TYPE_CHECKING


def modules_of(root: Path) -> dict[str, Path]:
    """Return full module name -> file for every module below a package folder."""
    names = {}
    for file in sorted(root.rglob("*.py")):
        parts = [root.name, *file.relative_to(root).with_suffix("").parts]
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return names


def statements(tree: ast.AST, runs_at_load: bool = True) -> Iterator[tuple[ast.AST, bool]]:
    """Yield every node below `tree`, each with whether it is executed while the module loads."""
    for node in ast.iter_child_nodes(tree):
        yield node, runs_at_load
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            yield from statements(node, False)
        elif isinstance(node, ast.If) and ast.unparse(node.test) in ("TYPE_CHECKING", "typing.TYPE_CHECKING"):
            yield from statements(ast.Module(node.body, []), False)
            yield from statements(ast.Module(node.orelse, []), runs_at_load)
        else:
            yield from statements(node, runs_at_load)


def imports_of(root: Path) -> list[Import]:
    """Return every import in a package folder, `from package import submodule` resolved to the submodule."""
    modules = modules_of(root)
    found = []
    for importer, file in modules.items():
        for node, runs_at_load in statements(ast.parse(file.read_text(encoding="utf-8"))):
            for imported in targets(node, importer, file.name == "__init__.py", modules):
                found.append(Import(importer, imported, node.lineno, runs_at_load))
    return found


def targets(node: ast.AST, importer: str, is_package: bool, modules: dict[str, Path]) -> list[str]:
    """Return the full names of the modules that one statement imports; most statements import none."""
    match node:
        case ast.Import(names=names):
            return [name.name for name in names]
        case ast.ImportFrom(module=module, names=names, level=level):
            above = importer.split(".")[: None if is_package else -1]
            base = ".".join([*above[: len(above) - level + 1], module or ""]).strip(".") if level else str(module)
            return sorted({full if (full := f"{base}.{name.name}") in modules else base for name in names})
        case ast.Call(func=function, args=[ast.Constant(value=str(name)), *_]):
            return [name] if ast.unparse(function) in ("importlib.import_module", "import_module", "__import__") else []
    return []


def room_of(module: str) -> str:
    """Return the room of a module: gammastar.law.gains -> law; the package itself is a room of its own."""
    return [*module.split("."), module][1]


def inner(imports: list[Import]) -> list[Import]:
    """Return the imports between modules of the package."""
    return [each for each in imports if each.imported.split(".")[0] == PACKAGE]


def unplaced_rooms(root: Path) -> list[str]:
    rooms = {room_of(module) for module in modules_of(root)}
    return [f"{room} stands on no floor; place it on a floor, see FLOORS" for room in sorted(rooms - set(FLOOR_OF))]


def wrong_directions(imports: list[Import]) -> list[str]:
    """Return a sentence for each import that points up, sideways, or to a leaf from below the top floor."""
    sentences = []
    for each in inner(imports):
        here, there = room_of(each.importer), room_of(each.imported)
        if here == there or not {here, there} <= set(FLOOR_OF):
            continue
        if FLOOR_OF[there] > FLOOR_OF[here]:
            reason = "imports point downward only"
        elif FLOOR_OF[there] == FLOOR_OF[here] and (here, there) not in SIDEWAYS:
            reason = "neighbours do not know each other"
        elif there in LEAVES and FLOOR_OF[here] < max(FLOORS):
            reason = "a leaf is imported from the top floor only"
        else:
            continue
        what = f"{each.importer}, line {each.line}, imports {each.imported}"
        floors = f"from floor {FLOOR_OF[here]}, floor {FLOOR_OF[there]}"
        sentences.append(f"{what} ({floors}): {reason}; move the code down, or pass the value in")
    return sentences


def circles(imports: list[Import]) -> list[str]:
    """Return a sentence for a circle among modules, if there is one."""
    graph: dict[str, set[str]] = {}
    for each in inner(imports):
        graph.setdefault(each.importer, set()).add(each.imported)
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return [" <- ".join(error.args[1]) + " is a circle; move what both need into a module below them"]
    return []


def core_libraries() -> set[str]:
    """Return the import names of the dependencies that every installation has."""
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return {re.split(r"[^\w-]", line)[0].replace("-", "_") for line in project["dependencies"]}


def early_libraries(imports: list[Import]) -> list[str]:
    """Return a sentence for each library outside the core that is loaded together with a module of ours."""
    allowed = core_libraries() | set(sys.stdlib_module_names) | {PACKAGE}
    return [
        f"{each.importer}, line {each.line}, loads {each.imported} at once; import it in the function that needs it"
        for each in imports
        if each.runs_at_load and each.imported.split(".")[0] not in allowed
    ]


def test_every_room_stands_on_a_floor() -> None:
    assert unplaced_rooms(SOURCE) == []


def test_imports_point_downward() -> None:
    assert wrong_directions(imports_of(SOURCE)) == []


def test_modules_form_no_circle() -> None:
    assert circles(imports_of(SOURCE)) == []


def test_libraries_outside_the_core_are_loaded_where_they_are_used() -> None:
    assert early_libraries(imports_of(SOURCE)) == []


def test_the_rooms_that_exist_are_read() -> None:
    """Guards the four tests above against passing on nothing."""
    read = {(each.importer, each.imported) for each in inner(imports_of(SOURCE))}
    assert (f"{PACKAGE}.so3", f"{PACKAGE}.errors") in read


def build(root: Path, files: dict[str, str]) -> Path:
    """Write a small package and return its folder."""
    for name, text in files.items():
        file = root / PACKAGE / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return root / PACKAGE


SOUND = {
    "__init__.py": "from gammastar import claims\nfrom gammastar.law import gains\n",
    "errors.py": "import math\n",
    "so3.py": "import numpy as np\nfrom gammastar.errors import ShapeError\n",
    "path/__init__.py": "from gammastar.path.circle import Circle\n",
    "path/base.py": "from gammastar import so3\n",
    "path/circle.py": "from .base import Path\nfrom . import base\n",
    "law/__init__.py": "",
    "law/gains.py": "from gammastar.path import Circle\n",
    "flight/__init__.py": "import gammastar.law.gains\n",
    "claims.py": "from gammastar.flight import fly\ndef check():\n    import sympy\n",
    "figures.py": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from matplotlib.figure import Figure\n",
    "cli.py": "from gammastar.claims import check\nfrom gammastar import __version__\n",
    "__main__.py": "from gammastar.cli import main\n",
}

BROKEN = {
    "upward": ("frames.py", "from gammastar.law import gains", "downward only"),
    "upward in a function": ("frames.py", "def f():\n    from gammastar.law import gains", "downward only"),
    "upward for types": ("frames.py", "if TYPE_CHECKING:\n    import gammastar.law.gains", "downward only"),
    "upward by relative import": ("path/twist.py", "from ..law import gains", "downward only"),
    "upward by name": ("frames.py", "law = importlib.import_module('gammastar.law.gains')", "downward only"),
    "upward to the package": ("flight/loop.py", "import gammastar", "downward only"),
    "neighbours on floor 2": ("vehicle.py", "from gammastar.path.base import Path", "neighbours"),
    "export to flight": ("export/c.py", "def f():\n    from gammastar.flight import fly", "neighbours"),
    "certificate to flight": ("certificate.py", "from gammastar import flight", "neighbours"),
    "leaf to leaf": ("baselines.py", "import gammastar.claims", "neighbours"),
    "leaf from the report": ("report.py", "from gammastar.claims import check", "leaf"),
    "circle in a room": ("path/base.py", "def f():\n    from gammastar.path.circle import Circle", "circle"),
    "circle through the room's door": ("path/base.py", "from gammastar.path import Circle", "circle"),
    "matplotlib": ("figures.py", "import matplotlib.pyplot as plt", "in the function"),
    "sympy in a class": ("claims.py", "class A:\n    from sympy import Symbol", "in the function"),
    "pyarrow in a try": ("flight/record.py", "try:\n    import pyarrow\nfinally:\n    pass", "in the function"),
    "a new room": ("telemetry.py", "", "place it on a floor"),
}


def complaints(root: Path) -> list[str]:
    imports = imports_of(root)
    return unplaced_rooms(root) + wrong_directions(imports) + circles(imports) + early_libraries(imports)


def test_a_sound_house_raises_no_complaint(tmp_path: Path) -> None:
    assert complaints(build(tmp_path, SOUND)) == []


@pytest.mark.parametrize("case", BROKEN)
def test_one_broken_rule_raises_one_complaint(case: str, tmp_path: Path) -> None:
    file, text, reason = BROKEN[case]
    (sentence,) = complaints(build(tmp_path, {**SOUND, file: f"{SOUND.get(file, '')}\n{text}\n"}))
    assert reason in sentence
