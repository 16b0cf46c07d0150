"""The outputs of a path from the jet of its curve alone: one law serves every curve, in any parameterisation.

With e = chi - sigma(lambda) and lambda solving <e, sigma'> = 0 along the flight, the transverse output is e itself, and
xi_{k+1} = P d/dt xi_k with the projector P onto the normal plane.  In any rotation-minimising frame the components of xi_k are
plain derivatives of the components of e, so this is the paper's construction without a frame: nothing to compute, store or close
up around a loop, and zero curvature is no special case.
"""

from __future__ import annotations

import math
from typing import Any

import casadi as ca

from gammastar.path.base import ORDER, PathOutputs
from gammastar.taylor import Series

Jet = tuple[Any, ...]
"""Graph: (sigma, sigma', ..., sigma^(k)), SX (3,) each, at one parameter."""


def outputs_from_jet(jet: Jet, position: Series, parameter: Any) -> PathOutputs:
    """Graph: return the outputs from a curve's jet (sigma, ..., sigma^(5)) alone: one law serves every curve.

    lambda(t) solves <chi - sigma(lambda), sigma'(lambda)> = 0 order by order; each order costs one division by
    |sigma'|^2 - <e, sigma''>, which vanishes at focal points.
    """
    chi = Series((*position.coefficients[:ORDER], ca.SX(3, 1)))
    slope = ca.dot(jet[1], jet[1]) - ca.dot(chi.coefficients[0] - jet[0], jet[2])
    step: list[Any] = [ca.SX(0)]
    for k in range(1, ORDER + 1):
        trial = Series((*step, ca.SX(0)))
        error = chi.truncated(k) - along(jet, trial)
        step.append(error.dot(along(jet[1:], trial)).coefficients[k] / slope)
    progress = Series(tuple(step))
    error, tangent = chi - along(jet, progress), along(jet[1:], progress)
    fields = [error]
    for _ in range(ORDER):
        fields.append(_normal_part(fields[-1].rate(), tangent))
    rates = progress.derivatives()
    speed_squared = ca.dot(jet[1], jet[1])
    drift, rate_drift = fields[ORDER].coefficients[0], rates[ORDER]

    def snap(transverse_rate: Any, tangential_rate: Any) -> Any:
        across = transverse_rate - drift
        forward = (slope * (tangential_rate - rate_drift) - ca.dot(jet[1], across)) / speed_squared
        return across + forward * jet[1]

    return PathOutputs(
        transverse=ca.horzcat(*(f.coefficients[0] for f in fields[:ORDER])),
        tangential=ca.vertcat(parameter, *rates[1:ORDER]),
        transverse_drift=drift,
        tangential_drift=rate_drift,
        transverse_gradient=ca.SX.eye(3) - ca.mtimes(jet[1], jet[1].T) / speed_squared,
        tangential_gradient=jet[1].T / slope,
        focal_margin=slope / speed_squared,
        snap=snap,
    )


def position_from_outputs(jet: Jet, transverse: Any, tangential: Any) -> Series:
    """Graph: return the position series with these outputs, the inverse of `outputs_from_jet`.

    Args:
        jet: Of the curve at tangential[0], at least as long as there are columns.
        transverse: SX (3, k), vectors of the normal plane: value to (k-1)-th derivative.
        tangential: SX (k,), the parameter and its derivatives.
    """
    order = transverse.shape[1] - 1
    step = Series.from_derivatives([ca.SX(0), *ca.vertsplit(tangential[1:])])
    tangent = along(jet[1:], step)
    field = Series((transverse[:, order],))
    for k in reversed(range(order)):
        field = _normal_field(transverse[:, k], field, tangent)
    return along(jet, step) + field


def along(jet: Jet, step: Series) -> Series:
    """Graph: return the series of sigma(lambda + step(t)) from the jet of sigma at lambda; step starts at zero."""
    coefficients = [jet[0], *(ca.SX(*jet[0].shape) for _ in range(step.order))]
    powers = [step]
    for _ in range(step.order - 1):
        powers.append(powers[-1] * step)
    for k, power in reversed(list(enumerate(powers, start=1))):  # the newest coefficient of the step enters last
        for i in range(k, step.order + 1):  # the first k coefficients of step^k are zero
            coefficients[i] = coefficients[i] + jet[k] / math.factorial(k) * power.coefficients[i]
    return Series(tuple(coefficients))


def _normal_part(field: Series, tangent: Series) -> Series:
    """Graph: return P field, the part orthogonal to the tangent."""
    share = field.dot(tangent) / tangent.dot(tangent)
    return field - share * tangent


def _normal_field(value: Any, normal_rate: Series, tangent: Series) -> Series:
    """Graph: return the normal field w, w(0) = value, P w' = normal_rate.

    The rest of w' follows from <tangent, w> = 0: w' = normal_rate - tangent <tangent', w> / |tangent|^2.
    """
    field = Series((value,))
    turning, square = tangent.rate(), tangent.dot(tangent)
    for _ in range(normal_rate.order + 1):
        share = turning.dot(field) / square
        field = (normal_rate - share * tangent).truncated(field.order).integrated_from(value)
    return field
