"""
pandas and polars frames, in and out
====================================

A record can be made from a data frame and turned back into one.
"""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import stiction as st

time = np.arange(0.0, 1800.0, 2.0)
frame = pd.DataFrame({"t": time, "flow": 20 + 2 * np.sign(np.sin(time / 60)), "valve": 45 + 3 * np.sin(time / 60)})
record = st.LoopRecord.from_frame(frame, tag="FIC-7", time="t", pv="flow", op="valve", loop_type="flow")
print(record.to_frame("polars").head())

record.plot()
plt.show()

# %%
# In a notebook a record shows itself.

record
