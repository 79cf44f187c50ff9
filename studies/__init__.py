"""What the packages below are used for: schedules, drives, studies of the papers, sweeps, the command line.

Everything that users call can be imported from here: `from studies import run_drive, run_studies, run_sweep, certify`.
The stub beside this file lists the names; each is imported when it is used.
"""

from estimators.lazy import door

__getattr__, __dir__, __all__ = door(__name__, __file__)
