"""The closed loop: integrators, sampling, sensors, and the record of a flight."""

from gammastar.flight.band import Band, noise_band
from gammastar.flight.flights import Flights
from gammastar.flight.fly import fly
from gammastar.flight.integrator import INTEGRATORS, Integrator, integrator
from gammastar.flight.many import fly_many
from gammastar.flight.noise import SensorNoise
from gammastar.flight.phases import Phase, Replacement
from gammastar.flight.record import FlightRecord, Status
from gammastar.flight.sensors import PATH_FLYER, Channel, Sensors
from gammastar.flight.summary import Summary
from gammastar.flight.wind import Gusts, Wind

__all__ = [
    "INTEGRATORS",
    "FlightRecord",
    "Flights",
    "Gusts",
    "Integrator",
    "Phase",
    "Replacement",
    "PATH_FLYER",
    "Band",
    "Channel",
    "SensorNoise",
    "Sensors",
    "Status",
    "Summary",
    "Wind",
    "fly",
    "fly_many",
    "integrator",
    "noise_band",
]
