"""Tilt sensors and IMUs: one file per protocol, each a driver that measures `Tilt`, REP-103."""
