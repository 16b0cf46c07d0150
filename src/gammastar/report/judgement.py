"""Whether our flights bear out what the paper says of its figures; every verdict is computed from the numbers beside it."""

from __future__ import annotations

from gammastar.figures.windows import distance_text
from gammastar.report.measures import Measures
from gammastar.report.verdict import Context, Judgement, Verdict

STILL = 1e-6  # what counts as zero over the last lap of an exact flight; at the default poles the decay has reached 1e-8 there
SPEED = 1.0  # [rad/s] and, at a radius of 1 m, [m/s]: section VI's eta_12^ref
SPEED_TOLERANCE = 0.02  # of "about one metre per second"
PLAUSIBLE_ARM = 0.4  # [m] of a rotor; the 4.34 kg vehicle of Lee, Leok, McClamroch (CDC 2010) has 0.315 m
NOISY_TOLERANCE = 0.1  # [m/s] of "about one metre per second" with sensor noise, chosen by us


def judge_path(context: Context) -> Judgement:
    """Convergence to the circle, and path invariance after it."""
    summary, lap = context.own["summary"], context.own["last_lap"]
    invariant = lap["distance_m"]["max"] <= STILL
    return Judgement(
        _verdict(summary["settled"] and invariant),
        (
            ("distance at the start", _of(summary["distance_m"]["start"], "m")),
            (
                f"within {distance_text(summary['settled_within_m'])} after",
                _of(summary["settling_time_s"]["measured"], "s"),
            ),
            ("largest distance in the last lap", _of(lap["distance_m"]["max"], "m")),
        ),
    )


def judge_inverted_path(context: Context) -> Judgement:
    """As `judge_path`, and the flip with the gimbal lock it is said to pass."""
    base, own = judge_path(context), context.own
    locked = own["largest_pitch_deg"] >= 89.5
    over = own["tilt_deg"]["start"] > 90 > own["tilt_deg"]["end"]
    remark = (
        "The recovery and the turn from upside down to upright hold. Yaw-pitch-roll angles lock at a pitch of 90°: "
        f"this flight {'passes there' if locked else 'comes near but does not pass there'}."
    )
    kept = base.verdict is Verdict.HOLDS and over
    return Judgement(
        Verdict.FAILS if not kept else Verdict.HOLDS if locked else Verdict.PARTLY,
        (
            *base.numbers,
            ("tilt at the start and the end", f"{own['tilt_deg']['start']:.1f}° and {own['tilt_deg']['end']:.1f}°"),
            ("tilt below 90° after", _of(own["last_time_beyond_90_deg_tilt_s"], "s")),
            ("largest pitch", f"{own['largest_pitch_deg']:.1f}°"),
        ),
        remark,
    )


def judge_states(context: Context) -> Judgement:
    """All xi to zero and the commanded speed along the path."""
    lap = context.own["last_lap"]
    largest = max(*lap["transverse_state"]["xi_1"], *lap["transverse_state"]["xi_2"])
    speed = lap["speed_along_path_rad_s"]
    error = max(abs(speed["min"] - SPEED), abs(speed["max"] - SPEED))
    return Judgement(
        _verdict(largest <= STILL and error <= STILL),
        (
            ("largest of all eight ξ in the last lap", f"{largest:.2g} in SI units"),
            ("largest |η₁₂ − 1 rad/s| in the last lap", _of(error, "rad/s")),
        ),
        "η₁₁ is drawn wrapped to (−π, π]; inside, it counts laps and never jumps.",
    )


def judge_velocities(context: Context) -> Judgement:
    """About one metre per second in x and y, none in z."""
    velocity = context.own["last_lap"]["velocity_m_s"]
    level = all(abs(velocity[axis] - SPEED) <= SPEED_TOLERANCE for axis in "xy")
    peak = context.own["summary"]["peak_speed_m_s"]
    return Judgement(
        _verdict(level and velocity["z"] <= STILL),
        (
            ("largest |v_x|, |v_y| in the last lap", f"{velocity['x']:.4f} and {velocity['y']:.4f} m/s"),
            ("largest |v_z| in the last lap", _of(velocity["z"], "m/s")),
            ("largest speed on the way there", _of(peak, "m/s")),
        ),
    )


def judge_rates(context: Context) -> Judgement:
    """The figure only shows; what section VI asks for is r = 0."""
    own = context.own
    rates = own["last_lap"]["rates_rad_s"]
    return Judgement(
        _verdict(own["largest_yaw_rate_rad_s"] <= STILL),
        (
            ("peak rate", _of(own["summary"]["peak_rate_rad_s"], "rad/s")),
            ("largest |r| of the whole flight", _of(own["largest_yaw_rate_rad_s"], "rad/s")),
            ("largest |p|, |q| in the last lap", f"{rates['p']:.3f} and {rates['q']:.3f} rad/s"),
        ),
        "The paper puts no number to these rates; the verdict is about r = 0.",
    )


def judge_inputs(context: Context) -> Judgement:
    """Whether the effort suits a usual quadrotor."""
    plausible = context.own["smallest_rotor_arm_m"] <= PLAUSIBLE_ARM
    return Judgement(
        Verdict.HOLDS if plausible else Verdict.PARTLY, _input_numbers(context.own), _arm_remark(context.own)
    )


def judge_inverted_inputs(context: Context) -> Judgement:
    """Whether the inverted start takes more effort than the upright one, and whether it suits a usual quadrotor."""
    torque = {name: own["summary"]["peak_torque_N_m"] for name, own in context.others.items()}
    more = torque["upside-down"] > torque["upright"]
    plausible = context.own["smallest_rotor_arm_m"] <= PLAUSIBLE_ARM
    equal = context.effort["equal_torque_pole_per_s"]
    limit = (
        ""
        if equal is None
        else f" In closed form it does so for equal poles slower than {_minus(equal)} 1/s only; see the table."
    )
    comparison = (
        f"The inverted start takes {'more' if more else 'less'} torque here: {torque['upside-down']:.2f} N m "
        f"against {torque['upright']:.2f} N m."
    )
    return Judgement(
        Verdict.HOLDS if more and plausible else Verdict.PARTLY if more or plausible else Verdict.FAILS,
        _input_numbers(context.own),
        f"{comparison}{limit} {_arm_remark(context.own)}",
    )


def judge_noisy(context: Context) -> Judgement:
    """Satisfactory following in spite of noise and wrong parameters: settled by the mission's own measure."""
    summary, lap = context.own["summary"], context.own["last_lap"]
    ratio, below = context.own["true_over_believed"], lap["mean_transverse_output"][1]
    inertia = ", ".join(f"{value - 1:+.0%}" for value in ratio["inertia"])
    return Judgement(
        _verdict(summary["settled"]),
        (
            (
                f"within {distance_text(summary['settled_within_m'])} after",
                _of(summary["settling_time_s"]["measured"], "s"),
            ),
            ("RMS distance after settling", _of(summary["distance_m"]["rms_after_settling"], "m")),
            ("largest distance after settling", _of(summary["distance_m"]["max_after_settling"], "m")),
            ("largest distance in the last lap", _of(lap["distance_m"]["max"], "m")),
            ("mean depth below the circle in the last lap", _of(below, "m")),
            ("mass and inertia, true against believed", f"{ratio['mass'] - 1:+.0%}; {inertia}"),
        ),
        "The noise table that the paper cites could not be found; noise measured on another small quadrotor stands in for it, as the "
        "mission file says. The depth comes from the wrong mass: the law has no integrator that would remove it.",
    )


def judge_noisy_states(context: Context) -> Judgement:
    """The chains near zero and the speed near its reference, as far as noise lets them."""
    summary, lap = context.own["summary"], context.own["last_lap"]
    speed = lap["speed_along_path_rad_s"]
    return Judgement(
        _verdict(summary["settled"]),
        (
            ("largest |ξ₁₁|, |ξ₂₁| in the last lap", _pair(lap, "m²", "m")),
            ("η₁₂ in the last lap", f"{speed['min']:.3f} to {speed['max']:.3f} rad/s, mean {speed['mean']:.3f} rad/s"),
        ),
        "The states shown are the true ones. The law divides by the measured distance to the axis, so noise in position biases the "
        "speed that it keeps.",
    )


def judge_noisy_velocities(context: Context) -> Judgement:
    """As without noise, within a tolerance."""
    velocity = context.own["last_lap"]["velocity_m_s"]
    near = all(abs(velocity[axis] - SPEED) <= NOISY_TOLERANCE for axis in "xy") and velocity["z"] <= NOISY_TOLERANCE
    return Judgement(
        _verdict(near),
        (
            ("largest |v_x|, |v_y| in the last lap", f"{velocity['x']:.3f} and {velocity['y']:.3f} m/s"),
            ("largest |v_z| in the last lap", _of(velocity["z"], "m/s")),
        ),
        f"The velocities are those of the true vehicle, not the measured ones. The verdict allows {NOISY_TOLERANCE:g} m/s.",
    )


def judge_noisy_rates(context: Context) -> Judgement:
    """The figure only shows."""
    rates = context.own["last_lap"]["rates_rad_s"]
    return Judgement(
        _verdict(context.own["summary"]["settled"]),
        (
            ("peak rate", _of(context.own["summary"]["peak_rate_rad_s"], "rad/s")),
            ("largest |p|, |q|, |r| in the last lap", ", ".join(f"{rates[name]:.3f}" for name in "pqr") + " rad/s"),
        ),
        "The paper puts no number to these rates; the verdict is that the flight settles.",
    )


def _input_numbers(own: Measures) -> tuple[tuple[str, str], ...]:
    summary, lap = own["summary"], own["last_lap"]
    relative = summary["thrust_to_weight"]
    return (
        ("thrust", f"{summary['thrust_N']['min']:.3f} to {summary['thrust_N']['max']:.3f} N"),
        ("thrust over weight", f"{relative['min']:.2f} to {relative['max']:.2f}"),
        ("peak torque", _of(summary["peak_torque_N_m"], "N m")),
        ("largest torque in the last lap", _of(lap["torque_N_m"], "N m")),
        ("shortest rotor arm that could give it", _of(own["smallest_rotor_arm_m"], "m")),
    )


def _arm_remark(own: Measures) -> str:
    plausible = own["smallest_rotor_arm_m"] <= PLAUSIBLE_ARM
    return (
        f"The thrust stays at or below {own['summary']['thrust_to_weight']['max']:.2f} times the weight. The torque is "
        f"{'plausible' if plausible else 'not that of a usual quadrotor'}: rotors that together push with T at an arm ℓ give at most "
        f"T ℓ, so this flight takes arms of at least {own['smallest_rotor_arm_m']:.2g} m on a vehicle of 0.1 kg."
    )


def _minus(value: float) -> str:
    return f"{value:.2f}".replace("-", "−")


def _pair(lap: Measures, first: str, second: str) -> str:
    return f"{lap['transverse_state']['xi_1'][0]:.3f} {first} and {lap['transverse_state']['xi_2'][0]:.3f} {second}"


def _verdict(holds: bool) -> Verdict:
    return Verdict.HOLDS if holds else Verdict.FAILS


def _of(value: float | None, unit: str) -> str:
    """Return a number with three digits and its unit, or words when there is none."""
    return "not reached" if value is None else f"{value:.3g} {unit}"
