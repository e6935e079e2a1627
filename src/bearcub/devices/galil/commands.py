"""What is asked of a Galil controller, whatever carries it: commands, replies, refusals in words.

Every command is answered by exactly one ``:`` or ``?``. Whoever asks takes a turn, so that no
second caller's replies come in between, and so that the error number that is read after a ``?``
(TC1) is that command's.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Sequence
from contextlib import AbstractAsyncContextManager, nullcontext
from dataclasses import replace
from types import coroutine

from bearcub.devices.driver import Ask, Every
from bearcub.devices.galil.codes import error_text
from bearcub.devices.galil.replies import Reply
from bearcub.errors import DeviceError, DeviceTimeout, InputError

ANSWER = 0.3  # a controller answers within milliseconds [s]
_LISTING = 2.0  # of its whole program memory [s]
_END = "BCEND"


class CommandError(DeviceError):
    """The controller answered ``?``.

    Attributes
    ----------
    command : str
    why : str
        What TC1 tells, in words.
    """

    def __init__(self, command: str, why: str) -> None:
        super().__init__(f"refused {command!r}: {why}")
        self.command = command
        self.why = why


class Commands(ABC):
    """A controller that can be asked; what carries the bytes is `exchange`."""

    def __init__(self) -> None:
        self._turn: AbstractAsyncContextManager[None] = nullcontext()

    @abstractmethod
    async def exchange(
        self, data: bytes, wanted: Callable[[Reply], bool], *, within: float
    ) -> bool:
        """Send bytes and hear replies until one is `wanted`; False if none was `within` [s]."""

    @abstractmethod
    async def beat(self, seconds: float) -> None:
        """Wait until so long [s] after the last beat was due; one that was missed is left out."""

    async def command(self, text: str) -> str:
        """Send one command and return what it prints.

        Parameters
        ----------
        text : str
            ``SH AB``, ``JGA=1000``, ``TPA``, ``MG _BGA``.

        Raises
        ------
        CommandError
            If the controller answers ``?``.
        DeviceTimeout
            If it does not answer.
        DeviceDisconnected
            If the line is broken.
        InputError
            If it is not one command.
        """
        if not text.isascii() or not text.isprintable() or ";" in text:
            raise InputError(f"galil command {text!r}: expected one command, without semicolons")
        return (await self.require([text]))[0].text

    async def record(self) -> bytes:
        """Return one binary data record (QR), for `bearcub.devices.galil.record`.

        Raises
        ------
        DeviceError
            As `command`.
        """
        return (await self.require(["QR"]))[0].record

    async def require(
        self, commands: Sequence[str], *, answers: int | None = None, within: float = ANSWER
    ) -> list[Reply]:
        """Send commands that must be accepted, and return the reply to each.

        Parameters
        ----------
        commands, answers, within
            As for `ask`.

        Raises
        ------
        CommandError
            For the first that is not accepted.
        DeviceError
            As `ask`.
        """
        replies = await self.ask(commands, answers=answers, within=within)
        for index, reply in enumerate(replies):
            if not reply.accepted:
                command = commands[min(index, len(commands) - 1)].partition("\r")[0]
                raise CommandError(command, reply.text)
        return replies

    async def ask(
        self, commands: Sequence[str], *, answers: int | None = None, within: float = ANSWER
    ) -> list[Reply]:
        """Send commands at once, each on a line of its own, and return the reply to each.

        Parameters
        ----------
        commands : sequence of str
        answers : int, optional
            How many replies they have in all, where that is not one for each.
        within : float
            [s].

        Returns
        -------
        replies : list of Reply
            The text of one that was not accepted is the reason, in words. The controller keeps the
            last error only: it stands for all.

        Raises
        ------
        DeviceTimeout
            If not all replies come in time.
        DeviceDisconnected
            If the line is broken.
        """
        async with self._turn:
            replies = await self._replies(commands, answers or len(commands), within)
            if all(reply.accepted for reply in replies):
                return replies
            (told,) = await self._replies(["TC1"], 1, within)
        return [r if r.accepted else replace(r, text=_reason(told)) for r in replies]

    async def listing(self) -> str:
        """Return the program in the controller's memory, with its line numbers.

        Its lines may hold colons and question marks, so the end is told by a text of its own.
        White space next to them is lost.

        Raises
        ------
        DeviceError
            As `ask`.
        """
        heard: list[str] = []

        def is_end(reply: Reply) -> bool:
            heard.append(reply.text + (":" if reply.accepted else "?"))
            return reply.text.endswith(_END)

        async with self._turn:
            data = f'LS\rMG "{_END}"\r'.encode("ascii")
            if not await self.exchange(data, is_end, within=_LISTING):
                raise DeviceTimeout(f"no end of the program listing within {_LISTING:g} s")
        text = "".join(heard).removesuffix(f":{_END}:")  # both commands' own colons
        return "\n".join(text.split("\r\n")).strip()

    async def _replies(self, commands: Sequence[str], expected: int, within: float) -> list[Reply]:
        replies: list[Reply] = []

        def complete(reply: Reply) -> bool:
            replies.append(reply)
            return len(replies) == expected

        data = "".join(f"{command}\r" for command in commands).encode("ascii")
        if not await self.exchange(data, complete, within=within):
            raise DeviceTimeout(
                f"{len(replies)} of {expected} answers within {within:g} s to {commands[0]!r}; "
                "check the controller's power and network"
            )
        return replies


class Steps(Commands):
    """The same as steps of a `bearcub.devices.driver.Conversation`, for links of every sort.

    A coroutine that awaits nothing else is a generator of such steps.
    """

    async def exchange(
        self, data: bytes, wanted: Callable[[Reply], bool], *, within: float
    ) -> bool:
        """Ask, by a step."""
        return await _taken(Ask(data, wanted, within)) is not None

    async def beat(self, seconds: float) -> None:
        """Wait, by a step."""
        await _taken(Every(seconds))


@coroutine
def _taken(step: Ask[Reply] | Every) -> Generator[Ask[Reply] | Every, Reply | None, Reply | None]:
    return (yield step)


def _reason(told: Reply) -> str:
    """Return what the reply to TC1 means: ``20 Begin not valid with motor off``."""
    number, _, words = told.text.partition(" ")
    if told.accepted and number.isdecimal():
        return error_text(int(number), said=words)
    return told.text or "it does not say why"
