"""
Loops that oscillate together
=============================

A simulated plant of about sixty loops. Oscillations spread from a few sources; the groups are
found, and the members are ranked by the evidence that they are the source.
"""

import matplotlib.pyplot as plt

from stiction.fleet import group_oscillations
from stiction.simulation.plant import simulate_plant

plant = simulate_plant(seed=3)
groups = group_oscillations(plant.records)
records = {record.tag: record for record in plant.records}

group = groups[0]
figure, axes = plt.subplots(min(len(group.members), 6), 1, figsize=(8, 7), sharex=True)
for ax, member in zip(axes, group.members, strict=False):
    record = records[member.tag]
    shown = slice(0, int(8 * group.period / record.dt))
    ax.plot(record.time[shown] / 60, record.op[shown])
    ax.set_ylabel(member.tag, rotation=0, ha="right", fontsize=8)
axes[0].set_title(f"OP of loops with a common period of {group.period:.0f} s, likeliest source first")
axes[-1].set_xlabel("time [min]")
plt.show()

# %%

group.plot()
plt.show()

# %%

group
