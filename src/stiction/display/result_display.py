"""The base class that gives results a notebook card and a plot."""

from __future__ import annotations

from typing import Any, ClassVar

from stiction.display.json_form import Result
from stiction.errors import import_extra

__all__ = ["ResultDisplay"]


class ResultDisplay(Result):
    """Card and plot of a result. A subclass names its kind, that of `plots.plot_KIND` and `notebook.KIND_html`."""

    __slots__ = ()
    _display_kind: ClassVar[str]

    def __init_subclass__(cls, *, kind: str = "", **others: Any) -> None:
        super().__init_subclass__(**others)
        if kind:
            cls._display_kind = kind

    def plot(self, ax: Any = None) -> Any:
        """Draw the result.

        A Diagnosis shows what each feature adds to the log odds of stiction, an Identification S and J with their 95 %
        intervals, a Group the probability of each member to be the source, a CompensationTrial the PV deviation over
        the stem travel of each remedy.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; new Axes when not given.

        Returns
        -------
        matplotlib Axes
            Those that were drawn on.

        Raises
        ------
        MissingExtraError
            When matplotlib is not installed.
        """
        import_extra("matplotlib", "plot")
        from stiction.display import plots

        return getattr(plots, f"plot_{self._display_kind}")(self, ax)

    def _repr_html_(self) -> str:
        from stiction.display import notebook

        return getattr(notebook, f"{self._display_kind}_html")(self)
