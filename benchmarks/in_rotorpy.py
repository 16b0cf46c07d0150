"""The law and RotorPy's own SE3Control in RotorPy, side by side: a circle of 1 m at 0.2 Hz, commands at 500 Hz.

Both start 0.7 m off, at rest, and are told the same: the true state, or what the case makes of it.  The law knows mass, inertia and rotors
and nothing of the aerodynamics.  The figure is the RMS distance to the path over the last quarter of 12 s; SE3Control follows a point
that moves along the circle, the law the circle.  Steps of `Multirotor` are taken in the order of RotorPy's `simulate`.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import itertools
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from typing import Any, NamedTuple

import machine
import numpy as np
from scipy.spatial.transform import Rotation

import gammastar as gs
from gammastar.adapters import rotorpy
from gammastar.flight import PATH_FLYER

RATE, DURATION, FREQUENCY = 500.0, 12.0, 0.2  # [Hz], [s], [Hz]
START = (1.5, 0.0, -0.5)  # [m], third axis down
CIRCLE = gs.paths.circle(1.0)
POLES = {"hummingbird": -6.0, "crazyflie": -6.0}  # [1/s]
CALM, NOISY = (
    (40.0, 120.0),
    (25.0, 120.0),
)  # [rad/s] bandwidths of the observers of force and torque; best in noise: --search
UPSIDE_DOWN = 178.0  # [deg] of roll


@dataclasses.dataclass(frozen=True)
class Case:
    """Conditions of a flight, the same for both controllers, and what the law is to reach."""

    name: str
    vehicle: str = "hummingbird"
    aerodynamics: bool = True
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)  # [m/s] RotorPy's axes
    side_force: float = 0.0  # of the weight, along RotorPy's first axis
    latency: float = 0.0  # [s] of what is told; the law knows it
    roll: float = 0.0  # [deg] at the start
    seed: int | None = None  # of noise, none without
    believed_mass: float = 1.0  # of the true one, of the law alone
    observer: tuple[float, float] = CALM
    ratio: float | None = None  # of SE3Control's RMS to the law's, at least
    farthest: float | None = None  # [m] largest distance of the law, at most


NEAR = 1.1 * float(CIRCLE.global_distances(np.array([START]))[0])
CASES = (
    Case("aerodynamics", ratio=80),
    Case("no aerodynamics", aerodynamics=False, ratio=1000),
    Case("wind of 3 m/s", wind=(3.0, 0.0, 0.0), ratio=200),
    Case("believed mass -30 %", believed_mass=0.7, ratio=40),
    Case("believed mass +30 %", believed_mass=1.3, ratio=40),
    Case("side force of 0.3 m g", side_force=0.3, ratio=1),
    Case("latency of 30 ms", latency=0.03, ratio=1),
    Case("from 178 deg of roll", roll=UPSIDE_DOWN, ratio=80, farthest=NEAR),
    *(Case(f"noise, seed {seed}", seed=seed, observer=NOISY) for seed in range(3)),
    Case("crazyflie", vehicle="crazyflie", ratio=20),
    Case("crazyflie from 178 deg of roll", vehicle="crazyflie", roll=UPSIDE_DOWN, farthest=4.0),
)


class Result(NamedTuple):
    """What a flight came to."""

    rms: float  # [m] over the last quarter; infinite where it did not get there
    farthest: float  # [m]
    impossible: int  # intervals with a command beyond the rotors' limits, or no number


class Told:
    """A controller that is told states late and with errors."""

    def __init__(self, controller: Any, latency: float, errors: np.ndarray | None) -> None:
        self.controller, self.errors = controller, errors
        self.late: list[Mapping[str, Any]] = []
        self.pending, self.count = round(latency * RATE), 0

    def update(self, t: float, state: Mapping[str, Any], flat_output: Any) -> Any:
        """Return the commands for what is told now."""
        self.late = [*(self.late or [state] * self.pending), self._wrong(state)]
        self.count += 1
        return self.controller.update(t, self.late.pop(0), flat_output)

    def _wrong(self, state: Mapping[str, Any]) -> Mapping[str, Any]:
        if self.errors is None:
            return state
        x, v, turn, w = self.errors[self.count].reshape(4, 3)
        attitude = (Rotation.from_quat(state["q"]) * Rotation.from_rotvec(turn)).as_quat()
        return {**state, "x": state["x"] + x, "v": state["v"] + v, "q": attitude, "w": state["w"] + w}


def errors(seed: int, count: int) -> np.ndarray:
    """Return (count, 12) errors of `PATH_FLYER` in RotorPy's axes: each axis is drawn anew at its sensor's rate and held."""
    generator, columns = np.random.default_rng(seed), []
    for channel in PATH_FLYER.channels:
        for deviation, rate in zip(np.asarray(channel.deviation), np.asarray(channel.rate), strict=True):
            held = round(RATE / rate)
            columns.append(np.repeat(deviation * generator.standard_normal(count // held + 1), held)[:count])
    return np.column_stack(columns)


def trajectory() -> Any:
    """Return RotorPy's circle, flown the way in which the law flies it."""
    from rotorpy.trajectories.circular_traj import ThreeDCircularTraj

    return ThreeDCircularTraj(np.zeros(3), np.array([1.0, 1.0, 0.0]), np.full(3, FREQUENCY))


def controller_of(kind: str, case: Case, parameters: Mapping[str, Any]) -> Any:
    """Return 'se3' or 'law' for a case."""
    if kind == "se3":
        from rotorpy.controllers.quadrotor_control import SE3Control

        return SE3Control(parameters)
    vehicle = rotorpy.vehicle_of(parameters)
    believed = dataclasses.replace(vehicle, mass=case.believed_mass * vehicle.mass, latency=case.latency)
    law = gs.design(
        believed, CIRCLE, POLES[case.vehicle], approach=gs.Approach(), rejection=gs.Observer(*case.observer)
    )
    return rotorpy.Controller(law, speed=-2 * np.pi * FREQUENCY, rate=RATE)


def fly(kind: str, case: Case) -> Result:
    """Fly one controller through one case."""
    from rotorpy.vehicles.multirotor import Multirotor

    count = round(DURATION * RATE)
    parameters = rotorpy.parameters(case.vehicle)
    state = rotorpy.initial_state(parameters, gs.State(START, attitude=gs.so3.roll(case.roll)))
    abstraction = "cmd_ctbm" if kind == "se3" else "cmd_motor_speeds"
    vehicle = Multirotor(parameters, state, abstraction, aero=case.aerodynamics)
    vehicle.weight[0] = case.side_force * vehicle.mass * vehicle.g
    noise = None if case.seed is None else errors(case.seed, count)
    controller, flat = Told(controller_of(kind, case, parameters), case.latency, noise), trajectory()
    positions, impossible = [], 0
    for k in range(count):
        positions.append(state["x"])
        command = controller.update(k / RATE, state, flat.update(k / RATE))
        speeds = vehicle.get_cmd_motor_speeds(state, command)
        within = (speeds >= vehicle.rotor_speed_min) & (speeds <= vehicle.rotor_speed_max)
        impossible += not np.all(within)
        state["wind"] = np.array(case.wind)
        state = vehicle.step(state, command, 1 / RATE)
        if not np.linalg.norm(state["x"]) < 1e3:
            break
    distances = CIRCLE.global_distances(gs.frames.convert_vector(np.array(positions), "enu"))
    last = distances[3 * count // 4 :] if len(distances) == count else np.array([np.inf])
    return Result(float(np.sqrt(np.mean(last**2))), float(distances.max()), impossible)


def judged(case: Case, se3: Result, law: Result) -> str:
    """Return whether the law reaches what the case asks for."""
    if case.ratio is None and case.farthest is None:
        return ""
    reached = law.impossible == 0 and law.rms * (case.ratio or 0) <= se3.rms and law.rms < NEAR
    return "met" if reached and law.farthest <= (case.farthest or np.inf) else "MISSED"


def main() -> None:
    """Print one row a case; with --search the observers' bandwidths against noise."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", default="", help="only cases whose name contains this")
    parser.add_argument("--search", action="store_true", help="fly bandwidths of the observers against noise instead")
    options = parser.parse_args()
    print(machine.describe())
    with ProcessPoolExecutor() as pool:
        if options.search:
            search(pool)
            return
        cases = [case for case in CASES if options.cases in case.name]
        flights = {kind: pool.map(functools.partial(fly, kind), cases) for kind in ("se3", "law")}
        print(f"{'':<32}{'SE3Control':^24}{'gammastar':^24}")
        columns = 2 * f"{'RMS mm':>12}{'farthest m':>12}"
        print(f"{'case':<32}{columns}{'ratio':>11}{'wanted':>8}{'impossible':>12}")
        for case, se3, law in zip(cases, flights["se3"], flights["law"], strict=True):
            figures = "".join(f"{1e3 * each.rms:>12.4g}{each.farthest:>12.3f}" for each in (se3, law))
            wanted = f"{case.ratio:g}" if case.ratio else f"{case.farthest:g} m" if case.farthest else "-"
            verdict = judged(case, se3, law)
            print(
                f"{case.name:<32}{figures}{se3.rms / law.rms:>11.4g}{wanted:>8}{law.impossible:>12}  {verdict}",
                flush=True,
            )


def search(pool: ProcessPoolExecutor) -> None:
    """Print the RMS distance in noise over the observers' bandwidths, best first."""
    grid = list(itertools.product((15.0, 20.0, 25.0, 30.0), (60.0, 120.0)))
    cases = [Case("noise", seed=seed, observer=pair) for pair in grid for seed in range(3)]
    found = np.array([each.rms for each in pool.map(functools.partial(fly, "law"), cases)]).reshape(len(grid), -1)
    print(f"{'force rad/s':>12}{'torque rad/s':>14}{'RMS mm':>10}")
    for rms, (force, torque) in sorted(zip(np.sqrt(np.mean(found**2, axis=1)), grid, strict=True)):
        print(f"{force:>12g}{torque:>14g}{1e3 * rms:>10.3g}")


if __name__ == "__main__":
    main()
