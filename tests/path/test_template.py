"""Curves whose numbers are data are the curves that they were, and share a graph with others of their formula."""

from __future__ import annotations

import pickle
import threading
from typing import Any

import casadi as ca
import numpy as np
import pytest

from gammastar import so3
from gammastar.errors import PathError
from gammastar.path import Curve
from gammastar.path import catalogue as paths
from gammastar.path.formula import curve_from_formula
from gammastar.path.metres import by_length
from gammastar.path.placement import placed
from gammastar.path.template import TemplateCurve, read
from gammastar.taylor import Series

TURN = so3.exp(np.array([0.3, 0.2, -0.4]))
WAVE = {"x": "a*cos(lambda)", "y": "sin(lambda)", "z": "exp(-(a*sin(lambda))**2)/(3 + sin(lambda))**0.5"}
MADE: dict[str, Curve] = {
    **{name: getattr(paths, name)() for name in sorted(set(paths.__all__) - {"polynomial"})},
    "polynomial": paths.polynomial([[0, 1, 2], [0, 0, 1, 3], [1]]),
    "rising lemniscate": paths.lemniscate(0.7, 1.3, kind="rising"),
    "turned circle": paths.circle(0.3, (1, 2, 3), (1, 1, 0.3)),
    "placed knot": placed(placed(paths.trefoil(2.3, -0.7), (1, 2, 3), TURN, 2.0), (0, 0, 1), TURN),
    "formula": curve_from_formula(**WAVE, period="2*pi", constants={"a": 0.7}),
    "powers": curve_from_formula("(3 + lambda)**1.3", "(2 + lambda)**(-2.2)", "(4 + lambda)**2.5", domain=(-1, 1)),
    "choices": Curve(lambda s: (ca.fmin(3 * s, 40), ca.if_else(s > 50, 0, s**2), ca.sqrt(4 + s) ** 3), domain=(0, 2)),
}


@pytest.mark.parametrize("name", MADE)
def test_every_derivative_stays(name: str) -> None:
    """To rounding: constants are multiplied in another order."""
    path = MADE[name]
    grid = np.linspace(*path.domain, 53)
    jets = path.jets(grid)
    sizes = 1 + np.abs(jets).max(axis=(0, 2), keepdims=True)
    np.testing.assert_allclose(path.with_data().jets(grid) / sizes, jets / sizes, atol=1e-14)


def test_the_law_sees_the_same_outputs() -> None:
    """Those of `outputs` along a position series, and the foot that `track` finds."""
    path = MADE["placed knot"]
    states, places = np.random.default_rng(0).normal(size=(2, 3, 4))[0], [path.domain[0] + 0.3]
    symbols, told = [ca.SX.sym("x", 3) for _ in range(4)], list[np.ndarray]()
    for each in (path, path.with_data()):
        place = ca.SX.sym("place", 1 + each.data_size)
        out = each.outputs(Series.from_derivatives(symbols), place)
        graphs = [out.transverse, out.tangential, out.transverse_drift, out.tangential_drift, out.focal_margin]
        graph = ca.Function("out", [*symbols, place], [ca.veccat(*graphs, each.track(symbols[0], place))])
        near = each.points(np.array(places))[0] + 0.1 * states[:, 0]
        told.append(graph(near, *states.T[1:], np.concatenate([places, each.data(np.array(places))[:, 0]])).full())
    np.testing.assert_allclose(told[1], told[0], rtol=1e-12, atol=1e-12 * np.abs(told[0]).max())


@pytest.mark.parametrize(
    "alike",
    [
        [
            paths.circle(),
            paths.circle(2.0, (0, 0, 10)),
            paths.circle(10.0, (0, 10, 10), (0, 0, -1)),
            MADE["turned circle"],
        ],
        [paths.ellipse((2, 1)), paths.ellipse((2, 2), (2, 0, 0)), paths.circle(1.7)],
        [paths.trefoil(r, h) for r, h in ((3.0, 1.0), (1.0, -2.0), (0.7, 0.7))],
        [curve_from_formula(**WAVE, period="2*pi", constants={"a": a}) for a in (3, 1, 2, -0.7)],
        [by_length(paths.circle(r)) for r in (1.0, 1.3)],
        [paths.lissajous(frequencies=counts, phases=(90, 70, 0)) for counts in ((1, 2, 3), (2, 3, 5))],
        [curve_from_formula("lambda", f"(3 + lambda)**{p}", "0", domain=(-1, 1)) for p in (-2.1, 1.3, 2.7)],
        [Curve(lambda s, a=a: (s, a * ca.sin(s), a)) for a in (0, 1, 2.5)],
    ],
    ids=["circles", "ellipses", "knots", "formulas", "by length", "waves", "powers", "callables"],
)
def test_curves_of_one_formula_have_one_graph(alike: list[Any]) -> None:
    """Whatever their numbers are: zero, one, two, or the same twice."""
    assert len({path.with_data().graph_key for path in alike}) == 1
    assert len({path.graph_key for path in alike}) == len(alike)


def test_curves_of_other_formulas_have_another_graph() -> None:
    powers = [curve_from_formula("lambda", f"(3 + lambda)**{p}", "0", domain=(-1, 1)) for p in (2, 2.5)]
    knots = [paths.torus_knot(2, 3), paths.trefoil(), paths.helix(), paths.line()]
    assert len({path.with_data().graph_key for path in [*powers, *knots]}) == 6


def test_a_power_of_zero_keeps_its_derivatives() -> None:
    """Its exponent is no data: as such it would be exp(p log x), which has none at zero."""
    path = curve_from_formula("lambda", "a*lambda**3", "0", constants={"a": 2.0}).with_data()
    assert path.jets(np.zeros(1))[0, :, 1] == pytest.approx([0, 0, 0, 12, 0, 0], abs=1e-15)


def test_what_is_multiplied_by_zero_need_not_be_finite() -> None:
    """It is not there: the curve is the one without."""
    path = curve_from_formula("lambda", "a*sqrt(lambda)", "b/lambda", domain=(-1, 1), constants={"a": 0, "b": 0})
    assert path.jets(np.array([-1.0, 0.0])).tolist() == paths.line().jets(np.array([-1.0, 0.0])).tolist()
    assert path.with_data() is path


def test_casadi_simplifies_again_afterwards() -> None:
    """Also after a formula that cannot be read."""
    with pytest.raises(PathError, match="must work on CasADi symbols"):
        Curve(lambda s: (s if s > 0 else -s, s, s))
    x = ca.SX.sym("x")
    assert (0 + 1 * x).is_symbolic()


def test_casadi_simplifies_again_after_two_threads_at_once() -> None:
    """CasADi has one switch for all threads: the second must not take what the first has set for what was there before."""
    events = {name: threading.Event() for name in ("first begins", "second begins", "first is done")}

    def formula(begins: str, waits_for: str) -> Any:
        events[begins].set()
        events[waits_for].wait(0.2)
        symbol = ca.SX.sym("parameter")
        return ca.Function("point", [symbol], [symbol, symbol, symbol])

    first = threading.Thread(target=lambda: read(lambda: formula("first begins", "second begins")))
    second = threading.Thread(target=lambda: read(lambda: formula("second begins", "first is done")))
    first.start()
    events["first begins"].wait()
    second.start()
    first.join()
    events["first is done"].set()
    second.join()
    try:
        assert ca.GlobalOptions.getSimplificationOnTheFly()
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(True)


def test_a_curve_by_its_numbers_is_a_path_like_any_other() -> None:
    path = MADE["placed knot"]
    made = path.with_data()
    assert isinstance(made, TemplateCurve)
    assert made.with_data() is made
    assert made.start_parameter(np.array([1.0, 2.0, 3.0])) == pytest.approx(path.start_parameter(np.array([1, 2, 3])))
    again = pickle.loads(pickle.dumps(made))
    assert again.graph_key == made.graph_key
    assert again.jets(np.ones(1)) == pytest.approx(made.jets(np.ones(1)))
    assert made.length() == pytest.approx(path.length())
    assert (made.period, made.domain, made.ends) == (path.period, path.domain, path.ends)
