"""
A knocker, switched on
======================

Pulses in the direction of the controller's moves free the stem. PV becomes calmer, the stem moves
more.
"""

import matplotlib.pyplot as plt

import stiction as st

process, controller, valve = st.FOPDT(3.0, 10.0, 10.0), st.PID(0.2, 10.0), st.Kano(S=5.0, J=2.0)
knocker = st.Knocker(amplitude=2.5, width=2.0, interval=5.0)
plain = st.simulate(st.Loop(controller, valve, process, dt=1.0, noise=0.05), 10.0, 1200.0, seed=1)
helped = st.simulate(st.Loop(controller, valve, process, dt=1.0, noise=0.05, compensator=knocker), 10.0, 1200.0, seed=1)
figure, axes = plt.subplots(2, 2, figsize=(10, 5.5), sharex=True, sharey="row")
for column, record, name in ((axes[:, 0], plain, "no compensator"), (axes[:, 1], helped, "knocker")):
    record.plot(column)
    column[0].set_title(f"{name}: PV std {record.pv[400:].std():.2f}")
plt.show()
