"""Valve tests: plan and analyse ramp and step tests."""

from stiction.simulation.ramp_plan import plan_ramp_test
from stiction.simulation.step_plan import plan_step_test
from stiction.simulation.valve_test_plan import TestPlan
from stiction.valvetests.compare import TestComparison, compare_tests
from stiction.valvetests.ramp import analyse_ramp
from stiction.valvetests.ramp_result import RampTest
from stiction.valvetests.result import ValveTest
from stiction.valvetests.step import analyse_steps
from stiction.valvetests.step_result import StepTest

__all__ = [
    "RampTest",
    "StepTest",
    "TestComparison",
    "TestPlan",
    "ValveTest",
    "analyse_ramp",
    "analyse_steps",
    "compare_tests",
    "plan_ramp_test",
    "plan_step_test",
]
