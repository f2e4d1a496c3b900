"""
A step test
===========

A staircase of small steps, then larger ones. The test gives deadband plus stickband and the
response time.
"""

import matplotlib.pyplot as plt

import stiction as st

plan = st.plan_step_test(start=50.0, fine_range=4.0)
record = st.stroke(st.Kano(S=2.0, J=0.8), plan.op, plan.dt)
test = st.analyse_steps(record)
print(test.summary())

figure, ax = plt.subplots()
ax.plot(record.time / 60, record.op, color="0.6", label="OP")
ax.plot(record.time / 60, record.mv, label="valve position")
ax.set(xlabel="time [min]", ylabel="[% of span]", title="Step test of a valve with S = 2 %, J = 0.8 %")
ax.legend()
plt.show()
