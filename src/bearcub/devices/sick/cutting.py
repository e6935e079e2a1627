"""How a telegram is cut off a stream that may begin anywhere and be damaged anywhere."""

import re
from collections.abc import Callable
from typing import Protocol, TypeVar

from bearcub.devices.framing import INCOMPLETE, Cut

M = TypeVar("M")
M_co = TypeVar("M_co", covariant=True)


class Framing(Protocol[M_co]):
    """What tells one protocol's telegrams from other bytes."""

    @property
    def start(self) -> re.Pattern[bytes]:
        """How a telegram begins; also matches a beginning that the end of the bytes cuts off."""
        ...

    def length(self, data: bytes, start: int) -> int | None:
        """Return how many bytes the telegram at `start` has, 0 if it is none, None if unknown yet.

        A length beyond the end of `data` says that more has to come.
        """
        ...

    def fault(self, raw: bytes) -> str:
        """Return why these bytes are no telegram after all, in fixed words; empty if they are."""
        ...

    def telegram(self, raw: bytes) -> M_co:
        """Return what the bytes of one telegram without fault say."""
        ...


def cutter(framing: Framing[M]) -> Callable[[bytes, int], Cut[M]]:
    """Return the function that `bearcub.devices.framing.Framer` cuts telegrams off with.

    What looks like a telegram but is none costs one byte, not the length it announces; and a
    beginning that waits for more does not keep back a complete telegram that follows it. So the
    first whole telegram after damage is found as soon as its last byte is there.
    """

    def cut(data: bytes, start: int) -> Cut[M]:
        match = framing.start.search(data, start)
        if match is None or match.start() > start:
            return Cut((match.start() if match else len(data)) - start)
        length = framing.length(data, start)
        if length == 0:
            return Cut(1)
        if length is None or start + length > len(data):
            hidden = _next_whole(framing, data, start + 1)
            return Cut(0) if hidden is None else Cut(hidden - start, None, INCOMPLETE)
        raw = data[start : start + length]
        if fault := framing.fault(raw):
            return Cut(1, None, fault)
        return Cut(length, framing.telegram(raw))

    return cut


def _next_whole(framing: Framing[M], data: bytes, start: int) -> int | None:
    """Return where the next complete telegram begins; None if there is none."""
    for match in framing.start.finditer(data, start):
        at = match.start()
        length = framing.length(data, at) or 0
        # A single byte, an acknowledgement, is no proof: most telegrams contain that byte.
        if length > 1 and at + length <= len(data) and not framing.fault(data[at : at + length]):
            return at
    return None
