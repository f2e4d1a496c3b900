"""Parts of the search that can be switched off, how long each takes, and whether it changes a record's numbers."""

from __future__ import annotations

import time
from contextlib import ExitStack, contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

__all__ = ["SEARCH_PARTS", "TIMED_ONLY", "Part", "switch_off", "watch_parts"]

ROOM = "stiction.diagnosis"


class Part(NamedTuple):
    """A function that can be put out of action."""

    module: str
    """Module that calls it, below `stiction.diagnosis`."""
    function: str
    """Its name there."""
    off: Callable[..., Any]
    """What takes its place: the original function and its arguments go in, the result comes out."""
    acts: Callable[..., bool]
    """Whether the result differs from that of `off`: result and arguments go in."""
    code: tuple[str, ...]
    """Where it stands: modules, or module:function, below `stiction.diagnosis`."""


def _always(result: Any, *args: Any, **kwargs: Any) -> bool:
    """The part acts whenever it is called."""
    return True


def _is_something(result: Any, *args: Any, **kwargs: Any) -> bool:
    """The part acts where it finds something."""
    return result is not None


def _nothing(original: Any, *args: Any, **kwargs: Any) -> None:
    """Find nothing."""


def _keep_trials(original: Any, prediction: Any, tried: Any, swing: float) -> Any:
    """Go on with the valves tried so far."""
    return tried


def _no_overshoot(original: Any, *args: Any) -> Any:
    """Reversals whose slips end at the balance."""
    rows = original(*args)
    rows[:, 2] = np.minimum(rows[:, 2], 1.0)
    return rows


def _no_resting(original: Any, S: Any, ratio: Any, K: float, *args: Any, **kwargs: Any) -> Any:
    """No valves that rest after every sample."""
    return original(S, ratio, K, *args, **kwargs)[:0] if K > 0.0 else original(S, ratio, K, *args, **kwargs)


def _whole_only(original: Any, signals: Any) -> list[Any]:
    """One stretch."""
    return [signals]


def _never_late(original: Any, part: Any) -> Any:
    """A controller whose PV is in step."""
    controller = original(part)
    return None if controller is None else controller._replace(samples_late=0)


SEARCH_PARTS = {
    "lag search": Part(
        "identification.likeliest", "_lagged", _keep_trials, _always, ("identification.likeliest:_lagged",),
    ),
    "fan about the best valve": Part(
        "identification.likeliest", "_fanned", _keep_trials, _always, ("identification.likeliest:_fanned",)
    ),
    "short windows": Part(
        "identification.likeliest", "_windows", lambda original, prediction: [], _always,
        ("identification.likeliest:_windows",),
    ),
    "search from reversals": Part(
        "identification.likeliest", "from_reversals", lambda original, *args: np.empty((0, 5)), _always,
        ("identification.reversals",),
    ),
    "overshoot K": Part(
        "identification.likeliest", "from_reversals", _no_overshoot,
        lambda result, *args: bool((result[:, 2] > 1.0).any()), (),
    ),
    "stem that rests after every sample": Part(
        "identification.likeliest", "valves", _no_resting, _always, ("identification.reversals",)
    ),
    "shocks left out": Part(
        "identification.closer", "shocks_of", lambda original, *args: np.empty(0, dtype=np.int64),
        lambda result, *args: result.size > 0, ("identification.shocks", "identification.likeliest:tried_again"),
    ),
    "samples between samples": Part(
        "identification.closer", "with_samples_between", _nothing, _is_something,
        ("identification.between", "identification.law", "identification.likeliest:most_likely_between",
         "identification.likeliest:tried_recorded"),
    ),
    "own-sample test (never own)": Part(
        "identification.closer", "are_own_samples", lambda original, *args: False, lambda result, *args: bool(result),
        ("identification.own_samples",),
    ),
    "own-sample test (always own)": Part(
        "identification.closer", "are_own_samples", lambda original, *args: True, lambda result, *args: not result, (),
    ),
    "restored samples": Part(
        "verdict.findings", "restored", _nothing, _is_something, ("identification.restored", "identification.lawful"),
    ),
    "one rate": Part("verdict.findings", "slower_of", _nothing, _is_something, ()),
    "late PV": Part(
        "verdict.findings", "_controller", _never_late,
        lambda result, *args: result is not None and result.samples_late > 0, ("identification.in_step",),
    ),
    "stretches": Part(
        "identification.identify", "pieces_of", _whole_only, lambda result, *args: len(result) > 1, (),
    ),
    "second comparison": Part(
        "verdict.findings", "periods_of", lambda original, *args: original(*args)[:1],
        lambda result, *args: len(result) > 1, (),
    ),
    "outliers": Part(
        "verdict.findings", "without_outliers", lambda original, record: record,
        lambda result, record: result is not record and result != record, (),
    ),
}  # fmt: skip
"""Parts that change the search: a record in which they act is diagnosed again without them."""

TIMED_ONLY = {
    "rival: bent": ("identification.rivals", "bent_valve", ("identification.characteristic",)),
    "rival: gated": ("identification.rivals", "gated_past", ("identification.gated_past",)),
    "rival: relaxation": ("identification.rivals", "relaxation", ("identification.relaxation",)),
    "rival: wave": ("identification.rivals", "outside_wave", ("identification.outside_wave",)),
    "part of record": ("verdict.diagnose", "_diagnosed", ("verdict.in_part", "identification.glance")),
    "shape methods": ("verdict.findings", "detect_all", ("detection",)),
    "dense search": ("identification.identify", "search_piece", ("identification.piece", "identification.grid")),
    "closer search": ("identification.identify", "closely", ()),
}
"""Parts whose numbers are columns: they are dropped without a new search. Module, function, code."""


@contextmanager
def _replaced(module: str, function: str, wrap: Callable[[Any], Any]) -> Iterator[None]:
    """Put something in the place of a function for a while."""
    home = import_module(f"{ROOM}.{module}")
    original = getattr(home, function)
    setattr(home, function, wrap(original))
    try:
        yield
    finally:
        setattr(home, function, original)


@contextmanager
def switch_off(name: str) -> Iterator[None]:
    """Diagnose without one of `SEARCH_PARTS`."""
    part = SEARCH_PARTS[name]
    with _replaced(
        part.module, part.function, lambda original: lambda *args, **kwargs: part.off(original, *args, **kwargs)
    ):
        yield


@contextmanager
def watch_parts(seconds: dict[str, float], acting: set[str]) -> Iterator[None]:
    """Add up the processor time of every part in `seconds`, and note in `acting` which ones act.

    A part that calls itself counts from its second level on: the whole record is not a part of itself.
    """
    with ExitStack() as stack:
        for name, part in SEARCH_PARTS.items():
            stack.enter_context(_replaced(part.module, part.function, _watched(name, part.acts, seconds, acting)))
        for name, (module, function, _) in TIMED_ONLY.items():
            stack.enter_context(_replaced(module, function, _watched(name, None, seconds, acting)))
        yield


def _watched(
    name: str, acts: Callable[..., bool] | None, seconds: dict[str, float], acting: set[str]
) -> Callable[[Any], Any]:
    """A wrapper that takes the time of a function."""
    recursive, depth = name == "part of record", [0]

    def wrap(original: Any) -> Any:
        def watched(*args: Any, **kwargs: Any) -> Any:
            depth[0] += 1
            start = time.process_time()
            try:
                result = original(*args, **kwargs)
            finally:
                depth[0] -= 1
            if not recursive or depth[0] == 1:
                seconds[name] = seconds.get(name, 0.0) + time.process_time() - start
            if acts is not None and acts(result, *args, **kwargs):
                acting.add(name)
            return result

        return watched

    return wrap
