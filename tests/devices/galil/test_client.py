"""The asyncio client on an emulated controller, over loopback TCP.

Whatever is left behind (a task, a socket, an exception that nobody took) is a warning of Python's,
and so a failure here.
"""

import asyncio
import contextlib
import gc
import signal
import socket
import threading
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any

import pytest

from bearcub.clock import MonotonicClock
from bearcub.devices.galil import CommandError, GalilClient
from bearcub.devices.galil.record import Layout, decode_record
from bearcub.devices.galil.replies import ReplyParser
from bearcub.emulators import FAULTS, Emulator, TcpHost
from bearcub.emulators.faults import Merged, Split, Stuck
from bearcub.emulators.galil import GalilEmulator
from bearcub.errors import DeviceDisconnected, DeviceError, DeviceTimeout, InputError

HOST = "127.0.0.1"
Work = Callable[[GalilClient], Awaitable[Any]]
Behaviour = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


def always(_: int) -> bool:
    return True


def on_tcp(work: Work, *, emulator: Emulator | None = None) -> Any:
    """Let a client work with an emulator over TCP; its end leaves nothing behind."""

    async def main(port: int) -> Any:
        async with GalilClient(HOST, port) as client:
            result = await work(client)
        assert asyncio.all_tasks() == {asyncio.current_task()}
        return result

    with TcpHost(emulator or GalilEmulator(), clock=MonotonicClock()) as host:
        threads = threading.active_count()
        try:
            return asyncio.run(main(host.port))
        finally:
            gc.collect()
            assert threading.active_count() == threads


def says(data: bytes, *, then_silent: bool = False) -> Behaviour:
    """A controller that answers the first command so, and then hangs up or says no more."""

    async def behave(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b"\r")
        writer.write(data)
        if then_silent:
            await reader.read()

    return behave


@contextlib.asynccontextmanager
async def listening(*behaviours: Behaviour) -> AsyncIterator[int]:
    """A port where one connection after another is treated so."""
    waiting, done = iter(behaviours), []

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        finished = asyncio.Event()
        done.append(finished)
        try:
            await next(waiting)(reader, writer)
        finally:
            writer.close()
            finished.set()

    async with await asyncio.start_server(serve, HOST, 0) as server:
        yield server.sockets[0].getsockname()[1]
        for finished in done:
            await finished.wait()


def test_commands_get_what_they_print_and_records_what_they_hold() -> None:
    async def work(client: GalilClient) -> None:
        assert client.connected
        assert await client.command("SH AB") == ""
        assert await client.command("JGA=1000") == ""
        assert await client.command("JG ?,?") == "1000, 25000"
        layout = Layout.parse(await client.command("QZ"))
        left, right = decode_record(await client.record(), layout, axes="AC")
        assert (left.motor_off, right.motor_off) == (False, True)

    on_tcp(work)


def test_a_refused_command_is_told_with_the_reason_in_words() -> None:
    async def work(client: GalilClient) -> None:
        with pytest.raises(CommandError) as refused:
            await client.command("BG A")
        assert str(refused.value) == "refused 'BG A': error 20: cannot begin with the motor off"
        assert (refused.value.command, refused.value.why[:8]) == ("BG A", "error 20")
        assert await client.command("MG _MOA") == "1.0000"

    on_tcp(work)


@pytest.mark.parametrize(
    ("told", "why"),
    [
        (b"113 Hall sensor fault\r\n:", "error 113: Hall sensor fault"),
        (b" 250\r\n:", "error 250: see TC in the command reference of the controller"),
        (b"?", "it does not say why"),
    ],
)
def test_an_error_that_is_not_in_the_list_is_told_as_the_controller_does(
    told: bytes, why: str
) -> None:
    async def refuse(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        assert await reader.readuntil(b"\r") == b"BZ A\r"
        writer.write(b"?")
        assert await reader.readuntil(b"\r") == b"TC1\r"
        writer.write(told)
        await reader.read()

    async def main() -> None:
        async with listening(refuse) as port, GalilClient(HOST, port) as client:
            with pytest.raises(CommandError) as refused:
                await client.command("BZ A")
            assert refused.value.why == why

    asyncio.run(main())


def test_two_callers_at_a_time_each_get_their_own_replies() -> None:
    async def work(client: GalilClient) -> None:
        asked = [client.command(f"MG {n}") for n in range(30)]
        records = [client.record() for _ in range(5)]
        said = await asyncio.gather(*asked[:15], *records, *asked[15:])
        assert [text for text in said if isinstance(text, str)] == [f"{n}.0000" for n in range(30)]
        assert [len(data) for data in said if isinstance(data, bytes)] == [226] * 5

    on_tcp(work)
    on_tcp(work, emulator=Split(GalilEmulator(), always))


def test_two_callers_that_are_refused_each_get_their_own_reason() -> None:
    async def work(client: GalilClient) -> None:
        wrong = ["BG A", "XX", "MG 1/0", "XX", "BG B"]
        said = await asyncio.gather(*map(client.command, wrong), return_exceptions=True)
        assert [str(error).rpartition("error ")[2].partition(":")[0] for error in said] == (
            ["20", "1", "6", "1", "20"]
        )

    on_tcp(work)


class Late(Merged):
    """Answers 20 ms late."""

    HELD_NS = 20_000_000


@pytest.mark.parametrize("command", ["MG 1", "BG A", "QR"])
def test_a_cancelled_command_does_not_leave_its_reply_to_the_next(command: str) -> None:
    async def work(client: GalilClient) -> None:
        for milliseconds in (0, 5, 15, 25):
            with contextlib.suppress(TimeoutError, CommandError):
                async with asyncio.timeout(milliseconds / 1e3):
                    await client.command(command)
            assert await client.command("MG 2") == "2.0000"
            assert await client.command("MG 3") == "3.0000"

    on_tcp(work, emulator=Late(GalilEmulator(), always))


def test_a_command_that_is_cancelled_before_its_turn_is_never_sent() -> None:
    controller = GalilEmulator()

    async def work(client: GalilClient) -> None:
        first = asyncio.create_task(client.command("MG 1"))
        second = asyncio.create_task(client.command("SH A"))
        await asyncio.sleep(0)
        second.cancel()
        assert await first == "1.0000"
        assert await client.command("MG _MOA") == "1.0000"
        assert second.cancelled()

    on_tcp(work, emulator=Late(controller, always))
    assert controller.axes["A"].motor_off


def test_a_connection_that_is_lost_in_the_middle_of_a_reply_can_be_made_anew() -> None:
    async def main() -> None:
        parser = ReplyParser()
        async with listening(says(b" 12"), says(b" 7\r\n:", then_silent=True)) as port:
            client = GalilClient(HOST, port, parser=parser)
            await client.connect()
            with pytest.raises(DeviceDisconnected, match=r"closed the connection|went away"):
                await client.command("TPA")
            assert not client.connected
            with pytest.raises(DeviceDisconnected, match="is not connected"):
                await client.command("TPA")
            async with client:
                assert await client.command("TPA") == "7"
        assert parser.tally.errors == 0

    asyncio.run(main())


def test_half_a_reply_and_then_silence_is_a_time_out_that_ends_the_connection() -> None:
    async def main() -> None:
        behaviours = says(b" 12", then_silent=True), says(b"34\r\n:", then_silent=True)
        parser = ReplyParser()
        async with listening(*behaviours) as port, GalilClient(HOST, port, parser=parser) as client:
            with pytest.raises(DeviceTimeout, match=r"0 of 1 answers within 0\.3 s to 'TPA'"):
                await client.command("TPA")
            assert not client.connected
            assert parser.tally.reasons == {"telegram cut off": 1}
            await client.connect()
            assert await client.command("TPA") == "34"

    asyncio.run(main())


def test_what_a_cancelled_command_left_does_not_reach_the_next_connection() -> None:
    heard = []

    async def listen(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        heard.append(await reader.readuntil(b"\r"))
        writer.write(b" 1\r\n:")
        await reader.read()

    async def main() -> None:
        async with listening(says(b"", then_silent=True), listen) as port:
            client = GalilClient(HOST, port)
            with contextlib.suppress(TimeoutError):
                async with client, asyncio.timeout(0.01):
                    await client.command("MG 2")
            async with client:
                assert await client.command("MG 1") == "1"

    asyncio.run(main())
    assert heard == [b"MG 1\r"]


def test_a_reset_is_a_lost_connection() -> None:
    async def work(client: GalilClient) -> None:
        with pytest.raises(DeviceDisconnected, match="went away: connection reset by peer"):
            await client.command("TPA")

    on_tcp(work, emulator=FAULTS["reset"](GalilEmulator(), always))


def test_without_a_controller_the_reason_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    async def main(port: int) -> None:
        async with GalilClient(HOST, port):
            pass

    with socket.create_server((HOST, 0)) as taken:
        port = taken.getsockname()[1]
    with pytest.raises(DeviceError, match="no connection: connection refused"):
        asyncio.run(main(port))

    async def unknown(*_: object) -> None:
        raise socket.gaierror(-2, "Name or service not known")

    monkeypatch.setattr(asyncio, "open_connection", unknown)
    with pytest.raises(DeviceError, match="no connection: name or service not known"):
        asyncio.run(main(port))


@pytest.mark.parametrize("text", ["SH A;BG A", "TPA\r", "MG \N{DEGREE SIGN}"])
def test_what_is_not_one_command_is_not_sent(text: str) -> None:
    with pytest.raises(InputError, match="expected one command"):
        asyncio.run(GalilClient(HOST).command(text))


def test_ctrl_c_ends_a_program_and_leaves_nothing_behind() -> None:
    async def work(client: GalilClient) -> None:
        asyncio.get_running_loop().call_later(0.02, signal.raise_signal, signal.SIGINT)
        while True:
            await client.command("TPA")

    with pytest.raises(KeyboardInterrupt):
        on_tcp(work)


def test_a_program_that_is_cancelled_can_still_stop_its_motors() -> None:
    controller = GalilEmulator()

    async def work(client: GalilClient) -> None:
        for command in ("SH A", "JGA=5000", "BG A"):
            await client.command(command)
        try:
            while True:
                await client.command("TPA")
        finally:
            await client.command("ST A")

    async def hurried(client: GalilClient) -> None:
        async with asyncio.timeout(0.05):
            await work(client)

    with pytest.raises(TimeoutError):
        on_tcp(hurried, emulator=Late(controller, lambda now_ns: controller.axes["A"].moving))
    assert controller.axes["A"].stopping or not controller.axes["A"].moving


def test_closing_ends_what_another_task_waits_for() -> None:
    async def work(client: GalilClient) -> None:
        waiting = asyncio.create_task(client.command("TPA"))
        await asyncio.sleep(0.01)
        await client.close()
        await client.close()
        with pytest.raises(DeviceDisconnected, match="was closed"):
            await waiting

    on_tcp(work, emulator=Stuck(GalilEmulator(), always))


def test_a_program_is_downloaded_and_listed_whatever_it_prints() -> None:
    async def work(client: GalilClient, parser: ReplyParser) -> None:
        program = '#GO\rMG "a: b?"\rEN'
        await client.require(["CW 1", f"DL\r{program}\r\\"], answers=3)
        assert await client.listing() == '0 #GO\n1 MG "a:b?"\n2 EN'
        await client.command("XQ #GO")
        assert await client.command("MG 1") == "1.0000"
        assert list(parser.messages) == ["a: b?"]

    async def main(port: int) -> None:
        parser = ReplyParser()
        async with GalilClient(HOST, port, parser=parser) as client:
            await work(client, parser)

    with TcpHost(GalilEmulator(), clock=MonotonicClock()) as host:
        asyncio.run(main(host.port))
