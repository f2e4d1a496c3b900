"""What a comparison of valve models says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from stiction.diagnosis.identified import plain

__all__ = ["ModelComparison", "ModelShare"]


@dataclass(frozen=True, slots=True)
class ModelShare:
    """What one valve model explains of a record."""

    model: str
    """good, stenman, kano or three_parameter."""
    free: int
    """Parameters of the valve that were fitted [-]."""
    parameters: dict[str, float]
    """Their values: d, S, J, sb, sj [% of span], r [% of span / s]."""
    fit: float
    """Share of the variation compared that it explains [%]."""
    bic: float
    """Schwarz's criterion [-]; the smallest wins."""

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {
            "model": self.model,
            "free": self.free,
            "parameters": {name: plain(value) for name, value in self.parameters.items()},
            "fit": plain(self.fit),
            "bic": plain(self.bic),
        }


_EXTENSIONS = {
    "good": ("stenman", "kano", "three_parameter"),
    "stenman": ("three_parameter",),
    "kano": ("three_parameter",),
    "three_parameter": (),
}
"""Model -> the models of which it is a special case."""


@dataclass(frozen=True, slots=True)
class ModelComparison:
    """Which valve model speaks for a record, and by how much."""

    models: tuple[ModelShare, ...]
    """The models, the smallest criterion first."""
    samples: float
    """Independent samples that the criterion counts [-]."""
    compared: str
    """Signal that was compared: pv or mv."""
    enough: float
    """Difference of the criterion from which on a model is called better [-]."""

    @property
    def best(self) -> str:
        """The simplest model whose criterion is not larger than the smallest by `enough`."""
        near = [one for one in self.models if one.bic < self.models[0].bic + self.enough]
        return min(near, key=lambda one: (one.free, one.bic)).model

    @property
    def margin(self) -> float:
        """How much larger the criterion is of the best model that is no extension of `best` [-]."""
        own = next(one for one in self.models if one.model == self.best)
        others = [one for one in self.models if one.model not in (own.model, *_EXTENSIONS[own.model])]
        return (min(one.bic for one in others) if others else self.models[0].bic) - own.bic

    @property
    def decided(self) -> bool:
        """Whether that is enough; a good valve also needs the criterion to be its own."""
        return self.margin >= self.enough if self.best != "good" else self.models[0].model == "good"

    def summary(self) -> str:
        """The finding in a line or two."""
        shares = ", ".join(f"{one.model} {one.fit:.1f} %" for one in self.models)
        finding = f"{self.best} is enough" if self.decided else "the record does not tell which"
        return f"Explained of the {self.compared.upper()}: {shares}; by BIC {finding} (margin {self.margin:.1f})."

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready form."""
        return {
            "models": [one.to_dict() for one in self.models],
            "best": self.best,
            "margin": plain(self.margin),
            "decided": self.decided,
            "samples": plain(self.samples),
            "compared": self.compared,
        }
