"""
Figure 8: a pulse moves the loop to another limit cycle
=======================================================

One loop, two stable limit cycles. A short load pulse at 200 s moves the loop from one to the other,
and it stays there.
"""

import matplotlib.pyplot as plt

from stiction.paper import figure8

data = figure8()
figure, axes = plt.subplots(2, 1, sharex=True)
data.record.plot(axes)
size, begin, length = data.pulse
for ax in axes:
    ax.axvspan(begin, begin + length, color="0.6", alpha=0.6)
axes[0].set_title(f"a load of {size:g} % for {length:g} s at {begin:g} s")
plt.show()
