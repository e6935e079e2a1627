"""A robot on two wheels driven by a Galil controller."""

import asyncio
import contextlib
import threading
from dataclasses import replace

from bearcub.clock import Clock
from bearcub.devices.galil.client import GalilClient
from bearcub.devices.galil.driver import GalilDriver, GalilSetup
from bearcub.devices.galil.replies import Reply
from bearcub.devices.health import Health
from bearcub.devices.link import Link
from bearcub.devices.protocols import Drive, Reading
from bearcub.devices.target import Target
from bearcub.devices.watch import Watch
from bearcub.errors import ConfigError, DeviceError, DeviceTimeout, FormatError
from bearcub.messages import WheelState

_COMMAND_LIMIT = 0.3  # s
_LOOK = 0.05  # between two looks for silence [s]
_FAREWELL = 0.3  # for the controller to say that it stops [s]


class GalilDrive(Drive):
    """Commands the wheels by jog speeds and reads their encoders.

    Two guards stop the wheels when nobody commands them any more. The drive's own thread stops
    them when the loop has given no command for `command_limit`. When the thread, the computer or
    the network dies, the program on the controller does so after `GalilSetup.silence`.

    The first command switches the motors on, never the connection alone.

    The thread runs an asyncio event loop. A program that has such a loop itself awaits `serve`
    there instead of `start`.

    Parameters
    ----------
    link : Link
        A `TcpLink`, which says where the controller is; the connection is asyncio's.
    setup : GalilSetup
    clock : Clock
        That feedback is stamped by.
    command_limit : float
        How long a command counts [s].
    role : str
        What it is called in messages.

    Raises
    ------
    ConfigError
        If the link is not to HOST:PORT.
    """

    def __init__(
        self,
        link: Link,
        setup: GalilSetup,
        *,
        clock: Clock,
        command_limit: float = _COMMAND_LIMIT,
        role: str = "drive",
    ) -> None:
        self._name = f"{role} ({link.name})"
        self._clock = clock
        self._target = Target(clock, limit=command_limit)
        self._driver = GalilDriver(setup, target=self._target.current)
        parser = self._driver.parser
        self._client = GalilClient(*_endpoint(link), parser=parser, heard=self._hear)
        self._watch = Watch(self._name, rate_hz=setup.rate_hz, tally=parser.tally, clock=clock)
        self._latest: tuple[WheelState, int, int] | None = None  # with its stamp and number
        self._serving: asyncio.Task[None] | None = None
        self._thread: threading.Thread | None = None
        self._closed = False

    @property
    def name(self) -> str:
        """What it is called in messages: ``drive (192.168.2.2:23)``."""
        return self._name

    @property
    def identity(self) -> str:
        """The controller's model and firmware; empty before the first connection."""
        return self._driver.revision

    def start(self) -> None:
        """Begin to connect, without waiting for it."""
        if self._thread is None and not self._closed:
            self._serving = asyncio.new_event_loop().create_task(self.serve())
            self._thread = threading.Thread(
                target=_run, args=(self._serving,), name=self._name, daemon=True
            )
            self._thread.start()

    def command(self, speed: float, turn_rate: float) -> None:
        """Drive at `speed` [m/s] and `turn_rate` [rad/s]; sent within one period."""
        self._target.set(speed, turn_rate)

    def stop(self) -> None:
        """Stop at the set deceleration; sent within one period."""
        self._target.clear()

    def enable(self) -> None:
        """Switch the motors on again after a fault that switched them off or stopped them."""
        self._driver.enable_wanted = True

    def feedback(self) -> Reading[WheelState] | None:
        """Return what the wheels do; None before the first."""
        latest = self._latest  # one load: the thread may replace it at any time
        if latest is None:
            return None
        state, stamp_ns, count = latest
        age = (self._clock.now_ns() - stamp_ns) * 1e-9
        fresh = age <= self._watch.limit
        return Reading(value=state, stamp_ns=stamp_ns, age=age, fresh=fresh, count=count)

    def health(self) -> Health:
        """Return how it is."""
        health = self._watch.health()
        if self._thread is None or self._thread.is_alive() or self._closed:
            return health
        problem = f"{self._name}: its thread failed by an error of this program; see stderr"
        return replace(health, problem=problem)

    def close(self) -> None:
        """Stop the wheels and let go of the controller, whose motors stay on and hold."""
        self._target.clear()
        self._closed = True
        if self._thread is not None and self._serving is not None:
            with contextlib.suppress(RuntimeError):  # its loop is at its end already
                self._serving.get_loop().call_soon_threadsafe(self._serving.cancel)
            self._thread.join()
        self._watch.closed()

    async def serve(self) -> None:
        """Connect, drive, and begin anew after every failure, until it is cancelled.

        Then it stops the wheels, which the controller has acknowledged when this returns.
        """
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._look_for_silence())
            while True:
                self._watch.connecting()
                try:
                    async with self._client:
                        await self._converse()
                except DeviceError as error:
                    self._watch.lost(error)

    async def _converse(self) -> None:
        self._watch.connected()
        try:
            await self._driver.converse(self._client)
        except asyncio.CancelledError:
            farewell = self._driver.farewell()
            with contextlib.suppress(DeviceError):  # it may be gone already
                await self._client.exchange(farewell, lambda _: True, within=_FAREWELL)
            raise

    async def _look_for_silence(self) -> None:
        """Have a silence logged, which nothing that comes would tell of."""
        while True:
            self._watch.silence()
            await asyncio.sleep(_LOOK)

    def _hear(self, n_bytes: int, replies: list[Reply]) -> None:
        """Take what the controller sends, as it comes."""
        now_ns = self._clock.now_ns()
        self._watch.heard(n_bytes)
        for reply in replies:
            try:
                measured = self._driver.value(reply)
            except FormatError as error:
                self._watch.refused(error)
                continue
            if measured is not None:
                self._watch.value(now_ns)
                self._latest = (measured.value, now_ns, self._watch.arrivals.count)
        missing = self._watch.silence() if self._watch.delivering else ""
        if missing:
            raise DeviceTimeout(missing)


def _endpoint(link: Link) -> tuple[str, int]:
    """Return the host and port that a link's name gives."""
    host, _, port = link.name.rpartition(":")
    if not host or not port.isdecimal():
        raise ConfigError(f"{link.name}: a Galil controller is reached by TCP, at HOST:PORT")
    return host, int(port)


def _run(task: asyncio.Task[None]) -> None:
    """Run the event loop of a task to the task's end."""
    loop = task.get_loop()
    try:
        with contextlib.suppress(asyncio.CancelledError):
            loop.run_until_complete(task)
    finally:
        loop.close()
