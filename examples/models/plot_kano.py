"""
Kano: the two-parameter model
=============================

Kano's valve has a stiction band S and a slip jump J. OP goes up and down; the stem stays behind at
each reversal, then jumps and follows.
"""

import matplotlib.pyplot as plt
import numpy as np

import stiction as st

time = np.arange(0.0, 400.0)
op = 50.0 + 6.0 * np.sin(2 * np.pi * time / 200.0)
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4))
left.plot(time, op, label="OP", color="0.5")
for J in (0.0, 2.0, 4.0):
    stem = st.stroke(st.Kano(S=4.0, J=J), op, dt=1.0).mv
    left.plot(time, stem, label=f"J = {J:g} %")
    right.plot(op[200:], stem[200:], label=f"J = {J:g} %")
left.set(xlabel="time [s]", ylabel="valve position [%]", title="S = 4 %")
right.set(xlabel="OP [%]", ylabel="valve position [%]", title="Signature")
left.legend(loc="lower left")
plt.show()
