"""Which instructions of a tape are needed under a condition alone: the same values with branches, for a machine with one lane.

A graph has no branches: both sides of a choice are computed, and one of them is dropped.  A value that only one side needs, directly
or by way of others, can wait until the condition is known.  Every value belongs to the innermost branch that all its uses share.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from gammastar.engine.tape import CONSTANT, INPUT, Tape

LEAST_WORK = 6  # of what a branch must save, in operations: it costs some itself
CHEAP = {"add", "sub", "mul", "neg", "sq", "twice", "fabs", "lt", "le", "eq", "ne", "not", "and", "or", "if_else_zero"}
CHEAP |= {"div", "inv", "sqrt", "fmin", "fmax", "sign", "copysign"}
DEAR = 20  # operations that a function of the C library counts as

Path = tuple[tuple[int, bool], ...]
"""The conditions, with what they must be, under which a value is needed, outermost first."""


class Choice(NamedTuple):
    """A value that is one of two; of a choice between values None is zero, and of one between truths it is what decides already."""

    condition: int
    first: int | None  # where the condition is true
    second: int | None


@dataclass
class Branch:
    """Choices of one condition that are made together."""

    condition: int
    choices: list[int]
    sides: tuple[list[Item], list[Item]]  # what is computed where the condition is true, and where it is not
    outlives: list[int] = field(
        default_factory=list
    )  # values made inside that a later branch of the condition needs too


Item = int | Branch
"""A value that is computed here, or a branch."""


class Plan(NamedTuple):
    """A tape in branches."""

    items: list[Item]
    choices: dict[int, Choice]  # how `if_else_zero`, sums of two of them, and connectives in branches are meant


def branched(tape: Tape) -> Plan:
    """Return the instructions of a tape that its results need, each in the branch where it is needed, in an order that works."""
    return _Planner(tape).plan()


class _Planner:
    """Plans one tape."""

    def __init__(self, tape: Tape) -> None:
        self.tape, self.instructions = tape, tape.instructions
        self.results = {value for values in tape.outputs for value in values}
        self.choices = self._choices()
        self.path = self._pruned(self._paths())
        for k in [k for k in self.choices if k in self.path and self.instructions[k].operation in ("and", "or")]:
            if not self._branches(k):
                del self.choices[k]
        self.home: dict[int, list[Item]] = {}
        self.branch_of: dict[int, tuple[list[Item], Branch]] = {}  # list of items -> the list around it, and the branch

    def plan(self) -> Plan:
        """Return the items of the outermost level."""
        return Plan(self._level((), sorted(k for k in self.path if self.path[k] == ()), []), self.choices)

    def _is_computed(self, value: int) -> bool:
        return self.instructions[value].operation not in (CONSTANT, INPUT)

    def _literal(self, value: int) -> tuple[int, bool]:
        """Return a condition without its negations, and what it must be."""
        wanted = True
        while self.instructions[value].operation == "not":
            value, wanted = self.instructions[value].inputs[0], not wanted
        return value, wanted

    def _choices(self) -> dict[int, Choice]:
        """Return all choices: a sum of two opposite ones that nothing else needs is one."""
        counts = dict.fromkeys(self.results, 1)
        for each in self.instructions:
            for value in each.inputs if each.operation != INPUT else ():
                counts[value] = counts.get(value, 0) + 1
        choices = dict[int, Choice]()
        for k, (name, inputs, _) in enumerate(self.instructions):
            if name == "if_else_zero":
                condition, wanted = self._literal(inputs[0])
                choices[k] = Choice(condition, inputs[1], None) if wanted else Choice(condition, None, inputs[1])
            elif name in ("and", "or"):
                choices[k] = Choice(inputs[0], *((inputs[1], None) if name == "and" else (None, inputs[1])))
            elif name == "add" and all(self.instructions[i].operation == "if_else_zero" for i in inputs):
                one, other = (choices[i] for i in inputs)
                opposite = one.condition == other.condition and (one.first is None) != (other.first is None)
                if opposite and all(counts[i] == 1 for i in inputs):
                    first, second = (one, other) if one.second is None else (other, one)
                    choices[k] = Choice(one.condition, first.first, second.second)
                    del choices[inputs[0]], choices[inputs[1]]
        return choices

    def _needs(self, value: int) -> list[tuple[int, tuple[int, bool] | None]]:
        """Return the values that a value needs, each with the condition under which it does."""
        if (choice := self.choices.get(value)) is not None:
            sides = ((choice.first, (choice.condition, True)), (choice.second, (choice.condition, False)))
            found = [(choice.condition, None), *((v, literal) for v, literal in sides if v is not None)]
        else:
            found = [(v, None) for v in self.instructions[value].inputs]
        return [(v, literal) for v, literal in found if self._is_computed(v)]

    def _paths(self) -> dict[int, Path]:
        """Return the path of every value that is needed: what the paths of its uses begin with alike."""
        paths: dict[int, Path] = {value: () for value in self.results if self._is_computed(value)}
        for k in reversed(range(len(self.instructions))):
            if k not in paths or not self._is_computed(k):
                continue
            for value, literal in self._needs(k):
                here = paths[k]
                if literal is not None and literal not in here:
                    here = (*here, literal)
                paths[value] = _common(paths[value], here) if value in paths else here
        return paths

    def _pruned(self, paths: dict[int, Path]) -> dict[int, Path]:
        """Return the paths without branches that would save too little."""
        work = dict[Path, int]()
        for value, path in paths.items():
            cost = 1 if self.instructions[value].operation in CHEAP else DEAR
            for k in range(1, len(path) + 1):
                work[path[:k]] = work.get(path[:k], 0) + cost
        for value, path in paths.items():
            while path and work[path] < LEAST_WORK:
                path = path[:-1]
            paths[value] = path
        return paths

    def _branches(self, value: int) -> bool:
        """Return whether a choice has a side of its own to compute."""
        return any(
            len(self.path[v]) > len(self.path[value]) for v, literal in self._needs(value) if literal is not None
        )

    def _level(self, path: Path, values: list[int], items: list[Item]) -> list[Item]:
        """Return the items of one level, of values in their order; choices wait, so that those of one condition are made together."""
        waiting, of_condition = dict[int, list[int]](), dict[int, list[int]]()
        for k in values:
            if k in self.choices and self._branches(k):
                of_condition.setdefault(self.choices[k].condition, []).append(k)

        def make(condition: int) -> None:
            if choices := waiting.pop(condition, None):
                later = [k for k in of_condition[condition] if k > choices[-1] and k not in self.home]
                self._branch(path, [*choices, *(k for k in later if self._is_ready(k, len(path)))], items)

        for k in values:
            if k in self.home:
                continue
            inside = self._inside(k, len(path)) if k in self.choices and self._branches(k) else []
            for value in (k, *inside):
                for needed, _ in self._needs(value):
                    if (choice := self.choices.get(needed)) and needed in waiting.get(choice.condition, ()):
                        make(choice.condition)
            if k in self.choices and self._branches(k):
                waiting.setdefault(self.choices[k].condition, []).append(k)
            else:
                items.append(k)
                self.home[k] = items
                self._reach(k, items)
        for condition in list(waiting):
            make(condition)
        return items

    def _is_ready(self, choice: int, depth: int) -> bool:
        """Return whether all that a choice needs of this level and those around it is made."""
        inside = self._inside(choice, depth)
        needed = {value for each in (choice, *inside) for value, _ in self._needs(each)}
        return needed.difference(inside) <= self.home.keys()

    def _inside(self, choice: int, depth: int) -> list[int]:
        """Return the values that a choice needs in deeper levels and that are not made yet, in their order."""
        found, stack = set[int](), [choice]
        while stack:
            for value, _ in self._needs(stack.pop()):
                if value not in found and value not in self.home and len(self.path[value]) > depth:
                    found.add(value)
                    stack.append(value)
        return sorted(found)

    def _branch(self, path: Path, choices: list[int], items: list[Item]) -> None:
        """Append the branch that makes some choices of one condition."""
        condition = self.choices[choices[0]].condition
        branch = Branch(condition, choices, ([], []))
        inside = sorted({value for k in choices for value in self._inside(k, len(path))})
        items.append(branch)
        for side, wanted in zip(branch.sides, (True, False), strict=True):
            self.branch_of[id(side)] = (items, branch)
            deeper = (*path, (condition, wanted))
            self._level(deeper, [value for value in inside if self.path[value] == deeper], side)
        for k in choices:
            self.home[k] = items
            self._reach(k, items)
            for value, literal in self._needs(k):
                if literal is not None:
                    self._used(value, branch.sides[not literal[1]])

    def _reach(self, value: int, items: list[Item]) -> None:
        """Note where the values that a value needs are used; those of a choice's sides are noted by its branch."""
        sided = value in self.choices and self._branches(value)
        for needed, literal in self._needs(value):
            if not (sided and literal is not None):
                self._used(needed, items)

    def _used(self, value: int, items: list[Item]) -> None:
        """Let a value outlive its branches as far as a use of it in other items needs."""
        around = {id(each) for each in self._levels_of(items)}
        level = self.home[value]
        while id(level) not in around:
            level, branch = self.branch_of[id(level)]
            if value not in branch.outlives:
                branch.outlives.append(value)

    def _levels_of(self, items: list[Item]) -> Iterator[list[Item]]:
        """Yield a list of items and those around it."""
        yield items
        while id(items) in self.branch_of:
            items = self.branch_of[id(items)][0]
            yield items


def _common(first: Path, second: Path) -> Path:
    """Return what two paths begin with alike."""
    same = 0
    while same < min(len(first), len(second)) and first[same] == second[same]:
        same += 1
    return first[:same]
