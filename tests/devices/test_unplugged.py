"""All devices at once, on real lines: each in turn is unplugged, the others do not notice."""

import contextlib
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from bearcub.clock import MonotonicClock
from bearcub.devices.link import SerialLink, TcpLink
from bearcub.devices.stream import Streaming
from bearcub.emulators import PtyHost, TcpHost
from bearcub.emulators.kind import Kind
from bearcub.emulators.kinds import KINDS

CLOCK = MonotonicClock()
NAMED_WITHIN = 0.5  # seconds


def wait(until: Callable[[], bool], seconds: float) -> float:
    """Wait for something to become true; return how long that took [s]."""
    start_ns, tick = CLOCK.now_ns(), threading.Event()
    while not until() and (CLOCK.now_ns() - start_ns) * 1e-9 < seconds:
        tick.wait(0.002)
    return (CLOCK.now_ns() - start_ns) * 1e-9


def plugged_in(
    kind: Kind, path: Path, stack: contextlib.ExitStack
) -> tuple[PtyHost | TcpHost, Streaming[Any]]:
    host: PtyHost | TcpHost
    if kind.tcp_port is None:
        host = PtyHost(kind.emulator(), clock=CLOCK, link=path)
        link: SerialLink | TcpLink = SerialLink(str(path), baud=host.baud or 9600)
    else:
        host = TcpHost(kind.emulator(), clock=CLOCK)
        link = TcpLink("127.0.0.1", host.port)
    stack.enter_context(host)
    source: Streaming[Any] = Streaming(
        link, kind.driver(), clock=CLOCK, rate_hz=kind.rate_hz, role="sensor"
    )
    return host, stack.enter_context(source)


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[dict[str, tuple[PtyHost | TcpHost, Streaming[Any]]]]:
    """Every device there is, delivering."""
    with contextlib.ExitStack() as stack:
        found = {name: plugged_in(kind, tmp_path / name, stack) for name, kind in KINDS.items()}
        wait(lambda: all(source.health().values > 1 for _, source in found.values()), 20.0)
        yield found


def test_each_device_that_is_unplugged_is_named_and_the_others_do_not_miss_a_beat(
    robot: dict[str, tuple[PtyHost | TcpHost, Streaming[Any]]],
) -> None:
    left = {name: source for name, (_, source) in robot.items()}
    assert {
        name: source.health().problem for name, source in left.items() if not source.latest()
    } == {}
    errors = {name: source.health().errors for name, source in left.items()}
    for name, (host, source) in robot.items():
        host.close()
        del left[name]
        assert wait(lambda: not source.health().good, 5.0) < NAMED_WITHIN  # noqa: B023
        assert source.health().problem.startswith(f"{source.name}: ")
        values = {other: left[other].health().values for other in left}
        wait(lambda: all(left[other].health().values > values[other] for other in left), 5.0)  # noqa: B023
        assert [other for other in left if left[other].health().values <= values[other]] == []
        assert [other for other in left if left[other].health().errors > errors[other]] == []
