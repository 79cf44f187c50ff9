"""Norms, sensitivity, switching, Markov jumps, lost measurements, observability: a toolbox that works on any model.

Everything that users call can be imported from here: `from analysis import hinf_norm, critical_drop_probability`.
The stub beside this file lists the names; each is imported when it is used.
"""

from estimators.lazy import door

__getattr__, __dir__, __all__ = door(__name__, __file__)
