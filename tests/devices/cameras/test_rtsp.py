"""A network camera by RTSP, small but real: Motion JPEG in RTP (RFC 2435) over TCP."""

import itertools
import re
import socket
import struct
import threading
from collections.abc import Iterator

import cv2
import numpy as np
import pytest

from bearcub.clock import MonotonicClock
from bearcub.devices.cameras import CameraSource
from bearcub.devices.cameras.opencv import SingleCapture, VideoDevice

WIDTH, HEIGHT = 128, 48
SDP = "v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=camera\r\nt=0 0\r\nm=video 0 RTP/AVP 26\r\n"


def packet() -> bytes:
    """One picture, dark on the left and bright on the right, as the payload of one RTP packet."""
    picture = np.full((HEIGHT, WIDTH, 3), 40, dtype=np.uint8)
    picture[:, WIDTH // 2 :] = 200
    jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 90])[1].tobytes()
    tables = b"".join(
        jpeg[at + 5 : at + 69] for at in (m.start() for m in re.finditer(b"\xff\xdb", jpeg))
    )
    assert len(tables) == 128
    start = jpeg.index(b"\xff\xda")
    scan = jpeg[start + 2 + int.from_bytes(jpeg[start + 2 : start + 4], "big") : -2]
    # No offset, type 1 (4:2:0), Q 255: the tables follow.
    header = struct.pack(">IBBBB", 0, 1, 255, WIDTH // 8, HEIGHT // 8)
    return header + struct.pack(">BBH", 0, 0, 128) + tables + scan


class RtspCamera:
    """Serves one client after another."""

    def __init__(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._stopping = threading.Event()
        self.transports: list[str] = []
        self.address = f"rtsp://127.0.0.1:{self._listener.getsockname()[1]}/live?channel=1"
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._stopping.set()
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._thread.join()

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                peer = self._listener.accept()[0]
            except OSError:
                return
            with peer:
                self._serve(peer)

    def _serve(self, peer: socket.socket) -> None:
        lines = peer.makefile("rb")
        while request := b"".join(iter(lines.readline, b"\r\n")).decode():
            method = request.split()[0]
            number = re.search(r"CSeq: (\d+)", request, re.IGNORECASE)
            assert number is not None
            head, body = f"RTSP/1.0 200 OK\r\nCSeq: {number[1]}\r\nSession: 7\r\n", ""
            if method == "DESCRIBE":
                body = SDP
                head += f"Content-Type: application/sdp\r\nContent-Length: {len(body)}\r\n"
            if method == "SETUP":
                found = re.search(r"Transport: (.*?)\r", request)
                assert found is not None
                self.transports.append(found[1])
                head += f"Transport: {found[1]}\r\n"
            peer.sendall(f"{head}\r\n{body}".encode())
            if method == "PLAY":
                self._play(peer)
                return

    def _play(self, peer: socket.socket) -> None:
        payload = packet()
        for number in itertools.count():
            if self._stopping.wait(0.03):
                return
            rtp = struct.pack(">BBHII", 0x80, 0x80 | 26, number & 0xFFFF, number * 2700, 9)
            length = len(rtp) + len(payload)
            try:
                peer.sendall(struct.pack(">cBH", b"$", 0, length) + rtp + payload)
            except OSError:
                return


@pytest.fixture
def camera() -> Iterator[RtspCamera]:
    served = RtspCamera()
    yield served
    served.close()


def test_an_rtsp_camera_is_read_over_tcp(camera: RtspCamera) -> None:
    clock, tick = MonotonicClock(), threading.Event()
    device = VideoDevice(camera.address, clock=clock)
    capture = SingleCapture(device, side_by_side=True)
    with CameraSource(capture, clock=clock, rate_hz=30, role="eyes") as source:
        for _ in range(1000):
            if source.health().values >= 5:
                break
            tick.wait(0.01)
        reading, health = source.latest(), source.health()
    assert reading is not None, health
    left, right = reading.value.left, reading.value.right
    assert left is not None
    assert right is not None
    assert (left.shape, right.shape) == ((HEIGHT, WIDTH // 2, 3), (HEIGHT, WIDTH // 2, 3))
    assert abs(int(left[24, 20, 0]) - 40) < 6
    assert abs(int(right[24, 40, 0]) - 200) < 6
    assert camera.transports[0].startswith("RTP/AVP/TCP;unicast")
