"""
A ramp test, planned and read
=============================

The plan ramps OP at several rates. The analysis reads stick band, slip jump and rate limit from the
record, with intervals.
"""

import matplotlib.pyplot as plt

import stiction as st

plan = st.plan_ramp_test(low=40.0, high=60.0, threshold=0.05)
record = st.stroke(st.Srinivasan(sb=3.0, sj=1.5, r=0.05), plan.op, plan.dt)
test = st.analyse_ramp(record)
print(test.summary())

figure, ax = plt.subplots()
ax.plot(record.time / 60, record.op, color="0.6", label="OP")
ax.plot(record.time / 60, record.mv, label="valve position")
ax.set(
    xlabel="time [min]",
    ylabel="[% of span]",
    title=f"sb = {test.sb.value:.2f} %, sj = {test.sj.value:.2f} % (true: 3 and 1.5)",
)
ax.legend()
plt.show()
