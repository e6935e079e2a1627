"""What happens to a device, in the log: one line for each change, and none for every flicker."""

import logging
from collections import deque

from bearcub.clock import Clock

_log = logging.getLogger(__name__)

_OFTEN = 3  # faults, the last of which is the last to be logged
_CALM = 10.0  # within which they are, and for which it has to hold or to be gone after that [s]


class Journal:
    """Logs the faults of one device and their ends; a loose cable does not fill the log.

    The third fault within ten seconds is the last one that is logged, until there was none for ten
    seconds.

    Parameters
    ----------
    name : str
        Of the device; every line begins with it.
    clock : Clock
    """

    def __init__(self, name: str, *, clock: Clock) -> None:
        self._name = name
        self._clock = clock
        self._faults_ns: deque[int] = deque(maxlen=_OFTEN)
        self._hidden: int | None = None  # faults that were not logged; None while all are

    def note(self, state: str) -> None:
        """Log a change that is no fault."""
        if self._hidden is None:
            _log.info("%s: %s", self._name, state)

    def fault(self, sentence: str) -> None:
        """Log the beginning of a fault."""
        now_ns = self._clock.now_ns()
        self._faults_ns.append(now_ns)
        if self._hidden is not None:
            self._hidden += 1
            return
        often = len(self._faults_ns) == _OFTEN
        if often and now_ns - self._faults_ns[0] < _CALM * 1e9:
            self._hidden = 0
            sentence += f" (comes and goes; logged again after {_CALM:g} s without a change)"
        _log.warning("%s", sentence)

    def still(self, sentence: str) -> None:
        """Log that a fault lasts, if its beginning was not logged and that is a while ago."""
        if self._is_calm():
            _log.warning("%s", sentence)
            self._hidden = None

    def well(self) -> None:
        """Log that all is well again, if faults were not logged and the last is a while ago."""
        if self._is_calm():
            _log.info("%s: streaming, after %d more faults", self._name, self._hidden)
            self._hidden = None

    def _is_calm(self) -> bool:
        last_ns = self._faults_ns[-1] if self._faults_ns else 0
        return self._hidden is not None and self._clock.now_ns() - last_ns >= _CALM * 1e9
