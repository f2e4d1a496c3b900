"""
With python-control
===================

A process of python-control can be used in a loop as it is. Describing functions of valves plug into
its ``describing_function_plot``-style analysis.
"""

import control
import matplotlib.pyplot as plt
import numpy as np

import stiction as st

s = control.tf("s")
process = 3.0 / ((10.0 * s + 1.0) * (8.0 * s + 1.0))
loop = st.Loop(st.PID(Kc=1.2, Ti=10.0), st.Kano(S=5.0, J=2.0), process, dt=1.0)
record = st.simulate(loop, sp=10.0, duration=900.0, op_start=3.0)

omega = np.logspace(-2.5, 0, 300)
response = control.frequency_response(process * 1.2 * (1 + 1 / (10.0 * s)), omega).complex
amplitude = np.linspace(2.6, 30.0, 200)
inverse = -1.0 / st.describing_function(st.Kano(S=5.0, J=2.0), amplitude)
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4))
left.plot(np.squeeze(response).real, np.squeeze(response).imag, label="loop")
left.plot(inverse.real, inverse.imag, label="-1/N of the valve")
left.set(xlim=(-3, 0.2), ylim=(-3, 0.1), xlabel="real part", ylabel="imaginary part", title="Nyquist plot")
left.legend()
right.plot(record.time, record.op, label="OP")
right.plot(record.time, record.mv, label="valve position")
right.set(xlabel="time [s]", ylabel="[% of span]", title="simulated")
right.legend()
plt.show()
