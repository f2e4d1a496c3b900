"""A simulator of control loops that shares no code with the first one; it only validates.

The valve is a mass with Karnopp friction on a spring-and-diaphragm actuator, integrated in time. Controllers,
processes, loads and the historian are written from the literature for this package alone.
"""

from calibration.second_simulator.sample import CAUSES, SimulatedLoop, Truth, sample_loop

__all__ = ["CAUSES", "SimulatedLoop", "Truth", "sample_loop"]
