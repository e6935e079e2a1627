"""What is plugged in, from folders as the kernel makes them."""

from pathlib import Path

from bearcub.runtime.inventory import Plugged, cameras, serial_ports, software
from bearcub.stereo.native import levels, reason_missing


def test_cameras_are_listed_in_order_with_their_names_that_last(tmp_path: Path) -> None:
    root, names, files = tmp_path / "sys", tmp_path / "by-id", tmp_path / "dev"
    for node, name, index in (("video10", "B", "0"), ("video2", "A", "0"), ("video3", "A", "1")):
        (root / node).mkdir(parents=True)
        (root / node / "name").write_text(name + "\n")
        (root / node / "index").write_text(index + "\n")
    files.mkdir()
    names.mkdir()
    (files / "video2").touch()
    (names / "usb-A-video-index0").symlink_to(files / "video2")
    assert cameras(root=root, names=names) == [
        Plugged(path="/dev/video2", name="A", lasting=str(names / "usb-A-video-index0")),
        Plugged(path="/dev/video10", name="B"),
    ]


def test_a_computer_without_cameras_has_none(tmp_path: Path) -> None:
    assert cameras(root=tmp_path / "nothing", names=tmp_path / "nothing") == []


def test_serial_ports_are_listed_by_their_paths() -> None:
    ports = serial_ports()
    assert ports is not None  # pyserial is among the tests' requirements
    assert [port.path for port in ports] == sorted(port.path for port in ports)


def test_missing_software_comes_with_the_command_that_installs_it() -> None:
    parts = software()
    assert {part.name: part.found for part in parts}["serial lines"]
    assert all("run: " in part.advice for part in parts)


def test_the_native_core_is_named_with_what_it_runs_on() -> None:
    core = software()[0]
    assert core.name.startswith("native core")
    assert core.found == (reason_missing() == "")
    assert not core.found or core.name.split()[-1] in levels()
