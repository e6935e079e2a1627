"""An emulated SICK TiM or LMS1xx on TCP, in both dialects of CoLa."""

from collections.abc import Callable, Sequence

import numpy as np

from bearcub.devices.sick.cola import Dialect, Message, encode, fields_of, parser
from bearcub.devices.sick.cola_fields import Field, Fields
from bearcub.devices.sick.cola_scan import NAME
from bearcub.devices.sick.cola_setup import ANSWERS, Access, Sweep
from bearcub.emulators.emulator import Emulator, Ticker
from bearcub.emulators.faults import Fault, Faulty, Switch, Unheard
from bearcub.emulators.room import Beams, room
from bearcub.errors import BearcubError

TIM = Sweep(start_deg=-135, stop_deg=135, step_deg=1 / 3)
LMS1XX = Sweep(start_deg=-135, stop_deg=135, step_deg=0.25, scan_hz=25.0)

_FINEST_DEG = 0.1
_DELAY_US = 6000  # from the last beam to sending
_NO_ECHO, _NEAREST, _FARTHEST = 0, 16, 0xFFFF  # raw values [mm]
_READY, _MEASURING = (6, 7)  # STlms
_NOT_SO, _DENIED, _UNKNOWN, _BUSY = 0x05, 0x0A, 0x03, 0x0D
_GRID = {15.0: (3333,), 25.0: (2500, 5000), 50.0: (2500, 5000)}  # scan_hz: steps [1/10000 deg]


class _Refused(Exception):  # noqa: N818 (not an error of the program, but the scanner's answer)
    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


class ColaEmulator:
    """The scanner as a pure object; it hears only the dialect that it is set to.

    Parameters
    ----------
    beams : callable, optional
        ``beams(now_ns, angles)`` gives the ranges [m] that it measures, REP-117; by default a room.
    sweep : Sweep, optional
        What it is set to scan; by default as a TiM, 811 beams at 15 Hz.
    dialect : Dialect, optional
        That it is set to.
    fixed_dialect : bool, optional
        Whether it keeps that, as some ports do.
    spin_up : float, optional
        How long it takes to measure after it is started [s].

    Attributes
    ----------
    access : Access or None
        Who is logged in.
    """

    baud = None

    def __init__(
        self,
        beams: Beams = room,
        *,
        sweep: Sweep = TIM,
        dialect: Dialect = Dialect.B,
        fixed_dialect: bool = False,
        spin_up: float = 0.0,
    ) -> None:
        self._beams = beams
        self._sweep = sweep
        self._scan_hz = sweep.scan_hz or 15.0
        self._dialect = self._next_dialect = dialect
        self._fixed_dialect = fixed_dialect
        self._spin_up_ns = round(spin_up * 1e9)
        self._measuring_from_ns: int | None = 0
        self._remission = True
        self._counter = 0
        self._now_ns = 0
        self._ticker = Ticker(self._scan_hz)
        self._parser = parser()
        self._answers: dict[tuple[str, str], Callable[[Fields], Sequence[Field]]] = {
            ("sMN", "SetAccessMode"): self._log_in,
            ("sMN", "Run"): self._run,
            ("sMN", "LMCstartmeas"): self._start,
            ("sMN", "LMCstopmeas"): self._stop,
            ("sMN", "mLMPsetscancfg"): self._set_scan,
            ("sWN", "EIHstCola"): self._set_dialect,
            ("sWN", "LMPoutputRange"): self._set_range,
            ("sWN", "LMDscandatacfg"): self._set_content,
            ("sWN", "FREchoFilter"): self._set_echo,
            ("sEN", NAME): self._subscribe,
            ("sRN", "DeviceIdent"): lambda _: (("text", "TiM781S"), ("text", "V2.80")),
            ("sRN", "SCdevicestate"): lambda _: (("u8", 1),),
            ("sRN", "STlms"): self._state,
            ("sRN", "LMPscancfg"): lambda _: (
                ("u32", round(self._scan_hz * 100)),
                ("u16", 1),
                *self._sweep.fields,
            ),
            ("sRN", "LMPoutputRange"): lambda _: (("u16", 1), *self._sweep.fields),
            ("sRN", NAME): lambda _: self._scan_fields(),
        }
        self.connect()

    def connect(self) -> None:
        """Forget what belongs to a connection: the login, the stream, half a telegram."""
        self.access: Access | None = None
        self._subscribed = False
        self._pending = b""
        self._dialect = self._next_dialect
        self._parser.reset()

    def receive(self, data: bytes) -> None:
        """Take what the host sends; answers come from `poll`."""
        for message in self._parser.feed(data):
            if message.dialect is self._dialect:
                self._answer(message)

    def poll(self, now_ns: int) -> bytes:
        """Return the answers, and a scan when its time has come."""
        self._now_ns = now_ns
        said, self._pending = self._pending, b""
        due = self._ticker.due(now_ns)
        if due and self._subscribed and self._measuring:
            said += encode("sSN", NAME, *self._scan_fields(), dialect=self._dialect)
        return said

    @property
    def _measuring(self) -> bool:
        return self._measuring_from_ns is not None and self._now_ns >= self._measuring_from_ns

    def _answer(self, message: Message) -> None:
        answer = self._answers.get((message.kind, message.name), _not_known)
        try:
            fields = answer(fields_of(message))
        except (BearcubError, _Refused) as error:
            code = error.code if isinstance(error, _Refused) else _NOT_SO
            self._pending += encode("sFA", "", ("u8", code), dialect=self._dialect)
            return
        kind = ANSWERS[message.kind]
        self._pending += encode(kind, message.name, *fields, dialect=self._dialect)

    def _require_login(self) -> None:
        if self.access is None:
            raise _Refused(_DENIED)

    def _log_in(self, fields: Fields) -> Sequence[Field]:
        given = fields.number("u8", "level"), fields.number("u32", "password")
        self.access = next((access for access in Access if access.value == given), None)
        return (("u8", int(self.access is not None)),)

    def _run(self, _: Fields) -> Sequence[Field]:
        self.access = None
        return (("u8", 1),)

    def _start(self, _: Fields) -> Sequence[Field]:
        self._require_login()
        if self._measuring_from_ns is None:
            self._measuring_from_ns = self._now_ns + self._spin_up_ns
        return (("u8", 0),)

    def _stop(self, _: Fields) -> Sequence[Field]:
        self._require_login()
        self._measuring_from_ns = None
        return (("u8", 0),)

    def _state(self, _: Fields) -> Sequence[Field]:
        return (("u16", _MEASURING if self._measuring else _READY), ("u8", 0))

    def _set_dialect(self, fields: Fields) -> Sequence[Field]:
        self._require_login()
        wanted = Dialect.B if fields.number("u8", "dialect") else Dialect.A
        if not self._fixed_dialect:
            self._next_dialect = wanted
        return ()

    def _set_scan(self, fields: Fields) -> Sequence[Field]:
        self._require_login()
        scan_hz = fields.number("u32", "frequency") / 100
        fields.number("u16", "sectors")
        step = fields.number("u32", "step")
        known = step in _GRID.get(scan_hz, ())
        if known:
            self._scan_hz, self._ticker = scan_hz, Ticker(scan_hz)
            self._sweep = Sweep(start_deg=-135, stop_deg=135, step_deg=step / 10_000)
        return (("u8", 0 if known else 1), ("u32", round(self._scan_hz * 100)))

    def _set_range(self, fields: Fields) -> Sequence[Field]:
        self._require_login()
        fields.number("u16", "sectors")
        step = fields.number("u32", "step") / 10_000
        start, stop = (fields.number("i32", "an angle") / 10_000 - 90 for _ in range(2))
        if not -135 <= start < stop <= 135 or step < _FINEST_DEG:
            raise _Refused(_NOT_SO)
        self._sweep = Sweep(start_deg=start, stop_deg=stop, step_deg=step)
        return ()

    def _set_content(self, fields: Fields) -> Sequence[Field]:
        self._require_login()
        for what in ("low byte of the mask", "high byte"):
            fields.number("u8", what)
        self._remission = fields.number("u8", "remission") == 1
        return ()

    def _set_echo(self, fields: Fields) -> Sequence[Field]:
        self._require_login()
        fields.number("u8", "echo")
        return ()

    def _subscribe(self, fields: Fields) -> Sequence[Field]:
        self._subscribed = fields.number("u8", "whether to send") == 1
        return (("u8", int(self._subscribed)),)

    def _scan_fields(self) -> list[Field]:
        self._counter = (self._counter + 1) % 0x10000
        sent_us = self._now_ns // 1000
        numbers: list[Field] = [
            *(("u16", 1), ("u16", 1), ("u32", 18480390), ("u8", 0), ("u8", 0)),
            *(("u16", self._counter), ("u16", self._counter)),
            *(("u32", (sent_us - _DELAY_US) % 2**32), ("u32", sent_us % 2**32)),
            *(("u8", 0), ("u8", 0), ("u8", 0), ("u8", 0), ("u16", 0)),
            *(("u32", round(self._scan_hz * 100)), ("u32", 162), ("u16", 0)),
        ]
        channels = [self._channel("DIST1", self._distances())]
        if self._remission:
            channels.append(self._channel("RSSI1", [1000] * self._count))
        numbers.append(("u16", len(channels)))
        for channel in channels:
            numbers += channel
        flags: list[Field] = [("u16", 0)] * 6  # no channel of 8 bits, none of the blocks at the end
        return numbers + flags

    @property
    def _count(self) -> int:
        return round((self._sweep.stop_deg - self._sweep.start_deg) / self._sweep.step_deg) + 1

    def _channel(self, content: str, values: Sequence[int]) -> list[Field]:
        step, start, _ = self._sweep.fields
        return [
            *(("chars", content), ("f32", 1.0), ("f32", 0.0)),
            *(start, ("u16", step[1]), ("u16", len(values)), ("u16[]", values)),
        ]

    def _distances(self) -> Sequence[int]:
        """Return the raw distances; nothing in reach is a code, all that is too near 16 mm."""
        angles = np.deg2rad(np.linspace(self._sweep.start_deg, self._sweep.stop_deg, self._count))
        ranges = np.asarray(self._beams(self._now_ns - _DELAY_US * 1000, angles), np.float64)
        seen = np.nan_to_num(ranges * 1e3, nan=_FARTHEST + 1, posinf=_FARTHEST + 1, neginf=0)
        raw = np.maximum(np.rint(seen), _NEAREST).astype(np.int64)
        raw[raw > _FARTHEST] = _NO_ECHO
        return list(map(int, raw))


def _not_known(_: Fields) -> Sequence[Field]:
    raise _Refused(_UNKNOWN)


def _busy(emulator: Emulator, on: Switch) -> Faulty:
    return Unheard(emulator, on, answer=encode("sFA", "", ("u8", _BUSY), dialect=Dialect.B))


COLA_FAULTS: dict[str, Fault] = {"refused": _busy}
"""The faults that only a scanner with CoLa has: it refuses every command."""
