"""
Figures 3 and 4: ramps of the laboratory valve
==============================================

On the faster ramps the valve follows after the first jump, on the slower ones it climbs in stairs.
The equation as printed in the paper does neither; the corrected one does both.
"""

import matplotlib.pyplot as plt

from stiction.paper import figure3, figure4

ramps = [*figure3(), *figure4()]
figure, axes = plt.subplots(2, 2, figsize=(10, 6.4))
for ax, ramp in zip(axes.flat, ramps, strict=True):
    ax.plot(ramp.time / 60, ramp.op, color="0.7", label="OP")
    for name, position in ramp.position.items():
        ax.plot(ramp.time / 60, position, label=name, linestyle=":" if "printed" in name else "-")
    ax.set(title=f"{ramp.rate:g} %/s: {ramp.paper} in the paper", xlabel="time [min]", ylabel="[% of span]")
axes.flat[0].legend(fontsize=7)
plt.show()
