"""From a stream of bytes to telegrams: bounded, resynchronising, counting what it refuses."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

M = TypeVar("M")

INCOMPLETE = "telegram cut off"
TOO_LONG = "telegram too long"


@dataclass(slots=True)
class Tally:
    """What a parser has refused so far.

    Attributes
    ----------
    reasons : Counter of str
        How many telegrams were refused, by reason; a parser uses a small fixed set of reasons.
    last : str
        The latest reason.
    rejected_bytes : int
        That were skipped, noise between telegrams included.
    resyncs : int
        How often it had to skip bytes to find the next telegram.
    drops : int
        Telegrams that the device numbered and that never came.
    """

    reasons: Counter[str] = field(default_factory=Counter)
    last: str = ""
    rejected_bytes: int = 0
    resyncs: int = 0
    drops: int = 0

    @property
    def errors(self) -> int:
        """Telegrams refused for any reason."""
        return self.reasons.total()

    def refuse(self, reason: str) -> None:
        """Count one telegram that was refused."""
        self.reasons[reason] += 1
        self.last = reason


class Parser(Protocol[M]):
    """Pure: bytes in, in whatever pieces; telegrams out. Never raises, whatever the bytes."""

    @property
    def tally(self) -> Tally:
        """What was refused so far."""
        ...

    def feed(self, data: bytes) -> list[M]:
        """Take the next bytes of the stream and return the telegrams that they complete."""
        ...

    def silence(self) -> list[M]:
        """Give up waiting for the rest of a telegram, now that the line has fallen silent.

        What looked like its beginning was noise that may hide whole telegrams: those are returned.
        """
        ...

    def reset(self) -> None:
        """Forget what is unfinished, as after a reconnect; the tally stays."""
        ...


@dataclass(frozen=True, slots=True)
class Cut(Generic[M]):
    """What stands at the beginning of the bytes given.

    Attributes
    ----------
    used : int
        Bytes to go on by; 0 when more are needed to tell.
    telegram : M or None
        None for bytes that are skipped.
    reason : str
        Why they are, in a few fixed words; empty for noise between telegrams.
    """

    used: int
    telegram: M | None = None
    reason: str = ""


class Framer(Generic[M]):
    """The `Parser` of a protocol, made from a function that cuts off one telegram.

    Parameters
    ----------
    cut : callable
        ``cut(data, start) -> Cut``: looks at ``data[start:]``, which holds at least one byte, and
        says what stands there. It skips noise up to the next possible beginning at once (reason
        empty), skips ONE byte of a telegram that turns out wrong (with the reason), and answers
        ``Cut(0)`` for the beginning of a telegram that may be right. It must not raise.
    longest : int
        Bytes of the longest telegram; a beginning that waits for more is refused.

    Examples
    --------
    Letters between angle brackets:

    >>> def cut(data: bytes, start: int) -> Cut[str]:
    ...     if data[start : start + 1] != b"<":
    ...         found = data.find(b"<", start)
    ...         return Cut((found if found >= 0 else len(data)) - start)
    ...     end = data.find(b">", start)
    ...     return Cut(end + 1 - start, data[start + 1 : end].decode()) if end > 0 else Cut(0)
    >>> framer = Framer(cut, longest=10)
    >>> framer.feed(b"?<ab><c"), framer.feed(b"d>")
    (['ab'], ['cd'])
    >>> framer.tally.rejected_bytes
    1
    """

    def __init__(self, cut: Callable[[bytes, int], Cut[M]], *, longest: int) -> None:
        self.tally = Tally()
        self._cut = cut
        self._longest = longest
        self._rest = b""
        self._skipping = False

    def feed(self, data: bytes) -> list[M]:
        """Take the next bytes of the stream and return the telegrams that they complete."""
        self._rest += data
        return self._telegrams(final=False)

    def silence(self) -> list[M]:
        """Give up waiting for the rest of a telegram; return what it hid."""
        return self._telegrams(final=True) if self._rest else []

    def reset(self) -> None:
        """Forget what is unfinished; the tally stays."""
        self._rest = b""
        self._skipping = False

    def _telegrams(self, *, final: bool) -> list[M]:
        data, start, telegrams = self._rest, 0, []
        while start < len(data):
            cut = self._cut(data, start)
            if not cut.used:
                if len(data) - start < self._longest and not final:
                    break
                cut = Cut(1, None, INCOMPLETE if final else TOO_LONG)
            if cut.telegram is None:
                self._skip(cut)
            else:
                self._skipping = False
                telegrams.append(cut.telegram)
            start += cut.used
        self._rest = data[start:]
        return telegrams

    def _skip(self, cut: Cut[M]) -> None:
        self.tally.rejected_bytes += cut.used
        if cut.reason:
            self.tally.refuse(cut.reason)
        if not self._skipping:
            self.tally.resyncs += 1
        self._skipping = True
