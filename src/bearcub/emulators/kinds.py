"""The table of emulated devices: what the command line offers and the contract tests run over.

A device that is added here is tested against everything that a source must do.
"""

from bearcub.emulators.drive_kinds import DRIVE_KINDS
from bearcub.emulators.kind import Kind
from bearcub.emulators.ladar_kinds import LADAR_KINDS
from bearcub.emulators.tilt.kinds import TILT_KINDS

KINDS: dict[str, Kind] = {**TILT_KINDS, **LADAR_KINDS, **DRIVE_KINDS}
