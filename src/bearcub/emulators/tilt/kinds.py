"""The tilt sensors and IMUs among the emulated devices."""

from bearcub.devices.tilt.cxtilt import Cxtilt
from bearcub.devices.tilt.hmr3000 import Hmr3000
from bearcub.devices.tilt.mip import Mip
from bearcub.devices.tilt.tcm2 import Tcm2
from bearcub.devices.tilt.vectornav import VectorNav
from bearcub.devices.tilt.xdr import Xdr
from bearcub.devices.tilt.xsens import Xsens
from bearcub.emulators.faults import Restarted
from bearcub.emulators.kind import Kind
from bearcub.emulators.tilt.cxtilt import CxtiltEmulator
from bearcub.emulators.tilt.mip import MipEmulator
from bearcub.emulators.tilt.talkers import (
    Hmr3000Emulator,
    Os5000Emulator,
    Tcm2Emulator,
    XdrEmulator,
)
from bearcub.emulators.tilt.vectornav import VectorNavEmulator
from bearcub.emulators.tilt.xsens import XsensEmulator

TILT_KINDS = {
    "cxtilt": Kind(
        purpose="Crossbow CXTILT02 tilt sensor",
        emulator=CxtiltEmulator,
        driver=Cxtilt,
        rate_hz=20.0,
    ),
    "tcm2": Kind(
        purpose="PNI TCM2 compass with tilt",
        emulator=Tcm2Emulator,
        driver=Tcm2,
        rate_hz=10.0,
        faults={"restart": Restarted},
    ),
    "os5000": Kind(
        purpose="OceanServer OS5000 compass with tilt",
        emulator=Os5000Emulator,
        driver=lambda: Tcm2(baud=Os5000Emulator.baud, start=b""),
        rate_hz=10.0,
    ),
    "hmr3000": Kind(
        purpose="Honeywell HMR3000 compass with tilt ($PTNTHPR)",
        emulator=Hmr3000Emulator,
        driver=Hmr3000,
        rate_hz=10.0,
    ),
    "nmea": Kind(
        purpose="attitude sensor that speaks NMEA 0183 (XDR)",
        emulator=XdrEmulator,
        driver=Xdr,
        rate_hz=10.0,
    ),
    "vectornav": Kind(
        purpose="VectorNav VN-100 IMU ($VNYMR)",
        emulator=VectorNavEmulator,
        driver=VectorNav,
        rate_hz=40.0,
        faults={"restart": Restarted},
    ),
    "mip": Kind(
        purpose="MicroStrain 3DM-GX IMU (MIP)",
        emulator=MipEmulator,
        driver=Mip,
        rate_hz=50.0,
        faults={"restart": Restarted},
    ),
    "xsens": Kind(
        purpose="Xsens MTi IMU (MTData2)",
        emulator=XsensEmulator,
        driver=Xsens,
        rate_hz=50.0,
        faults={"restart": Restarted},
    ),
}
