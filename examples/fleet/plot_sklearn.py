"""
With scikit-learn: the features of the verdict
==============================================

``StictionFeatures`` turns records into a table of features, one row per loop. Here a pipeline
learns from labelled loops which valves stick; the labels are those of the simulation.
"""

import matplotlib.pyplot as plt
import numpy as np
from sklearn.impute import SimpleImputer
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

import stiction as st

rng = np.random.default_rng(1)
records, sticks = [], []
for k in range(20):
    sticky = k % 2 == 0
    S = rng.uniform(1.5, 6.0)
    valve = st.Kano(S=S, J=rng.uniform(0.2, 0.8) * S) if sticky else st.Ideal()
    loop = st.Loop(st.PID(rng.uniform(0.1, 0.3), 10.0), valve, st.FOPDT(3.0, 10.0, 5.0), dt=1.0, noise=0.3)
    load = 1.5 * np.sin(2 * np.pi * np.arange(900.0) / rng.uniform(60.0, 200.0))
    run = st.simulate(loop, sp=10.0, duration=900.0, disturbance=load, seed=k, pv_start=9.0, op_start=3.0)
    records.append(st.LoopRecord(f"FIC-{k}", 1.0, op=run.op, pv=run.pv, sp=run.sp, loop_type="flow"))
    sticks.append(sticky)

transformer = st.StictionFeatures()
features = transformer.fit_transform(records)
model = make_pipeline(SimpleImputer(keep_empty_features=True), StandardScaler(), LogisticRegression(C=0.1))
model.fit(features[:12], sticks[:12])
print("right on the other loops:", model.score(features[12:], sticks[12:]))

names = transformer.get_feature_names_out()
order = np.argsort(np.abs(model[-1].coef_[0]))
figure, ax = plt.subplots()
ax.barh(names[order], model[-1].coef_[0][order])
ax.set(xlabel="weight in the logistic regression", title="Which features tell a sticky valve")
plt.show()
