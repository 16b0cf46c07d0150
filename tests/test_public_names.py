"""The names that users type: `gammastar.*` in Python, extras in pip, versions in a citation."""

import __future__

import ast
import importlib
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

import gammastar
from gammastar.errors import InputError

REPOSITORY = Path(__file__).parents[1]
HEAVY = {"scipy", "matplotlib", "sympy", "pyarrow", "plotly", "pandas"}


def project() -> dict:
    return tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def is_submodule(value: object) -> bool:
    return isinstance(value, ModuleType) and value.__name__.startswith("gammastar.")


def libraries_of(extra: str, extras: dict[str, list[str]]) -> set[str]:
    """Return the requirements of an extra; `gammastar[...]` stands for those of the extras it names."""
    found = set()
    for requirement in extras[extra]:
        if named := re.fullmatch(r"gammastar\[(.+)\]", requirement):
            found.update(*(libraries_of(name.strip(), extras) for name in named[1].split(",")))
        else:
            found.add(requirement)
    return found


def test_public_names_are_sorted_and_unique() -> None:
    assert gammastar.__all__ == sorted(set(gammastar.__all__))


def test_public_names_exist() -> None:
    assert [name for name in gammastar.__all__ if not hasattr(gammastar, name)] == []


def test_every_name_in_sight_is_public() -> None:
    """Only submodules, which any import may add, are in sight without being listed."""
    in_sight = {name: getattr(gammastar, name) for name in dir(gammastar) if not name.startswith("_")}
    unlisted = set(in_sight) - set(gammastar.__all__)
    assert {n for n in unlisted if not is_submodule(in_sight[n]) and in_sight[n] is not __future__.annotations} == set()


def test_names_are_the_same_for_type_checkers() -> None:
    """What loads on first use is what the imports say that only type checkers read."""
    tree = ast.parse(Path(gammastar.__file__).read_text(encoding="utf-8"))
    (block,) = (each for each in tree.body if isinstance(each, ast.If))
    read: dict[str, object] = {}
    exec(compile(ast.Module(block.body, []), "imports", "exec"), read)
    del read["__builtins__"]
    assert sorted(read) == gammastar.__all__
    assert read.pop("campaign") is gammastar.campaign.run.campaign  # the room runs campaigns when it is called
    assert {name: getattr(gammastar, name) for name in read} == read


def test_the_room_of_campaigns_runs_one_whatever_was_imported_before() -> None:
    """It bears the name of its function, and importing from a room binds the room to its name."""
    importlib.import_module("gammastar.campaign.store")
    with pytest.raises(InputError, match=r"mission must be a Mission \(got int\)"):
        gammastar.campaign(1, 2, "nowhere")


def test_import_loads_nothing_but_the_package() -> None:
    """A command has to be in charge of interrupts before libraries load, which takes longer than anything else of its start."""
    code = "import sys, gammastar; print({'numpy', 'casadi', 'typer'} & set(sys.modules)); gammastar.paths, gammastar.engine"
    answer = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        check=True,
        cwd=Path(gammastar.__file__).parents[1],
        text=True,
    )
    assert answer.stdout == "set()\n"


def test_import_loads_no_heavy_library() -> None:
    code = "import json, sys, gammastar; gammastar.fly, gammastar.mission; print(json.dumps(list(sys.modules)))"
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, check=True, cwd=Path(gammastar.__file__).parents[1]
    )
    loaded = {module.split(".")[0] for module in json.loads(answer.stdout)}
    assert "gammastar" in loaded
    assert loaded & HEAVY == set()


def test_versions_agree() -> None:
    citation = (REPOSITORY / "CITATION.cff").read_text(encoding="utf-8")
    assert gammastar.__version__ == project()["version"]
    assert f"\nversion: {gammastar.__version__}\n" in citation


def test_the_extra_all_takes_every_extra() -> None:
    extras = project()["optional-dependencies"]
    assert libraries_of("all", extras) == set().union(*(libraries_of(extra, extras) for extra in extras))


def test_a_forgotten_extra_is_noticed() -> None:
    """Guards the test above: the requirements of an extra outside `all` are not among those of `all`."""
    extras = {"all": ["gammastar[one, two]", "three>=3"], "one": ["a"], "two": ["gammastar[one]", "b"], "four": ["d"]}
    assert libraries_of("all", extras) == {"a", "b", "three>=3"}
