"""The paper's tables and figures, each as one function that returns its data, as printed and corrected."""

from stiction.paper.eq5 import equation5
from stiction.paper.eqs1to3 import equations1to3
from stiction.paper.eqs6to7 import equations6and7
from stiction.paper.errata import errata
from stiction.paper.fig2 import figure2
from stiction.paper.fig3 import figure3
from stiction.paper.fig4 import figure4
from stiction.paper.fig5 import figure5
from stiction.paper.fig6 import figure6
from stiction.paper.fig7 import figure7
from stiction.paper.fig8 import figure8
from stiction.paper.section5 import section5
from stiction.paper.table1 import table1

__all__ = [
    "equation5",
    "equations1to3",
    "equations6and7",
    "errata",
    "figure2",
    "figure3",
    "figure4",
    "figure5",
    "figure6",
    "figure7",
    "figure8",
    "section5",
    "table1",
]
