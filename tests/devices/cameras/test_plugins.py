"""A camera that another package brings, found by its entry point."""

from pathlib import Path

import pytest

from bearcub.clock import ManualClock
from bearcub.devices.cameras import CameraSource
from bearcub.devices.cameras.plugins import PluginSettings, build_capture, plugin_names
from bearcub.errors import ConfigError
from bearcub.runtime.devices import build_devices

MODULE = """
import numpy as np
from bearcub.devices.cameras import Taken

class Grey:
    name = "grey camera"
    def __init__(self, settings, clock):
        self.settings, self.clock = settings, clock
    def open(self): pass
    def close(self): pass
    def take(self):
        picture = np.full((self.settings.height, self.settings.width), 90, dtype=np.uint8)
        return Taken(left=picture, right=picture.copy(), stamp_ns=self.clock.now_ns(), skew=0.0)
"""


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A package as pip leaves it."""
    (tmp_path / "grey_camera.py").write_text(MODULE)
    info = tmp_path / "grey_camera-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: grey-camera\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[bearcub.cameras]\ngrey = grey_camera:Grey\nbroken = grey_camera:Missing\n"
    )
    monkeypatch.syspath_prepend(tmp_path)


@pytest.mark.usefixtures("installed")
def test_a_camera_of_another_package_is_a_kind_of_device() -> None:
    assert "grey" in plugin_names()
    table = {"eyes": {"kind": "grey", "width": 40, "height": 30, "rate_hz": 10}}
    (device,) = build_devices(table, clock=ManualClock(), folder=Path())
    assert isinstance(device.part, CameraSource)
    assert device.part.name == "eyes (grey camera)"
    device.part.step()
    reading = device.part.latest()
    assert reading is not None
    assert reading.value.right is not None
    assert reading.value.right.shape == (30, 40)


@pytest.mark.usefixtures("installed")
def test_a_package_that_does_not_hold_what_it_announces_is_named() -> None:
    with pytest.raises(ConfigError, match="camera driver broken: its package does not load"):
        build_capture("broken", PluginSettings(), clock=ManualClock())
