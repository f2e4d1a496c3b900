"""
How sure are S and J?
=====================

The same valve in records of different length: the 95 % intervals of S and J become narrower. J is
less certain than S.
"""

import matplotlib.pyplot as plt

import stiction as st

loop = st.Loop(st.PID(0.2, 10.0), st.Kano(S=5.0, J=2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.5)
record = st.simulate(loop, sp=[10.0] * 900 + [14.0] * 2700, duration=3600.0, seed=4, loop_type="flow")
lengths = (600, 1200, 2400, 3600)
figure, axes = plt.subplots(1, len(lengths), figsize=(11, 3), sharex=True, sharey=True)
for ax, length in zip(axes, lengths, strict=True):
    part = st.LoopRecord("FIC-101", 1.0, op=record.op[:length], pv=record.pv[:length], sp=record.sp[:length])
    st.identify(part).plot(ax)
    ax.axvline(5.0, color="0.6", linestyle=":")
    ax.axvline(2.0, color="0.6", linestyle=":")
    ax.set_title(f"{length} samples")
plt.show()
