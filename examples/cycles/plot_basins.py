"""
Basins: which start leads to which limit cycle
==============================================

The example loop of the paper has several limit cycles. The colour of each start says where it ends.
"""

import matplotlib.pyplot as plt
import numpy as np

import stiction as st
from stiction.paper.fig7 import EXAMPLE_LOOP

op = np.linspace(-2.0, 2.0, 61)
pv = np.linspace(-2.0, 2.0, 61)
basins = st.basin_map(EXAMPLE_LOOP, op_start=op[:, None], pv_start=pv[None, :])

labels = [attractor.label for attractor in basins.attractors]
shown = np.searchsorted(labels, basins.label)
figure, ax = plt.subplots(figsize=(7, 5))
colors = plt.get_cmap("viridis", len(labels))
image = ax.pcolormesh(pv, op, shown, cmap=colors, vmin=-0.5, vmax=len(labels) - 0.5)
bar = figure.colorbar(image, ticks=range(len(labels)))
bar.ax.set_yticklabels([f"{one.name}, {one.amplitude[0]:.2f} %" for one in basins.attractors], fontsize=7)
ax.set(xlabel="PV at the start", ylabel="OP at the start [%]", title="Limit cycle reached and its OP amplitude")
ax.grid(visible=False)
plt.show()
