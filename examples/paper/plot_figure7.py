"""
Figure 7: Nyquist plot with the describing function
===================================================

The loop L crosses -1/N(A) where a limit cycle is predicted. As printed, the equation of the paper
puts the third crossing at the wrong amplitude. The valve has a second family of rest levels that
the paper does not show.
"""

import matplotlib.pyplot as plt
import numpy as np

from stiction.paper import figure7

data = figure7()
figure, axes = plt.subplots(1, 2, figsize=(10, 4.6), sharex=True, sharey=True)
for ax, sources, cycles in (
    (axes[0], ("printed", "roots repaired"), data.printed),
    (axes[1], ("corrected",), data.corrected),
):
    ax.plot(data.response.real, data.response.imag, color="0.5", label="L")
    for curve in data.curves:
        if curve.source in sources:
            ax.plot(curve.value.real, curve.value.imag, label=f"-1/N, {curve.source}, {curve.family}")
    for cycle in cycles:
        if cycle.method == "describing function":
            x, y = (np.interp(cycle.omega, data.omega, part) for part in (data.response.real, data.response.imag))
            ax.plot(x, y, "o" if cycle.kind == "cycle" else "x", color="black")
    ax.set(xlim=(-2.4, 0.2), ylim=(-1.2, 0.1), xlabel="real part", title="as printed" if ax is axes[0] else "corrected")
    handles, labels = ax.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    ax.legend(unique.values(), unique.keys(), fontsize=7)
axes[0].set_ylabel("imaginary part")
plt.show()
