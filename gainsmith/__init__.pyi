from analysis import *
from estimators import *
from studies import *
from synthesis import *

__version__: str
PACKAGES: tuple[str, ...]

def hidden_by() -> tuple[str, str] | None: ...
