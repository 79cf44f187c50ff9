"""What runs on the target: gain schedules, estimators and their fault handling; numpy is all it needs.

Everything that users call can be imported from here: `from estimators import GainSchedule, EstimationPipeline`.
The stub beside this file lists the names; each is imported when it is used.
"""

from estimators.lazy import door

__getattr__, __dir__, __all__ = door(__name__, __file__)
