"""What holds for every source there is: a device, a file, a recording, a camera, a simulator.

A device in the table of emulators is tested here without more; what devices alone can suffer is the
business of ``test_recovery.py``.
"""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from bearcub.clock import ManualClock
from bearcub.devices import open_frames
from bearcub.devices.cameras import CameraSource
from bearcub.devices.cameras.files import FileCapture
from bearcub.devices.carmen import open_carmen
from bearcub.devices.driver import Overheard
from bearcub.devices.health import silence_limit
from bearcub.devices.link import FileLink
from bearcub.devices.protocols import Source
from bearcub.devices.replay import Replay
from bearcub.devices.sick import Cola
from bearcub.devices.stream import Streaming
from bearcub.emulators import DirectLink
from bearcub.emulators.faults import Faulty
from bearcub.emulators.kinds import KINDS
from bearcub.sim import scenes
from bearcub.sim.mujoco import Sensors, Simulation
from bearcub.sim.source import SimulatedSource

CAPTURE = Path(__file__).parents[2] / ".." / "shared" / "data" / "sick"
SIMULATED = ("tilt", "scan", "wheels", "gps")
STEP = 0.02  # between two looks [s]


@dataclass(kw_only=True)
class Subject:
    """A source under test, whose time passes when it is told to."""

    source: Source[Any]
    rate_hz: float
    now_ns: Callable[[], int]
    run: Callable[[float], object]
    die: Callable[[], object]
    start: Callable[[], object]

    def run_until(self, condition: Callable[[], bool], *, within: float) -> float:
        """Let time pass in small steps; return how much of it did [s]."""
        start_ns = self.now_ns()
        while not condition():
            passed = (self.now_ns() - start_ns) * 1e-9
            assert passed < within, self.source.health()
            self.run(STEP)
        return (self.now_ns() - start_ns) * 1e-9


def stepped(source: Streaming[Any] | CameraSource, clock: ManualClock) -> Callable[[float], None]:
    """What lets time pass for a source that has a thread in real life."""

    def run(seconds: float) -> None:
        end_ns = clock.now_ns() + round(seconds * 1e9)
        while clock.now_ns() < end_ns:
            # A step that did nothing and wants no pause must not stop the test's time.
            clock.advance(source.step() or 1e-6)

    return run


def device(name: str, _folder: Path) -> Subject:
    """A driver with its emulated device."""
    kind, clock = KINDS[name], ManualClock()
    link = DirectLink(kind.emulator(), clock=clock, wait=clock.advance)
    source: Streaming[Any] = Streaming(
        link, kind.driver(), clock=clock, rate_hz=kind.rate_hz, role="sensor"
    )
    return Subject(
        source=source,
        rate_hz=kind.rate_hz,
        now_ns=clock.now_ns,
        run=stepped(source, clock),
        die=lambda: setattr(link, "plugged", False),
        start=lambda: None,
    )


class Recorder(Faulty):
    """Keeps what the device sends."""

    def __init__(self, name: str) -> None:
        super().__init__(KINDS[name].emulator(), lambda _: True)
        self.sent = b""

    def spoil(self, data: bytes) -> bytes:
        self.sent += data
        return data


def recorded(name: str, folder: Path) -> Subject:
    """A file with what that device sent in four seconds of streaming."""
    kind, clock, recorder = KINDS[name], ManualClock(), Recorder(name)
    link = DirectLink(recorder, clock=clock, wait=clock.advance)
    live: Streaming[Any] = Streaming(
        link, kind.driver(), clock=clock, rate_hz=kind.rate_hz, role="live"
    )
    run = stepped(live, clock)
    while live.health().values < 2:
        run(STEP)
    # What is answered once, at the beginning, tells what the scans mean.
    greeting, recorder.sent, before = recorder.sent, b"", live.health().values
    run(4.0)
    rate_hz = (live.health().values - before) / 4.0
    path = folder / f"{name}.bin"
    path.write_bytes(greeting + recorder.sent)
    subject = played(path, Overheard(kind.driver()), len(recorder.sent) / 4.0, rate_hz)
    subject.run_until(lambda: subject.source.health().values > 0, within=20.0)
    return subject


def played(path: Path, driver: Overheard[Any, Any], pace: float, rate_hz: float) -> Subject:
    """The bytes of a file at so many a second."""
    clock = ManualClock()
    link = FileLink(path, clock=clock, bytes_per_second=pace, wait=clock.advance)
    source: Streaming[Any] = Streaming(link, driver, clock=clock, rate_hz=rate_hz, role="recorded")
    run = stepped(source, clock)
    return Subject(
        source=source,
        rate_hz=rate_hz,
        now_ns=clock.now_ns,
        run=run,
        die=lambda: run(20.0),  # its end
        start=lambda: None,
    )


def capture(_folder: Path) -> Subject:
    """Sixteen telegrams of a real TiM scanner."""
    path = CAPTURE / "tim781s_colab_16scans.bin"
    if not path.exists():
        pytest.skip("the recorded stream of a scanner is not here")
    return played(path, Overheard(Cola()), 3374 * 5.0, 5.0)  # slowly: it has sixteen scans


def replay(source: Replay[Any], clock: ManualClock, rate_hz: float, seconds: float) -> Subject:
    return Subject(
        source=source,
        rate_hz=rate_hz,
        now_ns=clock.now_ns,
        run=clock.advance,
        die=lambda: clock.advance(seconds),  # its end
        start=source.start,
    )


def values(_folder: Path) -> Subject:
    """Values that were kept with their times."""
    clock = ManualClock()
    kept = [(0.1 * n, n) for n in range(40)]
    return replay(Replay(kept, clock=clock, rate_hz=10.0, name="log"), clock, 10.0, 5.0)


def carmen(folder: Path) -> Subject:
    """A log of scans."""
    path, clock = folder / "short.clf", ManualClock()
    scan = " ".join(["1.5"] * 181)
    path.write_text(
        "".join(
            f"FLASER 181 {scan} 0 0 0 0 0 0 {100 + 0.2 * n:.2f} robot {100 + 0.2 * n:.2f}\n"
            for n in range(30)
        )
    )
    return replay(open_carmen(path, clock=clock), clock, 5.0, 9.0)


def pictures(folder: Path) -> Subject:
    """A folder of pictures, played as a camera."""
    for n in range(60):
        cv2.imwrite(str(folder / f"{n:03d}.png"), np.full((8, 8), n, dtype=np.uint8))
    clock = ManualClock()
    files = FileCapture(
        lambda: open_frames(folder, single=True),
        name="folder",
        clock=clock,
        rate_hz=15.0,
        wait=clock.advance,
    )
    source = CameraSource(files, clock=clock, rate_hz=15.0, role="camera")
    run = stepped(source, clock)
    return Subject(
        source=source,
        rate_hz=15.0,
        now_ns=clock.now_ns,
        run=run,
        die=lambda: run(5.0),  # its end
        start=lambda: None,
    )


def simulated(name: str, _folder: Path) -> Subject:
    """A sensor of a robot that drives through a simulated world."""
    robot = Simulation(scenes.floor(), scenes.paper_rig(width=160, height=120))
    models = Sensors()
    rate_hz = {
        "tilt": models.tilt.rate_hz,
        "scan": models.ladar.rate_hz,
        "wheels": models.wheels.rate_hz,
        "gps": models.gps.rate_hz,
    }[name]
    source: SimulatedSource[Any] = SimulatedSource(getattr(robot, name), rate_hz=rate_hz, role=name)
    return Subject(
        source=source,
        rate_hz=rate_hz,
        now_ns=lambda: robot.stamp_ns,
        run=lambda seconds: robot.step(seconds, 0.3, 0.1),
        die=lambda: setattr(source, "plugged", False),
        start=source.start,
    )


SUBJECTS: dict[str, Callable[[Path], Subject]] = {
    **{f"device-{name}": partial(device, name) for name in KINDS},
    **{f"file-{name}": partial(recorded, name) for name in KINDS},
    **{f"simulated-{name}": partial(simulated, name) for name in SIMULATED},
    "file-real-scanner": capture,
    "recording-values": values,
    "recording-carmen": carmen,
    "pictures": pictures,
}


@pytest.fixture(params=list(SUBJECTS.values()), ids=list(SUBJECTS))
def running(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Subject]:
    """A source that delivers."""
    subject: Subject = request.param(tmp_path)
    subject.start()
    subject.run_until(lambda: subject.source.health().good, within=20.0)
    yield subject
    subject.source.close()


@pytest.mark.parametrize("name", [name for name in SUBJECTS if not name.startswith("file-")])
def test_before_it_is_started_a_source_has_no_value_and_says_that_it_is_closed(
    name: str, tmp_path: Path
) -> None:
    source = SUBJECTS[name](tmp_path).source
    assert source.latest() is None
    assert source.health().problem == f"{source.name}: closed"
    assert not source.health().connected
    source.close()


def test_values_come_at_the_rate_the_source_has(running: Subject) -> None:
    seconds = 8 / running.rate_hz
    before = running.source.health().values
    running.run(seconds)
    health = running.source.health()
    assert health.values - before == pytest.approx(8, abs=1)
    assert health.rate_hz == pytest.approx(running.rate_hz, rel=0.25)
    assert (health.errors, health.drops, health.last_error) == (0, 0, "")
    assert health.connected


def test_asking_takes_no_time_and_gives_the_same_again(running: Subject) -> None:
    before_ns = running.now_ns()
    first, second = running.source.latest(), running.source.latest()
    assert running.now_ns() == before_ns
    assert first is not None
    assert second is not None
    assert first.value is second.value
    assert (first.stamp_ns, first.count, first.age) == (second.stamp_ns, second.count, second.age)
    assert first.age == pytest.approx((before_ns - first.stamp_ns) * 1e-9)


def test_stamps_and_numbers_ascend_and_no_stamp_is_later_than_now(running: Subject) -> None:
    seen: dict[int, int] = {}
    for _ in range(round(8 / running.rate_hz / STEP)):
        running.run(STEP)
        reading = running.source.latest()
        assert reading is not None
        assert reading.age >= 0
        assert seen.setdefault(reading.count, reading.stamp_ns) == reading.stamp_ns
    assert len(seen) >= 6
    assert list(seen) == sorted(seen)
    assert all(later > before for before, later in itertools.pairwise(seen.values()))


def test_while_it_delivers_it_is_well_and_its_values_are_fresh(running: Subject) -> None:
    for _ in range(round(6 / running.rate_hz / STEP)):
        running.run(STEP)
        reading = running.source.latest()
        assert reading is not None
        assert (running.source.health().problem, reading.fresh) == ("", True)


def test_once_it_is_dead_it_says_so_and_its_last_value_grows_old(running: Subject) -> None:
    running.die()
    limit = silence_limit(running.rate_hz)
    running.run_until(lambda: not running.source.health().good, within=limit + 2 * STEP)
    assert running.source.health().problem.startswith(f"{running.source.name}: ")
    running.run(limit + STEP)
    last = running.source.latest()
    assert last is not None
    assert not last.fresh
    running.run(1.0)
    later = running.source.latest()
    assert later is not None
    assert (later.value is last.value, later.count, later.stamp_ns, later.fresh) == (
        True,
        last.count,
        last.stamp_ns,
        False,
    )
    assert later.age == pytest.approx(last.age + 1.0, abs=0.06)


def test_closing_twice_is_well_and_the_last_value_grows_old(running: Subject) -> None:
    running.source.close()
    running.source.close()
    health = running.source.health()
    assert health.problem == f"{running.source.name}: closed"
    assert not health.connected
    count = health.values
    if not isinstance(running.source, Streaming | CameraSource):  # these two lie with their thread
        running.run(2.0)
        reading = running.source.latest()
        assert reading is not None
        assert (reading.fresh, reading.count) == (False, count)


def test_a_replay_gives_each_value_its_time_and_says_when_it_is_over() -> None:
    clock = ManualClock(5_000)
    values = [(0.1, "a"), (0.2, "b"), (0.3, "c")]
    with Replay(values, clock=clock, rate_hz=10.0, name="log") as source:
        assert source.latest() is None
        assert source.health().problem == "log: no value yet"
        clock.advance(0.25)
        reading = source.latest()
        assert reading is not None
        assert (reading.value, reading.count, reading.stamp_ns) == ("b", 2, 200_005_000)
        assert reading.age == pytest.approx(0.05)
        assert source.health().good
        assert source.health().rate_hz == pytest.approx(10.0)
        clock.advance(1.0)
        late = source.latest()
        assert late is not None
        assert (late.value, late.fresh) == ("c", False)
        assert source.health().problem == "log: the recording is at its end"
    source.close()
    assert source.health().problem == "log: closed"
