"""Notes for the operator: each said once, and counted."""

import re
from collections.abc import Callable, Iterable


class Notes:
    """Says every distinct note once; two that differ in their numbers only are the same.

    Parameters
    ----------
    say : callable
        Takes one sentence.

    Examples
    --------
    >>> notes = Notes(print)
    >>> notes.add(["the tilt is 5.1 deg off"])
    the tilt is 5.1 deg off
    >>> notes.add(["the tilt is 5.3 deg off"])
    >>> notes.repeat(frames=2)
    in 2 of 2 frames: the tilt is 5.1 deg off
    """

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self._first: dict[str, str] = {}
        self._counts: dict[str, int] = {}

    def add(self, notes: Iterable[str]) -> None:
        """Take the notes of one frame."""
        for note in notes:
            kind = re.sub(r"[-+]?\d+(\.\d+)?", "#", note)
            if kind not in self._first:
                self._first[kind] = note
                self._say(note)
            self._counts[kind] = self._counts.get(kind, 0) + 1

    def repeat(self, *, frames: int) -> None:
        """Say again, with its count, what was noted of more than one of so many frames."""
        for kind, count in self._counts.items():
            if count > 1:
                self._say(f"in {count} of {frames} frames: {self._first[kind]}")
