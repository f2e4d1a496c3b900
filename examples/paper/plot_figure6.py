"""
Figure 6: a level loop in its limit cycle
=========================================

A self-regulating level loop with Stenman's valve, d = 5.1 %. The stem jumps by d each time the
controller has overcome the friction.
"""

import matplotlib.pyplot as plt

from stiction.paper import figure6

data = figure6()
figure, axes = plt.subplots(2, 1, sharex=True)
data.record.plot(axes)
plt.show()

for cycle in data.cycles:
    print(f"period {cycle.period:.1f} s, OP amplitude {cycle.amplitude:.2f} %, stable: {cycle.stable}")
