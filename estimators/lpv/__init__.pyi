from .observer import LpvObserver as LpvObserver
from .observer import LpvObserverStep as LpvObserverStep
