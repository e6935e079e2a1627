"""Sensors, drives, and where frames come from and pictures go, behind common protocols.

One file or folder per device.
"""

from bearcub.devices.files import open_frames
from bearcub.devices.health import Health
from bearcub.devices.protocols import Drive, Frame, FrameSink, FrameSource, Reading, Source
from bearcub.devices.sinks import ImageSink, VideoSink, open_sink
from bearcub.devices.stream import Streaming

__all__ = [
    "Drive",
    "Frame",
    "FrameSink",
    "FrameSource",
    "Health",
    "ImageSink",
    "Reading",
    "Source",
    "Streaming",
    "VideoSink",
    "open_frames",
    "open_sink",
]
