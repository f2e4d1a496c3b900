"""
Stiction, tight tuning, outside disturbance
===========================================

Three loops oscillate. The verdict names the cause of each: a sticky valve, a controller gain that
is too high, a load that swings.
"""

import matplotlib.pyplot as plt

import stiction as st
from stiction.simulation.demo import demo_plant

loops = {loop.record.tag: loop for loop in demo_plant()}
shown = {"FIC-101": "valve sticks", "TIC-105": "gain too high", "FIC-106": "supply pressure swings"}
causes = ("valve", "tuning", "external", "sensor", "dead_zone")

figure, axes = plt.subplots(len(shown), 2, figsize=(10, 7), width_ratios=(2, 1))
for (left, right), (tag, truth) in zip(axes, shown.items(), strict=True):
    record = loops[tag].record
    found = st.diagnose(record)
    left.plot(record.time / 60, record.pv, color="#1a7f37")
    left.set(xlim=(0, 60 if record.dt > 1 else 20), xlabel="time [min]", ylabel="PV")
    left.set_title(f"{tag}, {truth}: {found.verdict}, probability {found.probability:.2f}", fontsize=10, loc="left")
    right.barh(causes, [getattr(found.oscillation_cause, cause) for cause in causes])
    right.set(xlim=(0, 1), xlabel="score of the cause")
plt.show()
