"""The paper's Figures 3 to 17: what each shows and what the paper says of it, in our words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gammastar.report import judgement
from gammastar.report.verdict import Context, Judgement

SCENARIOS = {
    "upright": ("VI-A", "Almost upright start"),
    "upside-down": ("VI-B", "Almost upside-down start"),
    "noisy": ("VI-C", "Sensor noise and wrong parameters"),
}
SHOWN = {  # name of our drawing -> what it shows
    "path": "path in space",
    "states": "transformed states",
    "velocities": "translational velocities",
    "rates": "angular velocities",
    "inputs": "thrust and torques",
}


@dataclass(frozen=True)
class Message:
    """One figure of the paper and what it is there to show."""

    number: int  # of the figure, in the paper and here
    scenario: str  # key of SCENARIOS, and name of the mission
    drawing: str  # key of SHOWN, and name of our drawing
    claim: str  # in our words
    judge: Callable[[Context], Judgement]

    @property
    def section(self) -> str:
        """Return the paper's section that discusses the figure."""
        return SCENARIOS[self.scenario][0]

    @property
    def title(self) -> str:
        """Return the caption of our figure."""
        return f"Figure {self.number}: {SHOWN[self.drawing]}, {SCENARIOS[self.scenario][1].lower()}"

    @property
    def stem(self) -> str:
        """Return the name of our files, without an ending."""
        return f"figure-{self.number:02d}"


MESSAGES = (
    Message(
        3,
        "upright",
        "path",
        "From (3.2, 5, 0) m the vehicle converges to the circle, and once on it stays on it: the path is invariant.",
        judgement.judge_path,
    ),
    Message(
        4,
        "upright",
        "states",
        "All ξ converge to zero, so the flight reaches Γ*. The place on the circle η₁₁ runs between −π and π, and its rate η₁₂ "
        "settles at the commanded 1 rad/s.",
        judgement.judge_states,
    ),
    Message(
        5,
        "upright",
        "velocities",
        "To keep 1 rad/s the vehicle moves at about ±1 m/s in x and y; the circle is level, so v_z is zero.",
        judgement.judge_velocities,
    ),
    Message(
        6, "upright", "rates", "The body rates along the flight; r is commanded to be zero.", judgement.judge_rates
    ),
    Message(
        7,
        "upright",
        "inputs",
        "Torques and total thrust stay in a range that is reasonable for commonly available quadrotors.",
        judgement.judge_inputs,
    ),
    Message(
        8,
        "upside-down",
        "path",
        "From almost upside down the vehicle recovers and follows the circle. It has to flip on the way, and passes through "
        "gimbal lock, which nine attitude coordinates do not have.",
        judgement.judge_inverted_path,
    ),
    Message(
        9, "upside-down", "states", "The transformed states behave as in the first scenario.", judgement.judge_states
    ),
    Message(
        10, "upside-down", "velocities", "The velocities behave as in the first scenario.", judgement.judge_velocities
    ),
    Message(
        11, "upside-down", "rates", "The body rates along the flight; r is commanded to be zero.", judgement.judge_rates
    ),
    Message(
        12,
        "upside-down",
        "inputs",
        "The peak effort is greater than in the first scenario because of the flip, yet within what a typical acrobatic quadrotor "
        "can do.",
        judgement.judge_inverted_inputs,
    ),
    Message(
        13,
        "noisy",
        "path",
        "From upside down, with sensor noise, 1 % error in the mass and 10 % in the inertia, the path is followed satisfactorily.",
        judgement.judge_noisy,
    ),
    Message(
        14, "noisy", "states", "The transformed states in spite of noise and errors.", judgement.judge_noisy_states
    ),
    Message(
        15, "noisy", "velocities", "The velocities in spite of noise and errors.", judgement.judge_noisy_velocities
    ),
    Message(16, "noisy", "rates", "The body rates in spite of noise and errors.", judgement.judge_noisy_rates),
    Message(
        17,
        "noisy",
        "inputs",
        "Thrust and torques are well within the bounds of a typical acrobatic quadrotor.",
        judgement.judge_inputs,
    ),
)
