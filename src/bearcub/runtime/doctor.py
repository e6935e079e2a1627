"""Looks at every device of a robot in turn: does it deliver, does it make sense, what to do."""

import math
import os
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from bearcub.clock import Clock
from bearcub.config import Config
from bearcub.devices.cameras import CameraSource
from bearcub.devices.health import Health
from bearcub.devices.protocols import Frame, Reading
from bearcub.pipeline import Pipeline
from bearcub.runtime.bench import FRAME_BUDGET_MS, cases, measure
from bearcub.runtime.describe import describe, describe_skew
from bearcub.runtime.devices import Device
from bearcub.runtime.signs import Trial, judge, trials_of, unmoved
from bearcub.runtime.stereo_check import check_pair
from bearcub.runtime.verdict import Grade, Remark
from bearcub.stereo.native import levels

_STEP = 0.02  # between two looks [s]
_OLD = 0.15  # a value that is older on arrival makes the robot late [s]
_VERBS = (
    *("allow ", "check ", "choose ", "clear ", "connect ", "expected ", "leave ", "lower "),
    *("raise ", "run: ", "see: ", "set ", "switch ", "wait "),
)
_ADVICE = (
    (("permission denied",), "run: sudo usermod -aG dialout,video $USER, then log in again"),
    (("resource temporarily unavailable", "busy"), "end the other program that uses it"),
    (("no such file", "cannot be opened"), "check that it is plugged in: bearcub devices"),
    (
        ("connection refused", "no connection", "timed out"),
        "check its power, its network cable and the address in its table",
    ),
    (("telegrams refused",), "check baud, cable and shield, and that it is a {kind}"),
    (("values refused",), "see what it is set to, and its manual"),
    (("bytes came",), "check baud, and that it is a {kind}"),
    (("refuses", "rejects", "refused"), "switch it off and on; is it a {kind}?"),
    (("recording is at its end",), "give a longer one, or look at it for less (--seconds)"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Checkup:
    """What was found out about one device.

    Attributes
    ----------
    name : str
        With its line, as in messages.
    kind : str
    health : Health
        At the end of the look.
    age : float
        Median age of the values when they were looked at [s]; NaN without any.
    remarks : tuple of Remark
        Sample values, and what is wrong with what to do.
    """

    name: str
    kind: str
    health: Health
    age: float
    remarks: tuple[Remark, ...] = field(default_factory=tuple)

    @property
    def grade(self) -> Grade:
        """The worst of the remarks."""
        return max((remark.grade for remark in self.remarks), default=Grade.GOOD)


@dataclass(frozen=True, slots=True, kw_only=True)
class Patience:
    """How long the doctor takes.

    Attributes
    ----------
    first : float
        For the first value [s]; a LADAR whose speed has to be found takes some.
    look : float
        For the look at the values [s].
    signs : float
        For a person to move the robot [s].
    """

    first: float = 10.0
    look: float = 2.0
    signs: float = 15.0


class Doctor:
    """Examines devices one after another.

    Parameters
    ----------
    clock : Clock
    patience : Patience, optional
    wait : callable, optional
        What passes the time, given in seconds.
    config : Config, optional
        For the check of a stereo camera.
    """

    def __init__(
        self,
        *,
        clock: Clock,
        patience: Patience | None = None,
        wait: Callable[[float], object] | None = None,
        config: Config | None = None,
    ) -> None:
        self._clock = clock
        self._patience = patience or Patience()
        self._wait = wait or threading.Event().wait
        self._config = config or Config()

    def examine(self, device: Device, *, ask: Callable[[str], None] | None = None) -> Checkup:
        """Start a device, look at it for a while, and close it again.

        Parameters
        ----------
        device : Device
        ask : callable, optional
            Asks a person to move the robot, for the signs of tilt sensors and wheels; without it
            they are not checked.
        """
        latest = _reader(device)
        with device.part:
            first = self._first(latest)
            readings = [] if first is None else list(self._look(latest))
            remarks = _introduction(device)
            if readings:
                remarks += self._describe(device, readings[-1])
                trials = () if ask is None else trials_of(readings[-1].value)
                remarks += [self._try(trial, latest, ask) for trial in trials if ask]
            health = device.part.health()
        ages = sorted(reading.age for reading in readings)
        age = ages[len(ages) // 2] if ages else math.nan
        remarks = [*_health_remarks(device, health, age), *remarks]
        return Checkup(
            name=health.name, kind=device.kind, health=health, age=age, remarks=tuple(remarks)
        )

    def _first(self, latest: "_Latest") -> "_AnyReading | None":
        until_ns = self._clock.now_ns() + round(self._patience.first * 1e9)
        while self._clock.now_ns() < until_ns:
            reading = latest()
            if reading is not None:
                return reading
            self._wait(_STEP)
        return None

    def _look(self, latest: "_Latest") -> "Iterator[_AnyReading]":
        """Yield every new reading, as soon as it is seen."""
        until_ns = self._clock.now_ns() + round(self._patience.look * 1e9)
        seen = 0
        while self._clock.now_ns() < until_ns:
            reading = latest()
            if reading is not None and reading.count != seen:
                seen = reading.count
                yield reading
            self._wait(_STEP)

    def _describe(self, device: Device, reading: "_AnyReading") -> list[Remark]:
        value = reading.value
        remarks = describe(value)
        if isinstance(value, Frame) and value.right is not None:
            if isinstance(device.part, CameraSource):
                remarks += describe_skew(device.part)
            if device.rig is not None:
                remarks += check_pair(value, device.rig, config=self._config)
        return remarks

    def _try(self, trial: Trial, latest: "_Latest", ask: Callable[[str], None]) -> Remark:
        """Ask for a motion and tell whether the reading followed it."""
        before = latest()
        ask(trial.request)
        until_ns = self._clock.now_ns() + round(self._patience.signs * 1e9)
        while before is not None and self._clock.now_ns() < until_ns:
            now = latest()
            if now is not None and now.fresh:
                change = trial.read(now.value) - trial.read(before.value)
                if abs(change) > trial.least:
                    return judge(trial, change)
            self._wait(_STEP)
        return unmoved(trial, self._patience.signs)


_AnyReading = Reading[object]
_Latest = Callable[[], "_AnyReading | None"]


def _reader(device: Device) -> _Latest:
    part = device.part
    return part.latest if hasattr(part, "latest") else part.feedback


def _introduction(device: Device) -> list[Remark]:
    """Return what the device itself says that it is, and what is wrong with it."""
    identity = getattr(device.part, "identity", "")  # most cannot tell
    complaints = getattr(device.part, "complaints", ())
    return [Remark(text) for text in (identity,) if text] + [
        Remark(text, grade=Grade.WARNING, advice="see its manual for the meaning")
        for text in complaints
    ]


def _health_remarks(device: Device, health: Health, age: float) -> list[Remark]:
    if health.problem:
        text, advice = _advised(health.problem.removeprefix(f"{health.name}: "))
        return [Remark(text, grade=Grade.FAULT, advice=advice or _advice(device, text))]
    remarks = []
    if age > _OLD:
        remarks.append(
            Remark(
                f"values are {age * 1e3:.0f} ms old",
                grade=Grade.WARNING,
                advice="raise its rate or its baud rate",
            )
        )
    if health.errors or health.resyncs > 1:
        remarks.append(
            Remark(
                f"{health.errors} values refused, {health.resyncs} times out of step; last: "
                f"{health.last_error or 'damaged telegrams'}",
                grade=Grade.WARNING,
                advice="check cable, shield and baud rate",
            )
        )
    if health.drops:
        remarks.append(
            Remark(
                f"{health.drops} values lost",
                grade=Grade.WARNING,
                advice="lower its rate or free the processor",
            )
        )
    return remarks


def _advised(problem: str) -> tuple[str, str]:
    """Return a problem and what it says itself that is to be done; empty where it does not."""
    text, _, advice = problem.rpartition("; ")
    return (text, advice) if text and advice.startswith(_VERBS) else (problem, "")


def _advice(device: Device, problem: str) -> str:
    """Return what is to be done about a problem that does not say so."""
    problem = problem.lower()
    for signs, advice in _ADVICE:
        if any(sign in problem for sign in signs):
            return advice.format(kind=device.kind)
    return "check its power and its cable"


def processor_remark(*, frames: int = 10) -> Remark:
    """Return how much of the processor one frame of the embedded sample takes.

    Parameters
    ----------
    frames : int
        That are measured, after a warm-up.
    """
    case = cases(size=(640, 480), config=Config(), pair=True)[-1]
    times = sorted(measure(Pipeline(case.rig), case.snapshot, frames=frames)["total"])
    took = times[len(times) // 2]
    cores, load = os.cpu_count() or 1, os.getloadavg()[0]
    text = (
        f"one 640 x 480 pair takes {took:.0f} ms of {FRAME_BUDGET_MS:.0f} ms on one core; "
        f"{cores} cores, load {load:.1f}"
    )
    if took > FRAME_BUDGET_MS:
        faster = "half_resolution = true" if levels() else "matcher = bm"
        advice = f"use smaller pictures (--scale), or {faster}"
        return Remark(text, grade=Grade.WARNING, advice=advice)
    if cores - load < 1:
        return Remark(text, grade=Grade.WARNING, advice="end other programs: no core is free")
    return Remark(text)
