"""Runs a downloaded program of an emulated Galil controller: the few statements a watchdog needs.

Statements: labels, assignments, ``WT``, ``IF (...)`` with ``ENDIF``, ``JP #LABEL``, ``EN``, and
every command of the controller itself.
"""

import re
from collections.abc import Callable

_PER_TURN = 200  # statements without a wait before time has to pass
_TURN_NS = 1_000_000
_CONDITION = re.compile(r"IF\s*\((.+?)(<=|>=|<>|=|<|>)(.+)\)")
_COMPARE: dict[str, Callable[[float, float], bool]] = {
    "=": lambda a, b: a == b,
    "<>": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
    "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b,
}


class Program:
    """One program in memory.

    Parameters
    ----------
    lines : list of str
    evaluate : callable
        Returns the value of an expression; what it raises, `run` raises.
    command : callable
        Executes one command of the controller; False where it was rejected.

    Attributes
    ----------
    running : bool
    wake_ns : int
        When the next statement is due.
    """

    def __init__(
        self,
        lines: list[str],
        *,
        evaluate: Callable[[str], float],
        command: Callable[[str], bool],
    ) -> None:
        self.lines = lines
        self.running = False
        self.wake_ns = 0
        self._at = 0
        self._statements = [part.strip() for line in lines for part in line.split(";")]
        self._evaluate = evaluate
        self._command = command

    def start(self, label: str, *, now_ns: int) -> bool:
        """Begin at `label`; False where there is no such label."""
        if label not in self._statements:
            return False
        self._at, self.running, self.wake_ns = self._statements.index(label), True, now_ns
        return True

    def run(self, now_ns: int) -> None:
        """Execute what is due, up to the next wait."""
        for _ in range(_PER_TURN):
            if not self.running or self.wake_ns > now_ns:
                return
            self._step()
        self.wake_ns = now_ns + _TURN_NS

    def _step(self) -> None:
        if self._at >= len(self._statements):
            self.running = False
            return
        statement = self._statements[self._at]
        self._at += 1
        if not statement or statement.startswith("#") or statement == "ENDIF":
            return
        if statement.startswith("WT"):
            self.wake_ns += round(self._evaluate(statement[2:]) * 1e6)
        elif statement.startswith("JP"):
            self._jump(statement[2:].strip())
        elif statement.startswith("IF"):
            self._branch(statement)
        elif statement == "EN" or not self._command(statement):
            self.running = False

    def _jump(self, label: str, *, after: int = 0) -> None:
        if label in self._statements[after:]:
            self._at = self._statements.index(label, after)
        else:
            self.running = False

    def _branch(self, statement: str) -> None:
        found = _CONDITION.fullmatch(statement)
        if found is None:
            self.running = False
        elif not _COMPARE[found[2]](self._evaluate(found[1]), self._evaluate(found[3])):
            self._jump("ENDIF", after=self._at)
