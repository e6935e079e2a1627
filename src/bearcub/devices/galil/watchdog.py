"""The program on the controller that stops the wheels when the host falls silent.

Nothing in the controller's protocol stops a motor whose host has died: a jogging axis jogs on.
The program counts a variable down; the host sets it anew with every fresh command. When it has run
out, both axes are decelerated to a stand and stay so, whoever commands them, until the host speaks
again.
"""

from bearcub.errors import ConfigError

VARIABLE = "bchb"  # the heartbeat; lower case, as commands are upper case
_STEP_MS = 20
LABEL = "#AUTO"  # also runs at power-up where the program is burned into the controller


def watchdog_program(axes: str, *, deceleration: int) -> str:
    """Return the program's lines, each at most 40 characters, separated by carriage returns.

    Parameters
    ----------
    axes : str
        Letters of the wheels, such as ``AB``.
    deceleration : int
        With which they are stopped [counts/s²].

    Examples
    --------
    >>> print(watchdog_program("AB", deceleration=51200).replace(chr(13), chr(10)))
    #AUTO
    bchb=0
    #BCWATCH
    WT 20
    bchb=bchb-1
    IF (bchb<0)
    bchb=-1
    DCA=51200;DCB=51200
    ST AB
    ENDIF
    JP #BCWATCH
    """
    limits = ";".join(f"DC{axis}={deceleration}" for axis in axes)
    lines = (
        LABEL,
        f"{VARIABLE}=0",
        "#BCWATCH",
        f"WT {_STEP_MS}",
        f"{VARIABLE}={VARIABLE}-1",
        f"IF ({VARIABLE}<0)",
        f"{VARIABLE}=-1",
        limits,
        f"ST {axes}",
        "ENDIF",
        "JP #BCWATCH",
    )
    return "\r".join(lines)


def heartbeat(silence: float) -> str:
    """Return the command that lets the wheels turn for another `silence` seconds.

    Raises
    ------
    ConfigError
        If that is less than two steps of the program or more than 5 s.

    Examples
    --------
    >>> heartbeat(0.3)
    'bchb=15'
    """
    if not 2 * _STEP_MS / 1000 <= silence <= 5.0:
        raise ConfigError(f"silence = {silence}: must be from {2 * _STEP_MS / 1000} to 5 seconds")
    return f"{VARIABLE}={round(silence * 1000 / _STEP_MS)}"


def is_watchdog(listing: str) -> bool:
    """Tell whether a program listing (LS) is this program's, whatever its deceleration.

    Line numbers stand before every line of a listing.
    """
    lines = [line.strip().lstrip("0123456789 ") for line in listing.splitlines() if line.strip()]
    return lines[:4] == watchdog_program("AB", deceleration=0).split("\r")[:4]
