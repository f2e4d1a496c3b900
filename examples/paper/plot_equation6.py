"""
Equation 6: the describing function, measured on the valve
==========================================================

The real part of N(A) for Stenman's valve: as printed, with its roots corrected, and fully
corrected. The circles are measured by driving the valve with sines.
"""

import matplotlib.pyplot as plt
import numpy as np

from stiction.paper import equations6and7

data = equations6and7()
figure, axes = plt.subplots(1, 2, figsize=(10, 4))
for ax, take, name in ((axes[0], np.real, "real"), (axes[1], np.imag, "imaginary")):
    for form, n in data.n.items():
        ax.plot(data.ratio, take(n), label=form)
    for family, marker in (("half", "o"), ("integer", "D")):
        ax.plot(
            data.checked,
            take(data.numeric[family]),
            marker,
            color="black",
            fillstyle="none",
            label=f"measured, {family}",
        )
    ax.set(xlabel="A / d", ylabel=f"{name} part of N")
axes[1].legend(fontsize=7)
plt.show()
