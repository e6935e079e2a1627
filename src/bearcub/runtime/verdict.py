"""One sentence of the doctor's, how bad it is, and what to do."""

from dataclasses import dataclass
from enum import IntEnum


class Grade(IntEnum):
    """How bad it is."""

    GOOD = 0
    WARNING = 1
    FAULT = 2


@dataclass(frozen=True, slots=True)
class Remark:
    """What was seen.

    Attributes
    ----------
    text : str
    grade : Grade
    advice : str
        What to do, in one line; empty where nothing is wrong.
    """

    text: str
    grade: Grade = Grade.GOOD
    advice: str = ""

    def __str__(self) -> str:
        return f"{self.text}; {self.advice}" if self.advice else self.text
