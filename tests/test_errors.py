"""Errors cross to other processes with what they carry."""

import pickle

import pytest

from gammastar import errors

CARRYING = [
    errors.RotationError("not a rotation", 0.5),
    errors.UnknownNameError("feedback", "midle", ["start", "middle"]),
    errors.UnknownColumnError("column", "distance_m", ["final_distance_m"]),
    errors.MissionError("no such key", "path.radius"),
    errors.SingularStartError("no thrust", {"thrust_N": 0.0}),
    errors.PredictionError("beyond a focal point", 1.5),
    errors.MissingExtraError("pyarrow", "data", "a table"),
    errors.CompilerError("refuses", "step.log"),
    errors.PathError("stands still"),
]


@pytest.mark.parametrize("error", CARRYING, ids=lambda error: type(error).__name__)
def test_an_error_survives_pickling(error: errors.GammastarError) -> None:
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert vars(again) == vars(error)
