"""What a Galil controller's numbers mean, in words (command reference, TC, SC and TS).

Numbers that are not listed are reported as themselves: firmware differs between models.
"""

ERRORS = {
    1: "unknown command",
    2: "command is valid in a program only",
    3: "command is not valid in a program",
    4: "operand error",
    5: "input buffer full",
    6: "number out of range",
    7: "command not valid while the axis runs",
    8: "command not valid while the axis stands",
    9: "variable error",
    10: "empty program line or undefined label",
    11: "invalid or undefined label",
    12: "subroutines nested more than 16 deep",
    13: "JG is valid in jog mode only while the axis runs",
    14: "EEPROM checksum error",
    15: "EEPROM write error",
    16: "wrong sign in an IP command",
    17: "command not valid while a program runs",
    18: "command not valid while contouring",
    19: "a program runs already in this thread",
    20: "cannot begin with the motor off",
    21: "cannot begin while the axis runs",
    22: "cannot begin: a limit switch is active",
    24: "cannot begin: no sequence defined",
    28: "S operand not valid",
    29: "not valid during coordinated motion",
    50: "not enough fields",
    51: "question mark not valid",
    52: "missing quotation mark, or text too long",
    53: "error in curly brackets",
    55: "missing square bracket",
    56: "array index out of range",
    57: "bad function or array",
    58: "bad response to a command",
    59: "parentheses do not match",
    90: "only the axes A, B, C and D are valid",
    120: "Ethernet transmission failed",
    121: "bad Ethernet packet received",
    123: "TCP lost its synchronisation",
    124: "Ethernet handle in use already",
    125: "no ARP response",
    126: "Ethernet handle closed",
    127: "Modbus device does not answer",
    128: "IP address not valid",
    130: "remote IO command error",
    131: "serial port timed out",
    132: "analog inputs not fitted",
    133: "handle must be a UDP handle",
    134: "the motor must be off",
    135: "the motor must be off",
}
"""Texts of the numbers that TC returns, most of which TC 1 also spells out."""

STOP_CODES = {
    0: "running",
    1: "stopped at the commanded position",
    2: "stopped by the forward limit switch",
    3: "stopped by the reverse limit switch",
    4: "stopped by a command (ST)",
    6: "stopped by the abort input",
    7: "stopped by an abort command (AB)",
    8: "stopped because the position error exceeded its limit (off-on-error)",
    9: "stopped after finding an edge (FE)",
    10: "stopped after homing (HM or FI)",
    11: "stopped by the selective abort input",
    12: "stopped because its encoder failed",
    15: "stopped by an amplifier fault",
    16: "stopped by stepper position maintenance",
    30: "running in PVT mode",
    31: "PVT mode completed",
    32: "PVT mode stopped: its buffer ran empty",
    50: "contouring",
    51: "contouring stopped",
    99: "stopped: motion was not completed in time (MC)",
    100: "running a vector sequence",
    101: "vector sequence stopped",
}

FAULTS = frozenset({2, 3, 6, 8, 11, 12, 15, 16, 99})
"""Stop codes after which someone has to look before the wheels turn again."""


def error_text(code: int, *, said: str = "") -> str:
    """Return what an error number of TC means.

    Parameters
    ----------
    code : int
    said : str
        The controller's own words, for a number that is not listed here.

    Examples
    --------
    >>> error_text(20)
    'error 20: cannot begin with the motor off'
    >>> error_text(113, said="Hall sensor fault")
    'error 113: Hall sensor fault'
    >>> error_text(250)
    'error 250: see TC in the command reference of the controller'
    """
    other = said or "see TC in the command reference of the controller"
    return f"error {code}: {ERRORS.get(code, other)}"


def stop_text(code: int) -> str:
    """Return what a stop code of SC means.

    Examples
    --------
    >>> stop_text(2)
    'stopped by the forward limit switch'
    """
    return STOP_CODES.get(code, f"stop code {code}: see SC in the command reference")


def axis_faults(
    *, stop_code: int, motor_off: bool, forward_limit: bool, reverse_limit: bool
) -> tuple[str, ...]:
    """Return what keeps an axis from moving, in words; empty when nothing does.

    Parameters
    ----------
    stop_code : int
        Of SC.
    motor_off, forward_limit, reverse_limit : bool
        True where the motor is off though it was switched on, and where a limit switch is active.
    """
    found = [stop_text(stop_code)] if stop_code in FAULTS else []
    if motor_off:
        found.append("motor off")
    if forward_limit:
        found.append("forward limit switch active")
    if reverse_limit:
        found.append("reverse limit switch active")
    return tuple(found)
