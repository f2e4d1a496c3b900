"""
Figure 2: the stem on pressure ramps
====================================

Table I of the paper gives no units for mass, damping and slope. Two readings of the units reproduce
the figure; both are shown.
"""

import matplotlib.pyplot as plt

from stiction.paper import figure2

panels = figure2().panels
figure, axes = plt.subplots(2, 3, figsize=(10, 5.6), sharex=True, sharey=True)
for ax, panel in zip(axes.flat, panels, strict=False):
    ax.plot(panel.pressure, panel.pressure / 3.0, color="0.7", linestyle="--")
    ax.plot(panel.pressure, panel.position)
    ax.set_title(f"{panel.name}, reading {panel.reading}: {panel.slope:g} {panel.slope_unit}", fontsize=9)
for ax in axes[-1]:
    ax.set_xlabel("pressure [psi]")
for ax in axes[:, 0]:
    ax.set_ylabel("stem [in]")
plt.show()
