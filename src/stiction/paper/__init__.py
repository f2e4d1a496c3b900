"""The paper's tables and figures, each as one function that returns its data, as printed and corrected."""

from stiction.paper.fig3 import figure3
from stiction.paper.fig4 import figure4
from stiction.paper.fig5 import figure5

__all__ = ["figure3", "figure4", "figure5"]
