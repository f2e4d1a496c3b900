"""The features of the verdict as a scikit-learn transformer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.diagnosis import diagnose
from stiction.diagnosis.verdict.features import FEATURES
from stiction.errors import MissingExtraError
from stiction.records.record import require_record

try:
    from sklearn.base import BaseEstimator, TransformerMixin
except ImportError:  # pragma: no cover
    raise MissingExtraError('scikit-learn is not installed; install it with: pip install "stiction[sklearn]"') from None

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from stiction.records.record import LoopRecord

__all__ = ["StictionFeatures"]


class StictionFeatures(TransformerMixin, BaseEstimator):
    """Transformer from loop records to the features of the verdict: one row a record.

    It learns nothing: `fit` only checks its input. It needs scikit-learn: ``pip install "stiction[sklearn]"``.

    Notes
    -----
    The features, their formulas and units are those of `stiction.diagnosis.verdict.features.FEATURES`. Most are
    asinh(LLR / 20) of a likelihood ratio [-]. NaN stands where a feature cannot be computed; a record that cannot be
    judged (in manual, saturated, too short, ...) is a row of NaN.

    Examples
    --------
    >>> import stiction as st
    >>> loop = st.Loop(st.PID(0.2, 10.0), st.Kano(5.0, 2.0), st.FOPDT(3.0, 10.0, 10.0), dt=1.0)
    >>> record = st.simulate(loop, sp=10.0, duration=2000.0, loop_type="flow")
    >>> features = st.StictionFeatures().fit_transform([record])
    >>> features.shape == (1, len(st.StictionFeatures().get_feature_names_out()))
    True
    """

    def fit(self, X: Iterable[LoopRecord], y: object = None) -> StictionFeatures:  # noqa: ARG002
        """Check that `X` holds records.

        Parameters
        ----------
        X : iterable of LoopRecord
            Records of one loop each, OP and PV at least.
        y : object, optional
            Not used.

        Returns
        -------
        StictionFeatures
            Itself.

        Raises
        ------
        RecordError
            When something in `X` is no record.
        """
        for record in X:
            require_record(record)
        return self

    def transform(self, X: Iterable[LoopRecord]) -> NDArray[np.float64]:
        """Compute the features of each record.

        Parameters
        ----------
        X : iterable of LoopRecord
            Records of one loop each, OP and PV at least.

        Returns
        -------
        ndarray, shape (n_records, n_features)
            The features, in the order of `get_feature_names_out` [-].

        Raises
        ------
        RecordError
            When something in `X` is no record, or has no PV.
        """
        names = self.get_feature_names_out()
        rows = [diagnose(record).features for record in X]
        return np.array([[row.get(name, np.nan) for name in names] for row in rows], dtype=np.float64).reshape(
            len(rows), len(names)
        )

    def get_feature_names_out(self, input_features: object = None) -> NDArray[np.object_]:  # noqa: ARG002
        """Names of the features, shape (n_features,)."""
        return np.array([feature.name for feature in FEATURES], dtype=object)

    def __sklearn_is_fitted__(self) -> bool:
        """There is nothing to fit."""
        return True

    def __sklearn_tags__(self) -> Any:
        """Tags for scikit-learn: no fit needed, input is no matrix."""
        tags = super().__sklearn_tags__()
        tags.requires_fit = False
        tags.no_validation = True
        return tags
