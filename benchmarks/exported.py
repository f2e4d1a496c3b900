"""An exported FMU, driven sample by sample from a C `main`, beside the valve in C."""

from __future__ import annotations

import subprocess
import tempfile
import zipfile
from pathlib import Path

from bench import Row, Section

import stiction as st

STEPS = 1_000_000
TIMES_SLOWER = 3.0
"""How many times longer than the C twin the FMU may take [-]."""
MAIN = """
#include "fmu.c"
#include <time.h>
void stroke_kano(size_t, const double *, double, double, double, double, double *);
static void quiet(void *c, fmi2String n, fmi2Status s, fmi2String k, fmi2String m, ...) {}
static double op[STEPS], ours[STEPS], theirs[STEPS];
static double seconds(clock_t from) { return (double)(clock() - from) / CLOCKS_PER_SEC; }
int main(void) {
    unsigned long long random = 1;
    double level = 50.0, best = 1e9, best_twin = 1e9;
    const unsigned at_op = FIRST_INPUT, at_position = FIRST_OUTPUT;
    fmi2CallbackFunctions call = {quiet, calloc, free, NULL, NULL};
    for (int k = 0; k < STEPS; k++) {
        random = random * 6364136223846793005ULL + 1442695040888963407ULL;
        op[k] = level += ((double)(random >> 40) / 16777216.0 - 0.5);
    }
    for (int repeat = 0; repeat < 15; repeat++) {
        fmi2Component c = fmi2Instantiate("valve", fmi2CoSimulation, TOKEN, "", &call, 0, 0);
        fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0);
        fmi2EnterInitializationMode(c);
        fmi2SetReal(c, &at_op, 1, op);
        fmi2ExitInitializationMode(c);
        clock_t from = clock();
        for (int k = 0; k < STEPS; k++) {
            fmi2SetReal(c, &at_op, 1, op + k);
            fmi2DoStep(c, (double)k, 1.0, 1);
            fmi2GetReal(c, &at_position, 1, ours + k);
        }
        double t = seconds(from);
        best = t < best ? t : best;
        fmi2FreeInstance(c);
        from = clock();
        stroke_kano(STEPS, op, 3.0, 1.0, -INFINITY, INFINITY, theirs);
        t = seconds(from);
        best_twin = t < best_twin ? t : best_twin;
    }
    for (int k = 0; k < STEPS; k++) if (ours[k] != theirs[k]) return 1;
    printf("%.9f %.9f\\n", best, best_twin);
    return 0;
}
"""


def exported() -> Section:
    """Set the OP, step, read the position: a million times, with one compiler and the same flags on both sides."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        st.export_fmu(st.Kano(3.0, 1.0), folder / "kano.fmu", dt=1.0)
        zipfile.ZipFile(folder / "kano.fmu").extractall(folder)
        sources, twin = folder / "sources", Path(__file__).with_name("twin.c")
        (sources / "main.c").write_text(MAIN.replace("STEPS", str(STEPS)))
        command = ["cc", "-O3", "-ffp-contract=off", "-o", "main", "main.c", str(twin), "-lm"]
        subprocess.run(command, cwd=sources, check=True)
        done = subprocess.run([str(sources / "main")], check=True, capture_output=True, text=True)
    ours, theirs = (STEPS / float(seconds) for seconds in done.stdout.split())
    rows = [Row("Kano's valve as FMU 2.0", ours, "steps/s", "C twin", theirs, ours / theirs, 1.0 / TIMES_SLOWER)]
    return Section("Exported models", rows, ("FMU and C twin give the same bits",))
