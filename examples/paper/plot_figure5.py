"""
Figure 5: stiction that varies over the travel
==============================================

A ramp test of a simulated flow loop whose stick band and jump change with the valve position, and
what the test reads from the noisy flow.
"""

import matplotlib.pyplot as plt

from stiction.paper import figure5

data = figure5()
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4))
left.plot(data.time / 60, data.pv["corrected"], label="corrected model")
left.plot(data.time / 60, data.pv["printed"], ":", label="as printed")
left.set(xlabel="time [min]", ylabel="flow", title="ramp of a flow loop")
left.legend()
middle = [0.5 * (part.low + part.high) for part in data.test.travel]
for name, marker in (("sb", "o"), ("sj", "s")):
    (line,) = right.plot(data.travel, getattr(data, name), label=f"{name}, true")
    right.plot(
        middle,
        [getattr(part, name) for part in data.test.travel],
        marker,
        color=line.get_color(),
        label=f"{name}, found",
    )
right.set(xlabel="valve position [%]", ylabel="[% of span]", title="stick band and jump over the travel")
right.legend()
plt.show()
