"""
What makes S and J certain
==========================

One valve, three sources: PV alone, the recorded valve position, and a ramp test. PV alone leaves J
uncertain; a ramp test measures both.
"""

import matplotlib.pyplot as plt

import stiction as st

valve = st.Kano(S=5.0, J=2.0)
loop = st.Loop(st.PID(0.2, 10.0), valve, st.FOPDT(3.0, 10.0, 10.0), dt=1.0, noise=0.2)
record = st.simulate(loop, sp=10.0, duration=3600.0, seed=4, loop_type="flow")
without_position = st.LoopRecord("FIC-101", 1.0, op=record.op, pv=record.pv, sp=record.sp)

figure, axes = plt.subplots(1, 3, figsize=(10, 3), sharex=True, sharey=True)
st.identify(without_position).plot(axes[0])
st.identify(record).plot(axes[1])
test = st.analyse_ramp(st.stroke(valve, st.plan_ramp_test(low=40.0, high=60.0, threshold=0.05).op, dt=1.0))
for row, size in enumerate((test.sj, test.S)):
    axes[2].errorbar(size.value, row, xerr=[[size.value - size.low], [size.high - size.value]], fmt="o", capsize=5)
for ax, source in zip(axes, ("PV alone", "valve position", "ramp test"), strict=True):
    ax.axvline(2.0, color="0.6", linestyle=":")
    ax.axvline(5.0, color="0.6", linestyle=":")
    ax.set(title=source, xlabel="[% of span], true values dotted")
plt.show()
