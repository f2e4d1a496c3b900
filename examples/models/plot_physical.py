"""
A physical valve: force balance of the stem
===========================================

Mass, spring, actuator area and friction (Karnopp or LuGre) of the stem. Quantities carry units and
are converted. Static and dynamic friction give the bands of the simple models.
"""

import matplotlib.pyplot as plt
import numpy as np

import stiction as st
from stiction.models.parameter_sets import table1_reading_a

valve = table1_reading_a(hold="linear")
print(st.reduce_valve(valve))

pressure = 4.0 * np.arange(0.0, 4.5, 0.01)  # a ramp of 4 psi/s up to 18 psi
stem = st.stroke(valve, pressure / 18.0 * 100.0, 0.01).mv / 100.0 * 6.0
figure, ax = plt.subplots()
ax.plot(pressure, pressure / 3.0, color="0.6", linestyle="--", label="balance of air and spring")
ax.plot(pressure, stem, label="stem")
ax.set(xlabel="pressure [psi]", ylabel="stem position [in]", title="Karnopp friction: stick and slip on a ramp")
ax.legend()
plt.show()
