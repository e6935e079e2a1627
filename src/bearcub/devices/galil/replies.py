"""Splits what a Galil controller sends into replies: text up to ``:`` or ``?``, and records.

Every command sent on a line of its own is answered by exactly one reply: what it prints, and then
``:`` where it was accepted or ``?`` where it was not. What a program prints of its own accord comes
in between with bit 7 of every character set (``CW 1``) and is kept apart by that. A data record
begins with a byte that is no such character and tells its own length.
"""

from collections import deque
from dataclasses import dataclass

from bearcub.devices.framing import INCOMPLETE, TOO_LONG, Tally

_LONGEST_REPLY = 16384  # bytes; a listing of the largest program memory
_LONGEST_MESSAGE = 256
_RECORD = 0x87  # all blocks, and the bit that marks a record
_HEADER = 4  # bytes, of which the last two are the size
_LONGEST_RECORD = 1024
_ENDS_OF_LINE = (0x8D, 0x8A)  # with bit 7 set


@dataclass(frozen=True, slots=True, kw_only=True)
class Reply:
    """The answer to one command.

    Attributes
    ----------
    text : str
        What it printed, without surrounding white space.
    accepted : bool
        False where the controller said ``?``.
    record : bytes
        The binary data record, for QR.
    """

    text: str = ""
    accepted: bool = True
    record: bytes = b""


class ReplyParser:
    """Cuts the byte stream of one connection into `Reply` values.

    Attributes
    ----------
    messages : deque of str
        The last lines that the controller's program printed of its own accord.
    tally : Tally
        What was refused: replies that were cut off or are too long.
    """

    def __init__(self) -> None:
        self.messages: deque[str] = deque(maxlen=32)
        self.tally = Tally()
        self._text = bytearray()
        self._record = bytearray()
        self._message = bytearray()

    def feed(self, data: bytes) -> list[Reply]:
        r"""Return the replies that `data` completes.

        Examples
        --------
        >>> parser = ReplyParser()
        >>> parser.feed(b" 12")
        []
        >>> parser.feed(b"34\r\n:?")
        [Reply(text='1234', accepted=True, record=b''), Reply(text='', accepted=False, record=b'')]
        """
        replies = []
        for byte in data:
            if self._in_record or byte == _RECORD:
                self._record.append(byte)
                self._bound(self._record, _size(self._record, _HEADER), _LONGEST_RECORD)
            elif byte & 0x80:
                self._message_byte(byte)
            elif byte in b":?":
                replies.append(self._reply(accepted=byte == ord(":")))
            else:
                self._text.append(byte)
                self._bound(self._text, len(self._text), _LONGEST_REPLY)
        return replies

    def silence(self) -> list[Reply]:
        """Give up waiting for the rest of a reply."""
        for unfinished in (self._text, self._record):
            if unfinished:
                self._refuse(unfinished, INCOMPLETE)
        return []

    def reset(self) -> None:
        """Forget what is unfinished; the tally stays."""
        for unfinished in (self._text, self._record, self._message):
            unfinished.clear()

    @property
    def _in_record(self) -> bool:
        return bool(self._record) and len(self._record) < _size(self._record, _HEADER)

    def _reply(self, *, accepted: bool) -> Reply:
        text, record = bytes(self._text), bytes(self._record)
        self._text.clear()
        self._record.clear()
        return Reply(text=text.decode("ascii", "replace").strip(), accepted=accepted, record=record)

    def _message_byte(self, byte: int) -> None:
        if byte in _ENDS_OF_LINE or len(self._message) >= _LONGEST_MESSAGE:
            text = self._message.decode("ascii", "replace").strip()
            self._message.clear()
            if text:
                self.messages.append(text)
        if byte not in _ENDS_OF_LINE:
            self._message.append(byte & 0x7F)

    def _bound(self, unfinished: bytearray, size: int, longest: int) -> None:
        if size > longest:
            self._refuse(unfinished, TOO_LONG)

    def _refuse(self, unfinished: bytearray, reason: str) -> None:
        self.tally.refuse(reason)
        self.tally.rejected_bytes += len(unfinished)
        self.tally.resyncs += 1
        unfinished.clear()


def _size(record: bytearray, otherwise: int) -> int:
    """Return the size that a record's header tells, once it is there."""
    return int.from_bytes(record[2:_HEADER], "little") if len(record) >= _HEADER else otherwise
