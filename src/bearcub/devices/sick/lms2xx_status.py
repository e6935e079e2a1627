"""What a SICK LMS2xx says of itself: its status (B1h) and its list of errors (B2h).

References
----------
.. [1] SICK 8007954, "Telegram Listing LMS2xx", status (31h) and errors (32h).
"""

from dataclasses import dataclass

from bearcub.devices.sick.lms2xx import Reply, Telegram
from bearcub.errors import FormatError

_BAUDS = {0x8067: 9600, 0x8033: 19200, 0x8019: 38400, 0x8001: 500000}
_UNITS = {0: "cm", 1: "mm", 2: "10 cm"}
_SHORT, _LONG = 146, 152  # bytes; only of the long one is known where the settings stand


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """How a scanner says that it is set.

    Attributes
    ----------
    measuring_mode : int
    fov_deg, resolution_deg : float
        [deg].
    baud : int or None
        At present [baud]; None for a code that is not known.
    keeps_baud : bool
        Whether that speed outlasts a loss of power.
    unit : str
        "cm", "mm" or "10 cm", else the code.
    """

    measuring_mode: int
    fov_deg: float
    resolution_deg: float
    baud: int | None
    keeps_baud: bool
    unit: str

    def __str__(self) -> str:
        """Return it in words."""
        baud = "an unknown speed" if self.baud is None else f"{self.baud} baud"
        kept = ", kept without power" if self.keeps_baud else ""
        return (
            f"{self.fov_deg:g}° in steps of {self.resolution_deg:g}°, {self.unit}, measuring mode "
            f"0x{self.measuring_mode:02X}, {baud}{kept}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Status:
    """A status telegram.

    Attributes
    ----------
    firmware : str
    mode : int
        Operating mode, as in command 20h.
    defective : bool
        Whether it reports a fault of its own.
    settings : Settings or None
        None in the shorter layout of the telegram.
    """

    firmware: str
    mode: int
    defective: bool
    settings: Settings | None


def decode_status(telegram: Telegram) -> Status:
    """Return what a telegram B1 says.

    Raises
    ------
    FormatError
        If it is none, or shorter than the shorter of the two known layouts.
    """
    data = telegram.data
    if telegram.command != Reply.STATUS or len(data) < _SHORT:
        raise FormatError(
            f"LMS2xx: telegram 0x{telegram.command:02X} with {len(data)} bytes, expected a status "
            f"(0xB1) with {_SHORT} or {_LONG}"
        )
    return Status(
        firmware=data[:7].decode("ascii", "replace").strip("\0 "),
        mode=data[7],
        defective=bool(data[8]),
        settings=_settings(data) if len(data) >= _LONG else None,
    )


def _settings(data: bytes) -> Settings:
    def word(at: int) -> int:
        return int.from_bytes(data[at : at + 2], "little")

    return Settings(
        measuring_mode=data[101],
        fov_deg=float(word(106)),
        resolution_deg=word(108) / 100,
        baud=_BAUDS.get(word(115)),
        keeps_baud=bool(data[118]),
        unit=_UNITS.get(data[121], f"unit {data[121]}"),
    )


def decode_errors(telegram: Telegram) -> tuple[tuple[int, int], ...]:
    """Return the type and number of every error in a telegram B2; the manual has their texts.

    Raises
    ------
    FormatError
        If it is none, or does not hold pairs.

    Examples
    --------
    >>> decode_errors(Telegram(Reply.ERRORS, bytes([3, 12, 2, 7])))
    ((3, 12), (2, 7))
    """
    data = telegram.data
    if telegram.command != Reply.ERRORS or len(data) % 2:
        raise FormatError(
            f"LMS2xx: telegram 0x{telegram.command:02X} with {len(data)} bytes, expected errors "
            "(0xB2) in pairs of type and number"
        )
    return tuple(zip(data[::2], data[1::2], strict=True))
