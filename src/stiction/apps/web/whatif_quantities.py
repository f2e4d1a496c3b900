"""What the what-if screen can move: the numbers with their units and limits, and the models to choose from."""

from __future__ import annotations

from stiction.apps.web.screen_settings import Quantity

__all__ = ["COMPENSATORS", "QUANTITIES", "VALVE_MODELS"]

VALVE_MODELS = {
    "kano": "Kano: S and J",
    "choudhury": "Choudhury: S and J",
    "he": "He: rests after every move",
    "stenman": "Stenman: one band d = (S + J) / 2",
    "srinivasan": "Three parameters: sb, sj and a rate r",
    "ideal": "Good valve: no stiction",
}
"""Name of a valve model in the address -> its name on the screen."""
COMPENSATORS = {
    "none": "None",
    "Knocker": "Knocker",
    "ConstantReinforcement": "Constant reinforcement",
    "VariablePulses": "Variable pulses",
    "Cuadros": "Knocker that stops",
    "IntegralDeadband": "Integral deadband",
    "TwoMove": "Two moves",
    "FourMove": "Four moves",
}
"""Name of a compensator in the address -> its name on the screen."""


QUANTITIES = {
    "S": Quantity("Deadband plus stickband S", "% of span", 0.0, 100.0, "linear", "valve"),
    "J": Quantity("Slip jump J", "% of span", 0.0, 100.0, "linear", "valve"),
    "r": Quantity("Rate r below which the stem sticks again", "% of span / s", 0.0, 1e4, "log", "valve"),
    "Kc": Quantity("Controller gain Kc", "% of span per PV unit", -1e6, 1e6, "log", "controller"),
    "Ti": Quantity("Integral time Ti", "s", 1e-3, 1e7, "log", "controller"),
    "Td": Quantity("Derivative time Td", "s", 0.0, 1e6, "linear", "controller"),
    "gain": Quantity("Process gain", "PV units per % of span", -1e6, 1e6, "log", "process"),
    "tau": Quantity("Time constant", "s", 0.0, 1e7, "log", "process"),
    "dead_time": Quantity("Dead time", "s", 0.0, 1e6, "linear", "process"),
    "lag": Quantity("Second time constant", "s", 0.0, 1e6, "linear", "process"),
    "noise": Quantity("Noise of the PV (standard deviation)", "PV units", 0.0, 1e6, "linear", "simulation"),
    "duration": Quantity("Time shown", "s", 1e-2, 1e8, "log", "simulation"),
    "dt": Quantity("Sampling period", "s", 1e-4, 1e5, "log", "simulation"),
    "sp": Quantity("Set point", "PV units", -1e12, 1e12, "linear", "simulation"),
    "op": Quantity("Mean OP", "% of span", -1e3, 1e3, "linear", "simulation"),
    "op_low": Quantity("Lower limit of OP", "% of span", -1e9, 1e9, "linear", "simulation"),
    "op_high": Quantity("Upper limit of OP", "% of span", -1e9, 1e9, "linear", "simulation"),
}
"""Name in the address -> what the number is."""
