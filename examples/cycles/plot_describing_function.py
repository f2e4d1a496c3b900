"""
Describing functions of sticky valves
=====================================

The gain and phase of a valve for a sine of OP. Below the stiction band the valve does not move; for
large amplitudes it becomes a good valve.
"""

import matplotlib.pyplot as plt
import numpy as np

import stiction as st

amplitude = np.linspace(1.55, 20.0, 300)
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4))
for J in (0.0, 1.0, 3.0):
    n = st.describing_function(st.Kano(S=3.0, J=J), amplitude)
    left.plot(amplitude, np.abs(n), label=f"J = {J:g} %")
    right.plot(amplitude, np.degrees(np.angle(n)), label=f"J = {J:g} %")
left.set(xlabel="OP amplitude [%]", ylabel="gain", title="Kano, S = 3 %")
right.set(xlabel="OP amplitude [%]", ylabel="phase [deg]")
left.legend()
plt.show()
