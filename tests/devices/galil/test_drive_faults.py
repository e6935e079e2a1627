"""The drive when something fails: every fault of the emulator, and its own thread to the end."""

import contextlib
import gc
import logging
import threading
from collections.abc import Callable
from typing import Any

import pytest

from bearcub.clock import MonotonicClock
from bearcub.devices.galil import GalilDrive, GalilSetup
from bearcub.devices.link import TcpLink
from bearcub.emulators import FAULTS, Emulator, TcpHost
from bearcub.emulators.drive_kinds import EMULATED_WHEELS
from bearcub.emulators.faults import Rewritten, Unheard, between
from bearcub.emulators.galil import GalilEmulator


def refusing(emulator: Emulator, on: Callable[[int], bool]) -> Emulator:
    return Unheard(emulator, on, answer=b"?")


@pytest.mark.parametrize("fault", [*sorted(set(FAULTS) - {"wrong-baud"}), "refusing"])
def test_after_every_fault_the_drive_is_back_within_two_seconds(
    on_bench: Any, fault: str, caplog: pytest.LogCaptureFixture
) -> None:
    wrap = {**FAULTS, "refusing": refusing}[fault]
    on = between(2_100_000_000, 4_000_000_000)
    bench = on_bench(line=lambda emulator: wrap(emulator, on))
    bench.run(2.0, (0.4, 0.0))
    before = bench.drive.feedback()
    assert before is not None
    caplog.clear()
    while bench.clock.now_ns() < 4_000_000_000:
        bench.run(0.02, (0.4, 0.0))
        reading = bench.drive.feedback()
        assert reading is not None
        assert not reading.fresh or reading.age <= 0.2
    warnings = [r for r in caplog.records if r.levelno >= logging.WARNING]
    if fault in ("stuck", "half", "reset", "refusing"):
        assert warnings
        assert all("\n" not in r.getMessage() for r in warnings)
    bench.run(2.0, (0.4, 0.0))
    after = bench.drive.feedback()
    assert after is not None
    assert after.fresh
    assert bench.drive.health().good
    assert after.value.speed == pytest.approx(0.4, abs=0.05)  # TV averages over 0.25 s
    # What rolled while nobody could look is not made up.
    rolled = bench.controller.axes["A"].actual / 10000
    assert after.value.left <= rolled + 0.01


def test_a_controller_that_is_unplugged_is_named_at_once_and_is_back_within_two_seconds(
    on_bench: Any, caplog: pytest.LogCaptureFixture
) -> None:
    bench = on_bench()
    bench.run(1.0, (0.2, 0.0))
    caplog.set_level(logging.INFO)
    bench.table.pull_the_plug()
    bench.run(0.5, (0.2, 0.0))
    health = bench.drive.health()
    assert health.problem.startswith("drive (emulator:23): ")
    assert not health.connected
    reading = bench.drive.feedback()
    assert reading is not None
    assert not reading.fresh
    bench.run(10.0)
    assert bench.drive.health().problem.endswith("no connection: connection refused")
    bench.table.plugged = True
    bench.run(2.0)
    assert bench.drive.health().good
    assert [record.levelname for record in caplog.records] == ["WARNING", "INFO"]
    assert caplog.messages[-1] == "drive (emulator:23): streaming"


def test_a_controller_that_falls_silent_has_one_line_in_the_log(
    on_bench: Any, caplog: pytest.LogCaptureFixture
) -> None:
    stuck = False
    bench = on_bench(line=lambda emulator: FAULTS["stuck"](emulator, lambda _: stuck))
    bench.run(1.0)
    caplog.set_level(logging.INFO)
    stuck = True
    bench.run(0.27)
    assert "expected 20 a second: nothing comes; check its power" in bench.drive.health().problem
    bench.run(2.0)
    (line,) = caplog.messages
    assert line.startswith("drive (emulator:23): no value for 0.2")
    stuck = False
    bench.run(1.0)
    assert caplog.messages[1:] == ["drive (emulator:23): streaming"]


def test_states_that_make_no_sense_are_refused_and_the_controller_is_begun_with_anew(
    on_bench: Any,
) -> None:
    spoilt = False

    def spoil(data: bytes) -> bytes:  # the record's own size, in its header
        return data.replace(b"\x87\x0f\xe2", b"\x87\x0f\xe1") if spoilt else data

    bench = on_bench(line=lambda emulator: Rewritten(emulator, lambda _: True, rewrite=spoil))
    bench.run(1.0)
    spoilt = True
    bench.run(0.5)
    assert "refused" in bench.drive.health().problem
    bench.run(1.5)
    assert bench.drive.health().errors > 2
    assert len(bench.table.wires) == 2
    spoilt = False
    bench.run(2.0)
    assert bench.drive.health().good


def test_before_the_first_connection_there_is_no_feedback_and_after_closing_it_grows_old(
    on_bench: Any,
) -> None:
    bench = on_bench()
    assert bench.drive.feedback() is None
    assert bench.drive.health().problem == "drive (emulator:23): closed"
    bench.run(1.0)
    assert bench.drive.health().rate_hz == pytest.approx(20.0, rel=0.1)
    bench.close()
    assert bench.drive.health().problem == "drive (emulator:23): closed"
    bench.clock.advance(1.0)
    reading = bench.drive.feedback()
    assert reading is not None
    assert (reading.fresh, round(reading.age)) == (False, 1)


def on_its_thread(port: int) -> GalilDrive:
    """A drive on a real line, as on a robot."""
    return GalilDrive(
        TcpLink("127.0.0.1", port), GalilSetup(wheels=EMULATED_WHEELS), clock=MonotonicClock()
    )


def wait(until: Callable[[], bool]) -> None:
    """Wait up to 5 s for something to become true."""
    tick = threading.Event()
    assert any(until() or tick.wait(0.005) for _ in range(1000))


@pytest.mark.parametrize("interrupt", [False, True])
def test_on_its_own_thread_it_drives_and_its_end_stops_the_wheels_and_leaves_nothing_behind(
    *, interrupt: bool
) -> None:
    controller = GalilEmulator()

    def work(drive: GalilDrive) -> None:
        def moves() -> bool:
            drive.command(0.5, 0.0)
            reading = drive.feedback()
            return reading is not None and reading.value.speed > 0.05

        wait(moves)
        if interrupt:
            raise KeyboardInterrupt

    with TcpHost(controller, clock=MonotonicClock()) as host:
        threads = threading.active_count()
        drive = on_its_thread(host.port)
        with contextlib.suppress(KeyboardInterrupt), drive:
            drive.start()  # a second time does nothing
            work(drive)
        # Acknowledged, not only sent: the watchdog has nothing to do with it.
        assert all(a.stopping or not a.moving for a in controller.axes.values())
        drive.close()
        drive.start()  # does nothing any more
        gc.collect()
        assert threading.active_count() == threads
    assert drive.health().problem == f"{drive.name}: closed"


def test_it_may_be_closed_at_any_time() -> None:
    with TcpHost(GalilEmulator(), clock=MonotonicClock()) as host:
        for milliseconds in (0, 1, 3, 10, 30, 100):
            with on_its_thread(host.port):
                threading.Event().wait(milliseconds / 1e3)
    with on_its_thread(host.port) as drive:  # nobody listens there any more
        wait(lambda: "connection refused" in drive.health().problem)
    drive = on_its_thread(host.port)
    drive.close()
    drive.start()
    assert drive.health().problem == f"{drive.name}: closed"
    gc.collect()


def test_an_error_of_the_program_is_told_by_the_health(monkeypatch: pytest.MonkeyPatch) -> None:
    raised: list[threading.ExceptHookArgs] = []
    monkeypatch.setattr(threading, "excepthook", raised.append)
    with (
        TcpHost(GalilEmulator(), clock=MonotonicClock()) as host,
        on_its_thread(host.port) as drive,
    ):
        monkeypatch.setattr(drive._driver, "value", lambda _: 1 / 0)
        wait(lambda: bool(raised))
        wait(lambda: "failed by an error of this program" in drive.health().problem)
    gc.collect()
