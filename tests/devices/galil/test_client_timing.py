"""The asyncio client in manual time: cancelled at any moment, kept waiting, called unasked."""

import asyncio
import gc
import itertools
from typing import Any

import pytest

from bearcub.devices.galil import GalilClient
from bearcub.devices.galil.replies import Reply
from bearcub.emulators import Emulator
from bearcub.emulators.faults import Faulty, Merged, Split, Stuck
from bearcub.emulators.galil import GalilEmulator
from bearcub.errors import DeviceError, DeviceTimeout

HOST = "controller"


def always(_: int) -> bool:
    return True


class Late(Merged):
    """Answers 20 ms late."""

    HELD_NS = 20_000_000


def test_a_connection_that_is_lost_while_nobody_asks_leaves_no_exception_behind(
    table: Any, caplog: pytest.LogCaptureFixture
) -> None:
    table.emulator = GalilEmulator()

    async def work() -> None:
        async with GalilClient(HOST) as client:
            await client.command("TPA")
            table.pull_the_plug()
            await asyncio.sleep(1.0)

    table.run(work())
    gc.collect()
    assert caplog.messages == []


def test_a_program_listing_without_an_end_is_a_time_out(table: Any) -> None:
    table.emulator = Stuck(GalilEmulator(), always)

    async def work() -> None:
        async with GalilClient(HOST) as client:
            await client.listing()

    with pytest.raises(DeviceTimeout, match="no end of the program listing within 2 s"):
        table.run(work())
    assert table.time() == pytest.approx(2.0)


@pytest.mark.parametrize("wrap", [Split, Late])
@pytest.mark.parametrize(("command", "step"), [("MG 1", 5e-4), ("BG A", 2e-3), ("QR", 1e-2)])
def test_a_command_may_be_cancelled_at_any_time(
    table: Any, command: str, step: float, wrap: type[Faulty]
) -> None:
    table.emulator = wrap(GalilEmulator(), always)
    cancelled = []

    async def work() -> None:
        async with GalilClient(HOST) as client:
            for steps in itertools.count():
                asked = asyncio.create_task(client.command(command))
                await asyncio.sleep(step * steps)
                asked.cancel()
                await asyncio.gather(asked, return_exceptions=True)
                # Twice in a row, the second time with the first one's reply under way.
                again = asyncio.create_task(client.command(command))
                await asyncio.sleep(0.6 * step * steps)
                again.cancel()
                assert await client.command("MG 2") == "2.0000"
                assert await client.command("MG 3") == "3.0000"
                cancelled.append(asked.cancelled())
                if not asked.cancelled():
                    return

    table.run(work())
    assert sum(cancelled) >= 3


class Chatty(Faulty):
    """Says colons and half a reply of its own accord, 5 ms after each reply."""

    def __init__(self, emulator: Emulator) -> None:
        super().__init__(emulator, always)
        self._due_ns = 0

    def spoil(self, data: bytes) -> bytes:
        if data:
            self._due_ns = self._now_ns + 5_000_000
        elif self._due_ns and self._now_ns >= self._due_ns:
            self._due_ns = 0
            return b" 99\r\n:?: 4"
        return data


def test_what_comes_without_being_asked_for_is_not_taken_for_a_reply(table: Any) -> None:
    table.emulator = Chatty(GalilEmulator())
    heard: list[tuple[int, list[Reply]]] = []

    async def work() -> list[str]:
        client = GalilClient(HOST, heard=lambda *what: heard.append(what))
        async with client:
            said = []
            for n in range(3):
                said.append(await client.command(f"MG {n}"))
                await asyncio.sleep(0.02)
            return said

    assert table.run(work()) == ["0.0000", "1.0000", "2.0000"]
    assert (10, [Reply(text="99"), Reply(accepted=False), Reply()]) in heard


def test_a_device_that_never_stops_talking_is_a_time_out(table: Any) -> None:
    class Flood(Faulty):
        def spoil(self, data: bytes) -> bytes:
            table.clock.advance(0.001)
            return data + b"x" * 100

    table.emulator, table.tick = Flood(GalilEmulator(), always), 0.0

    async def work() -> None:
        async with GalilClient(HOST) as client:
            await client.command("TPA")

    with pytest.raises(DeviceTimeout, match="0 of 1 answers"):
        table.run(work())
    assert table.time() == pytest.approx(0.3, abs=0.1)


def test_reconnecting_takes_longer_after_each_failure_and_half_a_second_at_most(
    table: Any,
) -> None:
    table.emulator = GalilEmulator()
    client = GalilClient(HOST)
    failed: list[float] = []

    async def work() -> None:
        async with client:
            await asyncio.sleep(5.0)
            table.pull_the_plug()
            await client.command("TPA")

    def fail() -> None:
        with pytest.raises(DeviceError):
            table.run(work())
        failed.append(table.time())

    for _ in range(7):
        fail()
    gaps = [later - before for before, later in itertools.pairwise(failed)]
    assert gaps == pytest.approx([0.05, 0.1, 0.2, 0.4, 0.5, 0.5], abs=1e-3)
    table.plugged = True
    fail()  # half a second, and five of a connection that held
    fail()
    assert failed[-1] - failed[-2] == pytest.approx(0.05, abs=1e-3)


def test_a_beat_is_even_whatever_the_commands_take_and_a_missed_one_is_left_out(
    table: Any,
) -> None:
    table.emulator = Late(GalilEmulator(), always)
    beats = []

    async def work() -> None:
        async with GalilClient(HOST) as client:
            for n in range(6):
                await client.beat(0.05)
                beats.append(table.time())
                await asyncio.sleep(0.12 if n == 3 else 0.01)
                await client.command("TPA")

    table.run(work())
    gaps = [later - before for before, later in itertools.pairwise(beats)]
    assert gaps == pytest.approx([0.05, 0.05, 0.05, 0.142, 0.05], abs=0.002)


def test_connecting_gives_up_after_a_second(table: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    async def forever(*_: object) -> None:
        await asyncio.sleep(100.0)

    monkeypatch.setattr(asyncio, "open_connection", forever)
    with pytest.raises(DeviceError, match="no connection: timed out"):
        table.run(GalilClient(HOST).connect())
    assert table.time() == pytest.approx(1.0)
