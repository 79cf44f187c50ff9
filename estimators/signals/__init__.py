"""Raw signals made fit for estimators: held, dated, differentiated, counted."""

from estimators.signals.derivative import DerivativeStep, FilteredDerivative
from estimators.signals.freshness import Freshness, FreshStep
from estimators.signals.held import Held
from estimators.signals.mounting import Mounting
from estimators.signals.ticks import TickSpeed, TickStep

__all__ = [
    "DerivativeStep",
    "FilteredDerivative",
    "FreshStep",
    "Freshness",
    "Held",
    "Mounting",
    "TickSpeed",
    "TickStep",
]
