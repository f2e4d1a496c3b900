"""
Stenman: the one-parameter model
================================

The stem does not move until OP is more than d away. It then jumps to OP and stops at once. On a
slow ramp it climbs in stairs.
"""

import matplotlib.pyplot as plt
import numpy as np

import stiction as st

op = np.concatenate([np.linspace(40.0, 50.0, 201), np.linspace(50.0, 40.0, 201)])
figure, ax = plt.subplots()
ax.plot(op, color="0.5", label="OP")
for d in (1.0, 3.0):
    ax.plot(st.stroke(st.Stenman(d=d), op, dt=1.0).mv, label=f"valve position, d = {d:g} %")
ax.set(xlabel="time [s]", ylabel="[% of span]", title="Stenman's valve on a ramp")
ax.legend()
plt.show()
