from .controller import LpvController as LpvController
from .controller import LpvControllerStep as LpvControllerStep
from .observer import LpvObserver as LpvObserver
from .observer import LpvObserverStep as LpvObserverStep
