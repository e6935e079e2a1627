"""Where frames come from and pictures go: one file per device, behind common protocols."""

from bearcub.devices.files import open_frames
from bearcub.devices.protocols import Frame, FrameSink, FrameSource
from bearcub.devices.sinks import ImageSink, VideoSink, open_sink

__all__ = [
    "Frame",
    "FrameSink",
    "FrameSource",
    "ImageSink",
    "VideoSink",
    "open_frames",
    "open_sink",
]
