"""
How the limit cycle depends on the controller gain
==================================================

Every limit cycle is followed over the loop gain. A higher gain makes the cycle faster; near the
stability limit its amplitude grows.
"""

import matplotlib.pyplot as plt
import numpy as np

import stiction as st

loop = st.Loop(st.PID(Kc=0.2, Ti=10.0), st.Kano(S=5.0, J=2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4))
points = []
for factor in np.linspace(0.4, 1.6, 13):
    changed = st.Loop(st.PID(Kc=0.2 * factor, Ti=10.0), loop.valve, loop.process, dt=1.0)
    points += [
        (factor, c.exact.period, c.exact.amplitude) for c in st.predict_limit_cycles(changed) if c.stable and c.exact
    ]
factor, period, amplitude = np.array(points).T
left.plot(factor, period, "o-")
right.plot(factor, amplitude, "o-")
left.set(xlabel="gain relative to Kc = 0.2", ylabel="period [s]")
right.set(xlabel="gain relative to Kc = 0.2", ylabel="OP amplitude [%]")
plt.show()
