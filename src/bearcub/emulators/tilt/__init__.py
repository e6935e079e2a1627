"""Emulated tilt sensors and IMUs: the senders' side of `bearcub.devices.tilt`, file by file."""
