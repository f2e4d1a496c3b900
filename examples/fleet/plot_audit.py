"""
Audit a plant
=============

One unit of the simulated demo plant: all loops are screened, diagnosed, ranked and grouped. The
bars show the priority of the worst loops.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import stiction as st
from stiction.apps.demo_plant import write_plant_files
from stiction.simulation.plant import simulate_plant

if __name__ == "__main__":  # worker processes import this file
    with tempfile.TemporaryDirectory() as folder:
        source, tags, connections = write_plant_files(simulate_plant(seed=0), Path(folder))
        audit = st.audit(source, Path(folder) / "audit", map=tags, connections=connections, loops="UNIT1/*", workers=2)
        worst = audit.worst(10)[::-1]
        print(audit.counts)
        table = audit.to_frame("pandas")

    colors = {"stiction": "#bc4c00", "no_stiction": "#0969da", "undecided": "#8c959f"}
    figure, ax = plt.subplots()
    for row in worst:
        ax.barh(row["tag"], row["priority"], color=colors.get(row["verdict"], "0.8"))
        ax.text(row["priority"] + 0.01, row["tag"], row["oscillation_cause"] or "", va="center", fontsize=8)
    ax.set(xlim=(0, 1.15), xlabel="priority", title="Worst loops of unit 1; orange: verdict stiction")
    plt.show()

    print(table[["tag", "verdict", "probability", "S", "group"]].head(5).to_string())
