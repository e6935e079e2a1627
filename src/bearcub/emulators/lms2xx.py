"""An emulated SICK LMS2xx: its telegrams, its baud rates, and the time that its line takes."""

from collections.abc import Callable, Sequence

import numpy as np

from bearcub.devices.sick.lms2xx import Reply, Telegram, encode, parser
from bearcub.devices.sick.lms2xx_scan import (
    FIELDS_OF_VIEW_DEG,
    MEASURING_MODES,
    MIRROR_HZ,
    Lms2xxSetting,
)
from bearcub.devices.sick.lms2xx_setup import BAUDS, ENTER_INSTALLATION
from bearcub.emulators.emulator import Emulator, Serial, Ticker
from bearcub.emulators.faults import (
    Fault,
    Faulty,
    Interrupted,
    Restarted,
    Rewritten,
    Switch,
    Unheard,
)
from bearcub.emulators.room import Beams, room

_ACK, _NAK = b"\x06", b"\x15"
_OK = 0x10  # status byte
_INSTALLATION, _STREAM, _ON_REQUEST = 0x00, 0x24, 0x25
_MODES = {_STREAM, _ON_REQUEST}
_BAUD_MODES = {mode: baud for baud, mode in BAUDS.items()}
_BAUD_WORDS = {9600: 0x8067, 19200: 0x8033, 38400: 0x8019, 500000: 0x8001}
_UNITS = {0: 0.01, 1: 0.001, 2: 0.1}
_MODE_AT, _UNIT_AT = 5, 6
_BOOT_NS = 400_000_000  # real ones take longer; the host has to wait for it in any case


class Lms2xxEmulator(Serial):
    """The scanner as a pure object; a telegram is sent when its last byte would be through.

    Parameters
    ----------
    beams : callable, optional
        ``beams(now_ns, angles)`` gives the ranges [m] that it measures, REP-117; by default a room.
    model : str, optional
        What it calls itself.
    power_on_baud : int, optional
        Its speed after power-up [baud].
    measuring_mode, unit : int, optional
        As in bytes 5 and 6 of its configuration.
    address : int, optional
        In its replies; 0x80 or 0x81.
    errors : sequence of (int, int), optional
        Type and number of what is wrong with it.

    Attributes
    ----------
    baud : int
    mode : int
        Operating mode: 0x24 streams, 0x25 waits for requests.
    """

    def __init__(
        self,
        beams: Beams = room,
        *,
        model: str = "LMS200;30106x;V02.10",
        power_on_baud: int = 9600,
        measuring_mode: int = 0,
        unit: int = 1,
        address: int = 0x80,
        errors: Sequence[tuple[int, int]] = (),
    ) -> None:
        self._beams = beams
        self._model = model.encode("ascii")
        self._errors = errors
        self._power_on_baud = power_on_baud
        self._address = address
        self._config = bytearray(34)
        self._config[_MODE_AT], self._config[_UNIT_AT] = measuring_mode, unit
        self._variant = (180, 0.5)
        self._parser = parser(from_scanner=False)
        self._commands: dict[int, Callable[[bytes], Telegram | None]] = {
            0x10: self._reset,
            0x20: self._set_mode,
            0x30: self._one_scan,
            0x31: self._status,
            0x32: lambda _: Telegram(Reply.ERRORS, b"".join(map(bytes, self._errors))),
            0x3A: lambda _: Telegram(Reply.TYPE, self._model),
            0x3B: self._set_variant,
            0x74: lambda _: Telegram(Reply.CONFIG, bytes(self._config)),
            0x77: self._write_config,
        }
        self._start(power_on_baud)

    def _start(self, baud: int) -> None:
        self.baud: int | None = baud
        self.mode = _ON_REQUEST
        self._next_baud: int | None = None
        self._queue: list[bytes] = []
        self._line_free_ns: int | None = None
        self._now_ns = 0
        self._boot_ns: int | None = None
        self._ticker = Ticker(MIRROR_HZ / 2)
        self._parser.reset()

    def restart(self) -> None:
        """Switch it off and on: it forgets its speed and its mode, and says that it is there."""
        now_ns = self._now_ns
        self._start(self._power_on_baud)
        self._now_ns, self._boot_ns = now_ns, now_ns + _BOOT_NS

    def receive(self, data: bytes) -> None:
        """Take what the host sends; answers come from `poll`."""
        if self._boot_ns is not None:
            return
        self._apply_baud()
        wrong = self._parser.tally.errors
        messages = self._parser.feed(data)
        if self._parser.tally.errors > wrong:
            self._queue.append(_NAK)
        for message in messages:
            if isinstance(message, Telegram):
                self._answer(message)

    def poll(self, now_ns: int) -> bytes:
        """Return the telegrams whose last byte is through by now."""
        self._now_ns = now_ns
        self._apply_baud()
        if self._boot_ns is not None and not self._queue:
            if now_ns < self._boot_ns:
                return b""
            self._boot_ns = None
            self._send(Telegram(Reply.POWER_ON, self._model + b" "))
        due = self._ticker.due(now_ns)
        if self.mode == _STREAM and due and not self._queue:
            self._send(self._scan())
        return self._line(now_ns)

    def _line(self, now_ns: int) -> bytes:
        """Return what the line has let through."""
        through = b""
        while self._queue:
            first = self._queue[0]
            started_ns = now_ns if self._line_free_ns is None else self._line_free_ns
            end_ns = started_ns + round(len(first) * 10e9 / (self.baud or 9600))
            if end_ns > now_ns:
                self._line_free_ns = started_ns
                return through
            through += self._queue.pop(0)
            self._line_free_ns = end_ns
        self._line_free_ns = None
        return through

    def _apply_baud(self) -> None:
        """Change the speed once the reply that announces it is out."""
        if self._next_baud is not None and not self._queue:
            self.baud, self._next_baud = self._next_baud, None

    def _send(self, telegram: Telegram) -> None:
        self._queue.append(encode(telegram._replace(status=_OK, address=self._address)))

    def _answer(self, command: Telegram) -> None:
        self._queue.append(_ACK)
        known = self._commands.get(command.command)
        answer = known(command.data) if known else None
        self._send(answer or Telegram(Reply.REJECTED))

    def _reset(self, _: bytes) -> Telegram:
        self.mode, self._next_baud = _ON_REQUEST, self._power_on_baud
        self._boot_ns = self._now_ns + _BOOT_NS
        return Telegram(Reply.RESET)

    def _set_mode(self, data: bytes) -> Telegram | None:
        mode = data[0] if data else 0xFF
        if mode == _INSTALLATION:
            known = data == ENTER_INSTALLATION.data
            self.mode = _INSTALLATION if known else self.mode
            return Telegram(Reply.MODE, b"\x00" if known else b"\x01")
        if mode in _BAUD_MODES:
            self._next_baud = _BAUD_MODES[mode]
        elif mode in _MODES:
            self.mode = mode
        else:
            return None
        return Telegram(Reply.MODE, b"\x00")

    def _set_variant(self, data: bytes) -> Telegram | None:
        fov_deg = int.from_bytes(data[:2], "little")
        resolution_deg = int.from_bytes(data[2:4], "little") / 100
        known = resolution_deg in FIELDS_OF_VIEW_DEG.get(fov_deg, ())
        if known:
            self._variant = (fov_deg, resolution_deg)
            self._ticker = Ticker(MIRROR_HZ * resolution_deg)
        return Telegram(Reply.VARIANT, bytes([known]) + self._variant_bytes())

    def _variant_bytes(self) -> bytes:
        fov_deg, resolution_deg = self._variant
        return fov_deg.to_bytes(2, "little") + round(resolution_deg * 100).to_bytes(2, "little")

    def _write_config(self, data: bytes) -> Telegram | None:
        if self.mode != _INSTALLATION or len(data) not in {32, 34}:
            return None
        if data[_MODE_AT] not in MEASURING_MODES or data[_UNIT_AT] not in _UNITS:
            return None
        self._config[: len(data)] = data
        return Telegram(Reply.CONFIG_WRITTEN, b"\x01" + bytes(self._config))

    def _status(self, _: bytes) -> Telegram:
        """Return the status of the longer layout, 152 bytes; what it does not know is 0."""
        data = bytearray(152)  # offsets count from the command byte
        data[0:7] = self._model[-6:].rjust(7)
        data[7] = self.mode
        data[8] = bool(self._errors)
        data[101] = self._config[_MODE_AT]
        data[106:110] = self._variant_bytes()
        data[115:117] = _BAUD_WORDS[self.baud or 9600].to_bytes(2, "little")
        data[121] = self._config[_UNIT_AT]
        return Telegram(Reply.STATUS, bytes(data))

    def _one_scan(self, data: bytes) -> Telegram | None:
        return self._scan() if data == b"\x01" and self.mode == _ON_REQUEST else None

    def _scan(self) -> Telegram:
        fov_deg, resolution_deg = self._variant
        mode = MEASURING_MODES[self._config[_MODE_AT]]
        setting = Lms2xxSetting(fov_deg=fov_deg, resolution_deg=resolution_deg)
        angles = np.deg2rad(setting.start_deg + resolution_deg * np.arange(setting.count))
        ranges = np.asarray(self._beams(self._now_ns, angles), np.float64)
        beyond, unknown = mode.mask - 8, mode.mask - 2  # 1FF7, 1FFD
        words = np.clip(np.rint(ranges / _UNITS[self._config[_UNIT_AT]]), 0, beyond)
        words[np.isnan(ranges)] = unknown
        header = setting.count | self._config[_UNIT_AT] << 14
        return Telegram(Reply.SCAN, header.to_bytes(2, "little") + words.astype("<u2").tobytes())


def _only_acknowledgements(data: bytes) -> bytes:
    return _ACK if data[:1] == _ACK else b""


def _nak(emulator: Emulator, on: Switch) -> Faulty:
    return Unheard(emulator, on, answer=_NAK)


def _ack_only(emulator: Emulator, on: Switch) -> Faulty:
    return Rewritten(emulator, on, rewrite=_only_acknowledgements)


def _power_on(emulator: Emulator, on: Switch) -> Faulty:
    telegram = Telegram(Reply.POWER_ON, b"LMS200;30106x;V02.10 ", _OK, 0x80)
    return Interrupted(emulator, on, intruder=encode(telegram))


LMS2XX_FAULTS: dict[str, Fault] = {
    "nak": _nak,
    "ack-only": _ack_only,
    "power-on": _power_on,
    "restart": Restarted,
}
"""The faults that only an LMS2xx has: it answers with NAK, acknowledges and says no more, sends a
power-on telegram in the middle of a scan, really loses its power."""
