"""Missions as source code for other computers: the autopilot of a mission in C99, with what it needs to fly alone."""
