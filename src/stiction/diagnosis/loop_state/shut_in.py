"""Shut in: the flow stays at zero although the controller asks for more."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stiction.diagnosis.loop_state.arrays import LONG_SHARE, keep_long_runs
from stiction.records.quantiles import quantiles

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["find_shut_in"]


def find_shut_in(
    op: NDArray[np.float64],
    pv: NDArray[np.float64],
    sp: NDArray[np.float64] | None = None,
    *,
    low: float = 0.0,
    max_flow: float = 0.02,
    min_opening: float = 2.0,
    min_samples: int = 30,
    min_share: float = LONG_SHARE,
) -> NDArray[np.bool_]:
    """Mark the samples in which the flow is zero although the valve is asked to open.

    Parameters
    ----------
    op : ndarray, shape (n_samples,)
        Controller output [% of span]; NaN is missing.
    pv : ndarray, shape (n_samples,)
        Flow [its unit]; NaN is missing.
    sp : ndarray, shape (n_samples,), optional
        Set point [unit of `pv`]. It tells the usual flow where the flow is zero all the time.
    low : float
        Output limit at which the valve is closed [% of span].
    max_flow : float
        Largest flow that counts as zero, over the usual one [-]: the 90th percentile of |PV| or of |SP|.
    min_opening : float
        Smallest OP above `low` at which a flow is expected [% of span].
    min_samples : int
        Shortest stay that counts [samples].
    min_share : float
        Shortest stay that counts, as a share of the record [-]; the longer of the two holds.

    Returns
    -------
    ndarray of bool, shape (n_samples,)
        True where the flow is shut in.

    Notes
    -----
    A closed block valve, a stopped pump or an empty vessel takes the flow to zero; the transmitter then shows its zero
    error, or exactly 0 where it has a low-flow cut-off. The integral action opens the valve further and further. No
    property of the control valve can be read from these samples. A flow of zero at a closed valve is normal.

    Examples
    --------
    >>> import numpy as np
    >>> pv = np.where(np.arange(300) < 100, 150.0, 0.3)
    >>> int(find_shut_in(np.linspace(40.0, 80.0, 300), pv).sum())
    200
    """
    sizes = [quantiles(np.abs(x), 0.9)[0] for x in (pv, sp) if x is not None and np.isfinite(x).any()]
    usual = max(sizes, default=0.0)
    if not usual > 0.0 and not np.isfinite(pv).any():
        return np.zeros(pv.size, dtype=bool)
    no_flow = (np.abs(pv) <= max_flow * usual) & (op > low + min_opening)
    return keep_long_runs(no_flow, max(min_samples, int(min_share * pv.size)))
