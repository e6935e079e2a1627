"""Talks to a Galil controller over TCP, for programs that run on asyncio."""

import asyncio
import contextlib
from collections.abc import Callable
from types import TracebackType
from typing import Self

from bearcub.devices.galil.commands import Commands
from bearcub.devices.galil.replies import Reply, ReplyParser
from bearcub.devices.link import reason
from bearcub.errors import DeviceDisconnected, DeviceError

_PORT = 23  # the firmware takes any; this one is what programs for it use
_CONNECT = 1.0  # a robot's own network answers in milliseconds [s]
_CLOSE = 0.3  # what was sent last goes out [s]
_FIRST_RETRY, _LAST_RETRY = 0.05, 0.5  # the pause before reconnecting doubles in between [s]
_STEADY = 1.0  # a connection that held for so long was no failed attempt [s]
_AT_ONCE = 65536  # bytes taken by one read


class GalilClient(Commands):
    """A connection to a controller; one command at a time is on its way.

    Tasks of one event loop may share it: each gets the replies to its own commands. A command that
    is cancelled does not leave its reply to the next one. When a reply does not come in time nobody
    could tell any more which reply belongs to which command, so the connection is closed.

    It never reconnects in the middle of a program's commands: a controller that has lost its power
    has lost its ramps and its watchdog too. Who wants to go on connects anew, at the earliest
    0.05 s after a failure and 0.5 s after several in a row, which `connect` sees to.

    The errors do not repeat the controller's address.

    Parameters
    ----------
    host : str
    port : int
    parser : ReplyParser, optional
        Keeps the tally of what was refused, and what the controller's program prints.
    heard : callable, optional
        Is told of all that comes, as it comes: the number of bytes, and the replies in them.

    Examples
    --------
    >>> async def position() -> str:
    ...     async with GalilClient("192.168.2.2") as controller:
    ...         await controller.command("SH A")
    ...         return await controller.command("TPA")
    """

    def __init__(
        self,
        host: str,
        port: int = _PORT,
        *,
        parser: ReplyParser | None = None,
        heard: Callable[[int, list[Reply]], None] = lambda *_: None,
    ) -> None:
        super().__init__()
        self._turn = asyncio.Lock()
        self._address = (host, port)
        self._parser = parser or ReplyParser()
        self._heard = heard
        self._line: _Line | None = None
        self._abandoned = 0  # exchanges that were cancelled
        self._owed = False  # whether replies to the last of them are still to come
        self._beat = 0.0  # when the last was due, by the event loop's clock [s]
        self._opened = 0.0  # by the event loop's clock [s]
        self._failures = 0  # in a row
        self._retry = 0.0  # not before then, by the event loop's clock [s]

    async def __aenter__(self) -> Self:
        await self.connect()
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if isinstance(error, DeviceError) and self.connected:
            self._fail()
        await self.close()

    @property
    def connected(self) -> bool:
        """Whether there is a connection, as far as is known."""
        return self._line is not None

    async def connect(self) -> None:
        """Connect, after a pause where the last connection failed; a second call does nothing.

        Raises
        ------
        DeviceError
            If that is not possible now, within about a second.
        """
        async with self._turn:
            if self._line is not None:
                return
            now = asyncio.get_running_loop().time
            await asyncio.sleep(max(0.0, self._retry - now()))
            self._opened = now()
            try:
                async with asyncio.timeout(_CONNECT):
                    self._line = _Line(*await asyncio.open_connection(*self._address))
            except OSError as error:
                self._fail()
                raise DeviceError(f"no connection: {reason(error)}") from error
            self._parser.reset()
            self._owed = False

    async def close(self) -> None:
        """Disconnect once what was sent is out; a second call does nothing."""
        line, self._line = self._line, None
        if line is not None:
            await line.close()

    async def beat(self, seconds: float) -> None:
        """Wait until so long [s] after the last beat was due; one that was missed is left out."""
        now = asyncio.get_running_loop().time()
        self._beat = max(self._beat + seconds, now)
        await asyncio.sleep(self._beat - now)

    async def exchange(
        self, data: bytes, wanted: Callable[[Reply], bool], *, within: float
    ) -> bool:
        """Send bytes and hear replies until one is `wanted`; the caller has the turn.

        Returns
        -------
        in_time : bool
            False if none was wanted `within` [s]; the connection is closed then.

        Raises
        ------
        DeviceDisconnected
            If the other end went away.
        """
        if self._line is None:
            raise DeviceDisconnected("is not connected")
        try:
            in_time = await self._converse(self._line, data, wanted, within)
        except OSError as error:
            self._fail()
            await self.close()
            if isinstance(error, DeviceError):
                raise
            raise DeviceDisconnected(f"went away: {reason(error)}") from error
        except BaseException:  # most of all CancelledError
            self._owed = True
            self._abandoned += 1
            raise
        if not in_time:
            self._parser.silence()
            self._fail()
            await self.close()
        return in_time

    async def _converse(
        self, line: "_Line", data: bytes, wanted: Callable[[Reply], bool], within: float
    ) -> bool:
        now = asyncio.get_running_loop().time
        until, mark = now() + within, ""
        if self._owed:  # all replies up to this text belong to commands that nobody waits for
            mark = f"BCMARK{self._abandoned}"
            data = f'MG "{mark}"\r'.encode("ascii") + data
        else:  # what came without being asked for is not taken for the reply to this
            while now() < until and await line.ready(0.0):
                self._take(line)
            self._parser.silence()
        line.write(data)
        while now() < until and await line.ready(until - now()):
            for reply in self._take(line):
                if mark:
                    self._owed = not reply.text.endswith(mark)
                    mark = mark if self._owed else ""
                elif wanted(reply):
                    return True
        return False

    def _take(self, line: "_Line") -> list[Reply]:
        data = line.take()
        replies = self._parser.feed(data)
        self._heard(len(data), replies)
        return replies

    def _fail(self) -> None:
        """Let some time pass before the next connection, more after several failures."""
        now = asyncio.get_running_loop().time()
        if now - self._opened >= _STEADY:
            self._failures = 0
        self._retry = now + min(_FIRST_RETRY * 2 ** min(self._failures, 8), _LAST_RETRY)
        self._failures += 1


class _Line:
    """An open connection on which a read is always under way.

    So a caller that is cancelled takes no bytes with it, and what comes while nobody asks is seen.
    """

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader = reader
        self._writer = writer
        self._reading = asyncio.create_task(reader.read(_AT_ONCE))

    def write(self, data: bytes) -> None:
        """Send; a few commands fit into any buffer."""
        self._writer.write(data)

    async def ready(self, within: float) -> bool:
        """Wait for something to `take`, at most so long [s]; tell whether there is."""
        await asyncio.wait({self._reading}, timeout=within)
        return self._reading.done()

    def take(self) -> bytes:
        """Return what has come; `ready` has said that something has."""
        if self._reading.cancelled():
            raise DeviceDisconnected("was closed")
        data = self._reading.result()
        if not data:
            raise DeviceDisconnected("closed the connection")
        self._reading = asyncio.create_task(self._reader.read(_AT_ONCE))
        return data

    async def close(self) -> None:
        """Disconnect once what was sent is out, or the other end takes nothing more."""
        self._reading.cancel()
        self._writer.close()
        with contextlib.suppress(OSError):
            async with asyncio.timeout(_CLOSE):
                await self._writer.wait_closed()
        self._writer.transport.abort()
        await asyncio.gather(self._reading, return_exceptions=True)
