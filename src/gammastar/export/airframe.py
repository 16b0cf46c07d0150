"""The vehicle that an export was made for, as its README tells it: whoever connects rotors has to know which is the first."""

from __future__ import annotations

import numpy as np

from gammastar.export.program import Program


def airframe(program: Program) -> str:
    """Return tables in Markdown: mass, inertia and gravity, and each rotor with its place [m] in the body axes of the export."""
    vehicle = program.autopilot.vehicle
    inertia = np.array(vehicle.inertia)
    told = _listed(np.diag(inertia))
    if np.any(inertia != np.diag(np.diag(inertia))):
        signs = program.graphs.outside(np.ones(3))
        told = "; ".join(map(_listed, inertia * np.outer(signs, signs)))
    rows = [
        "| | |",
        "|---|---|",
        f"| mass | {vehicle.mass:.6g} kg |",
        f"| inertia | {told} kg m² |",
        f"| gravity | {vehicle.gravity:.6g} m/s² |",
    ]
    rotors = vehicle.rotors
    if rotors is None:
        return "\n".join(rows)
    up, down = np.asarray(rotors.lag)
    rows.append(
        f"| rotors | {rotors.slowest:.6g} to {rotors.fastest:.6g} rad/s, lag {up:.6g} s up, {down:.6g} s down |"
    )
    rows += [
        "",
        "| rotor | place [m] | turns, from above | thrust [N s²/rad²] | torque [N m s²/rad²] |",
        "|---|---|---|---|---|",
    ]
    places = program.graphs.outside(np.array(rotors.positions))
    columns = places, rotors.spins, rotors.thrust_coefficient, rotors.torque_coefficient
    for number, (place, spin, thrust, torque) in enumerate(zip(*map(np.asarray, columns), strict=True), start=1):
        turn = "clockwise" if spin > 0 else "anticlockwise"
        rows.append(f"| {number} | {_listed(place)} | {turn} | {thrust:.6g} | {torque:.6g} |")
    return "\n".join(rows)


def _listed(numbers: object) -> str:
    """Return numbers with commas; rounding about zero is zero."""
    return ", ".join(f"{x + 0.0:.6g}" for x in np.round(np.atleast_1d(np.asarray(numbers, dtype=float)), 12))
