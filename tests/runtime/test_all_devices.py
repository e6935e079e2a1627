"""A whole robot on ptys and TCP: the plug of each device in turn is pulled, the others go on."""

import contextlib
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bearcub.clock import MonotonicClock
from bearcub.devices.health import Health
from bearcub.emulators import PtyHost, TcpHost
from bearcub.emulators.kinds import KINDS
from bearcub.runtime.devices import Device, build_devices

NAMED_WITHIN = 0.5  # s
PULLED = ["cxtilt", "lms2xx", "cola", "gps", "galil"]
TABLES: dict[str, dict[str, Any]] = {
    "cxtilt": {},
    "lms2xx": {},
    "cola": {},
    "gps": {"rate_hz": 5},
    "galil": {"wheel_radius": 0.16, "track": 0.5, "counts": 10000},
}


@dataclass(frozen=True)
class Robot:
    hosts: dict[str, PtyHost | TcpHost]
    devices: dict[str, Device]

    def health(self) -> dict[str, Health]:
        return {name: device.part.health() for name, device in self.devices.items()}


def pause(seconds: float) -> None:
    threading.Event().wait(seconds)


@pytest.fixture
def load() -> Iterator[None]:
    """A loop that works for most of the time, as that of a robot does."""
    done = threading.Event()

    def work() -> None:
        picture = np.random.default_rng(0).random((480, 640), dtype=np.float32)
        while not done.wait(0.02):
            for _ in range(3):
                np.sort(picture, axis=1)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    yield
    done.set()
    thread.join()


@pytest.fixture
def robot() -> Iterator[Robot]:
    clock = MonotonicClock()
    with contextlib.ExitStack() as stack:
        hosts: dict[str, PtyHost | TcpHost] = {}
        tables = {}
        for name in PULLED:
            kind = KINDS[name]
            if kind.tcp_port is None:
                pty = stack.enter_context(PtyHost(kind.emulator(), clock=clock))
                hosts[name], where = pty, {"port": pty.path}
            else:
                tcp = stack.enter_context(TcpHost(kind.emulator(), clock=clock))
                hosts[name], where = tcp, {"address": f"127.0.0.1:{tcp.port}"}
            tables[name] = {"kind": name, **where, **TABLES[name]}
        devices = build_devices(tables, clock=clock, folder=Path())
        for device in devices:
            stack.enter_context(device.part)
        yield Robot(hosts, {device.name: device for device in devices})


@pytest.mark.usefixtures("load")
def test_the_others_do_not_miss_a_beat_when_a_plug_is_pulled(robot: Robot) -> None:
    clock = MonotonicClock()
    deadline_ns = clock.now_ns() + 20 * 10**9
    while clock.now_ns() < deadline_ns and not all(h.good for h in robot.health().values()):
        pause(0.05)
    pause(0.5)
    assert [h.problem for h in robot.health().values() if not h.good] == []
    for pulled in PULLED:
        before = robot.health()
        dead = [name for name in PULLED if not before[name].good]
        robot.hosts[pulled].close()
        pulled_ns = clock.now_ns()
        named = None
        while clock.now_ns() - pulled_ns < 0.7e9:
            now = robot.health()
            if named is None and not now[pulled].good:
                named = (clock.now_ns() - pulled_ns) * 1e-9
            others = [h for name, h in now.items() if name not in (pulled, *dead)]
            assert [h.problem for h in others if not h.good] == []
            pause(0.01)
        assert named is not None
        assert named < NAMED_WITHIN
        assert robot.health()[pulled].problem.startswith(f"{pulled} (")
        for name, health in robot.health().items():
            if name in (pulled, *dead):
                continue
            errors = health.errors - before[name].errors
            assert (health.drops, errors) == (before[name].drops, 0)
            assert health.values > before[name].values
