"""A table to work on in manual time: code on asyncio runs with no thread, no socket, no waiting."""

import asyncio
import contextlib
import math
from collections.abc import Callable, Coroutine, Iterator
from typing import Any

import pytest

from bearcub.clock import ManualClock
from bearcub.devices.galil import GalilDrive, GalilSetup
from bearcub.devices.link import TcpLink
from bearcub.emulators import Emulator
from bearcub.emulators.drive_kinds import EMULATED_WHEELS
from bearcub.emulators.galil import GalilEmulator

TICK = 0.002  # how often an emulator is asked what it sends [s]
STEP = 0.01  # between two commands of the loop that drives [s]


class Table(asyncio.BaseEventLoop):
    """A loop on whose table one emulated device stands: whoever connects is connected to it.

    Time passes when nothing is left to do in the present.
    """

    def __init__(self, clock: ManualClock) -> None:
        super().__init__()
        self._selector = self
        self.clock = clock
        self.emulator: Emulator | None = None
        self.plugged = True
        self.tick = TICK
        self.wires: list[Wire] = []

    def time(self) -> float:
        return self.clock.now_ns() * 1e-9

    def select(self, timeout: float | None) -> None:
        assert timeout is not None, "nothing will ever happen again"
        self.clock.advance(math.ceil(timeout * 1e9) * 1e-9)

    def _process_events(self, events: None) -> None:
        """There are none."""

    def _write_to_self(self) -> None:
        """Nobody sleeps."""

    async def create_connection(
        self, protocol_factory: Callable[[], Any], *_: Any, **__: Any
    ) -> Any:
        if not self.plugged or self.emulator is None:
            raise ConnectionRefusedError(111, "Connect call failed")
        protocol = protocol_factory()
        self.emulator.connect()
        wire = Wire(self, self.emulator, protocol)
        self.wires.append(wire)
        protocol.connection_made(wire)
        return wire, protocol

    def pull_the_plug(self) -> None:
        self.plugged = False
        for wire in self.wires:
            wire.lose(ConnectionResetError(104, "Connection reset by peer"))

    def run(self, coroutine: Coroutine[Any, Any, Any]) -> Any:
        return self.run_until_complete(coroutine)

    def pass_time(self, seconds: float) -> None:
        self.run(asyncio.sleep(seconds))


class Wire(asyncio.Transport):
    """A connection straight into an emulator."""

    def __init__(self, table: Table, emulator: Emulator, protocol: Any) -> None:
        super().__init__()
        self._table = table
        self._emulator = emulator
        self._protocol = protocol
        self._closing = False
        self._tick = table.call_soon(self._poll)

    def _poll(self) -> None:
        try:
            said = self._emulator.poll(self._table.clock.now_ns())
        except ConnectionResetError:
            self.lose(ConnectionResetError(104, "Connection reset by peer"))
            return
        if said:
            self._protocol.data_received(said)
        self._tick = self._table.call_later(self._table.tick, self._poll)

    def write(self, data: bytes | bytearray | memoryview) -> None:
        if not self._closing:
            self._emulator.receive(bytes(data))

    def lose(self, error: OSError | None) -> None:
        if not self._closing:
            self._closing = True
            self._tick.cancel()
            self._table.call_soon(self._protocol.connection_lost, error)

    def close(self) -> None:
        self.lose(None)

    def abort(self) -> None:
        self.lose(None)

    def is_closing(self) -> bool:
        return self._closing


@pytest.fixture
def table() -> Iterator[Table]:
    """A table to put an emulator on; what is left on it at the end is a mistake."""
    found = Table(ManualClock())
    yield found
    assert asyncio.all_tasks(found) == set()
    assert all(wire.is_closing() for wire in found.wires)
    found.close()


class Bench:
    """A drive and a controller that live in the same manual time."""

    def __init__(
        self,
        table: Table,
        *,
        setup: GalilSetup | None = None,
        controller: GalilEmulator | None = None,
        line: Callable[[GalilEmulator], Emulator] = lambda emulator: emulator,
    ) -> None:
        self.table = table
        self.clock = table.clock
        self.controller = controller or GalilEmulator()
        table.emulator = line(self.controller)
        self.drive = GalilDrive(
            TcpLink("emulator", 23), setup or GalilSetup(wheels=EMULATED_WHEELS), clock=self.clock
        )
        self.serving: asyncio.Task[None] = table.create_task(self.drive.serve())

    def run(self, seconds: float, command: tuple[float, float] | None = None) -> None:
        """Let the loop command at 100 Hz, and the drive do its work."""
        end = self.clock.now_ns() + round(seconds * 1e9)
        while self.clock.now_ns() < end:
            if command is not None:
                self.drive.command(*command)
            self.table.pass_time(STEP)
        assert not self.serving.done()

    def leave_alone(self, seconds: float) -> None:
        """Let time pass for the controller while the host is dead."""
        for _ in range(round(seconds * 1000)):
            self.clock.advance(0.001)
            self.controller.poll(self.clock.now_ns())

    def moving(self) -> bool:
        return any(axis.moving for axis in self.controller.axes.values())

    def close(self) -> None:
        """End the drive as its own thread does."""
        self.serving.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            self.table.run_until_complete(self.serving)
        self.drive.close()


@pytest.fixture
def on_bench(table: Table) -> Iterator[Callable[..., Bench]]:
    """Return what puts a drive and a controller on the table."""
    benches: list[Bench] = []

    def put(**what: Any) -> Bench:
        benches.append(Bench(table, **what))
        return benches[-1]

    yield put
    for bench in benches:
        bench.close()
