"""Classes that give results a notebook card and a plot; a result inherits from one of them."""

from __future__ import annotations

from typing import Any

from stiction.errors import import_extra

__all__ = ["GroupDisplay", "IdentificationDisplay", "TrialDisplay", "VerdictDisplay"]


class VerdictDisplay:
    """Card and plot of a Diagnosis."""

    __slots__ = ()

    def plot(self, ax: Any = None) -> Any:
        """Draw what each feature adds to the log odds of stiction.

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
        from stiction.display.plots import plot_verdict

        return plot_verdict(self, ax)

    def _repr_html_(self) -> str:
        from stiction.display.notebook import verdict_html

        return verdict_html(self)


class IdentificationDisplay:
    """Card and plot of an Identification."""

    __slots__ = ()

    def plot(self, ax: Any = None) -> Any:
        """Draw S and J with their 95 % intervals.

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
        from stiction.display.plots import plot_identification

        return plot_identification(self, ax)

    def _repr_html_(self) -> str:
        from stiction.display.notebook import identification_html

        return identification_html(self)


class GroupDisplay:
    """Card and plot of a Group."""

    __slots__ = ()

    def plot(self, ax: Any = None) -> Any:
        """Draw the probability of each member to be the source.

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
        from stiction.display.plots import plot_group

        return plot_group(self, ax)

    def _repr_html_(self) -> str:
        from stiction.display.notebook import group_html

        return group_html(self)


class TrialDisplay:
    """Card and plot of a CompensationTrial."""

    __slots__ = ()

    def plot(self, ax: Any = None) -> Any:
        """Draw PV deviation over stem travel of each remedy.

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
        from stiction.display.plots import plot_trial

        return plot_trial(self, ax)

    def _repr_html_(self) -> str:
        from stiction.display.notebook import trial_html

        return trial_html(self)
