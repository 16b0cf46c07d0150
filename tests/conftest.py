"""What every test shares: the settings of Hypothesis, and figures that need no screen."""

import os

from hypothesis import settings

os.environ.setdefault("MPLBACKEND", "Agg")

# Same source, same verdict: the suite draws the same examples in every run, and a slow machine is not a failure.
# `pytest --hypothesis-profile explore` looks for new ones.
settings.register_profile("repeat", derandomize=True, deadline=None)
settings.register_profile("explore", max_examples=2000, deadline=None, print_blob=True)
settings.load_profile("repeat")
