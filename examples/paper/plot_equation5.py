"""
Equation 5: as printed, the stem stops for ever
===============================================

After a step of OP the printed equation moves the stem once and never again. The corrected equation
ends where all other models end.
"""

import matplotlib.pyplot as plt
import numpy as np

import stiction as st

op = np.repeat([0.0, 10.0, 4.0], [3, 8, 8])
figure, ax = plt.subplots()
ax.step(range(len(op)), op, where="post", color="0.7", label="OP")
for printed in (True, False):
    valve = st.Srinivasan(sb=2.0, sj=1.0, r=0.0, as_printed=printed)
    ax.step(range(len(op)), st.stroke(valve, op, dt=1.0).mv, where="post", label="printed" if printed else "corrected")
ax.step(
    range(len(op)), st.stroke(st.Kano(S=3.0, J=1.0), op, dt=1.0).mv, ":", where="post", label="Kano, for comparison"
)
ax.set(xlabel="sample", ylabel="[% of span]", title="a step up and a step down")
ax.legend()
plt.show()
