"""Symbolic LPV models, LMI engine, observer design, certificates and export.

Everything that users call can be imported from here: `from synthesis import LpvModel, ObserverDesign, design_observer, deploy`.
The stub beside this file lists the names; each is imported when it is used.
"""

from estimators.lazy import door

__getattr__, __dir__, __all__ = door(__name__, __file__)
