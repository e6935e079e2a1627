"""A robot that drives through a scene, with sensors that see it at their own rates."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from types import TracebackType
from typing import Generic, Self, TypeVar

import numpy as np

from bearcub.devices.protocols import Reading
from bearcub.geometry import OPTICAL_FROM_BODY, Attitude, rotation
from bearcub.messages import Fix, Float64, Scan, Tilt, WheelState
from bearcub.rig import Rig
from bearcub.sim.ladar import HEIGHT
from bearcub.sim.light import Light
from bearcub.sim.mujoco.casting import behind_grass, cast
from bearcub.sim.mujoco.chassis import TIMESTEP, Area, Chassis, model
from bearcub.sim.mujoco.library import mujoco
from bearcub.sim.mujoco.moved import describe_from
from bearcub.sim.mujoco.stage import Stage
from bearcub.sim.mujoco.studio import disparity_of, photograph
from bearcub.sim.render import Rendered, View
from bearcub.sim.sensor import Strength
from bearcub.sim.sensors import (
    GpsModel,
    GpsSensor,
    LadarModel,
    TiltModel,
    TiltSensor,
    WheelModel,
    WheelSensor,
)
from bearcub.sim.world import Scene

T = TypeVar("T")

_CLEAR = Light()
_SHARPNESS = 0.4  # of textures that are made for a whole route
_FOREGROUND = 1.5  # what is so far before the robot fills the lowest rows [m]
_OVERTURNED = math.radians(45.0)
_SETTLING = 0.5  # until the robot stands still on its wheels [s]
_BEAMS = np.radians(np.linspace(-90.0, 90.0, 361))


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where a body is in the scene, level: `x`, `y`, `z` [m], REP-103 angles [rad]."""

    x: float
    y: float
    z: float
    roll: float
    pitch: float
    yaw: float

    @property
    def attitude(self) -> Attitude:
        """Roll and pitch as one value."""
        return Attitude(roll=self.roll, pitch=self.pitch)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensors:
    """The models of a robot's sensors."""

    tilt: TiltModel = field(default_factory=TiltModel)
    ladar: LadarModel = field(default_factory=LadarModel)
    wheels: WheelModel = field(default_factory=WheelModel)
    gps: GpsModel = field(default_factory=GpsModel)


class _Timed(Generic[T]):
    """A sensor's latest reading, taken at its own rate."""

    def __init__(self, rate_hz: float, measure: Callable[[], T]) -> None:
        self._period, self._measure = round(1e9 / rate_hz), measure
        self._due, self._count = 0, 0
        self._value: T | None = None
        self._stamp = 0

    def tick(self, now: int) -> None:
        """Measure when it is time to."""
        if now >= self._due:
            self._value, self._stamp = self._measure(), now
            self._count += 1
            self._due += self._period

    def latest(self, now: int) -> Reading[T] | None:
        """Return the latest value as it stands at a time [ns]; None before the first."""
        if self._value is None:
            return None
        age = now - self._stamp
        return Reading(
            value=self._value,
            stamp_ns=self._stamp,
            age=1e-9 * age,
            fresh=age <= 3 * self._period,
            count=self._count,
        )


class Simulation:
    """A robot in a scene: physics, camera, tilt sensor, LADAR, wheel encoders and GPS.

    Everything follows from the arguments and the commands: the same ones give the same bits.

    Parameters
    ----------
    scene : Scene
    rig : Rig
        The camera on the robot, in its ``base_link``.
    light : Light
    seed : int
        Of bumps, grass and all sensors.
    start : tuple of float
        x, y [m] and yaw [rad] of ``base_link`` in the scene.
    route : tuple of (float, float)
        Points [m] near which the robot will drive: there the ground is sharp from close by.
    area : Area
        Beyond it the robot falls.
    chassis : Chassis
    sensors : Sensors
    roughness : float
        RMS height of the bumps that the wheels feel [m]; they are too low to be drawn.

    Raises
    ------
    DeviceError
        If MuJoCo or OpenGL is missing.
    """

    def __init__(
        self,
        scene: Scene,
        rig: Rig,
        *,
        light: Light = _CLEAR,
        seed: int = 0,
        start: tuple[float, float, float] = (0.0, 0.0, 0.0),
        route: tuple[tuple[float, float], ...] = ((0.0, 0.0), (4.0, 0.0), (8.0, 0.0)),
        area: Area | None = None,
        chassis: Chassis | None = None,
        sensors: Sensors | None = None,
        roughness: float = 0.004,
    ) -> None:
        library = mujoco()
        self._scene, self._rig, self._light, self._seed = scene, rig, light, seed
        self._route, self._chassis = route, chassis or Chassis()
        self._model = model(
            scene,
            self._chassis,
            area or Area(),
            mount=rig.mount,
            start=start,
            roughness=roughness,
            seed=seed,
        )
        self._data = library.MjData(self._model)
        self._stage: Stage | None = None
        self._pictures = 0
        self._steps = -round(_SETTLING / TIMESTEP)
        self._touched: set[str] = set()
        self._install(sensors or Sensors())
        self._advance(-self._steps)

    def _install(self, sensors: Sensors) -> None:
        """Set the sensors up; each has its own stream of random numbers."""
        track, seed = self._chassis.track, self._seed
        self._inclinometer = TiltSensor(sensors.tilt, seed=seed)
        encoders = WheelSensor(sensors.wheels, track=track, seed=seed)
        receiver = GpsSensor(sensors.gps, seed=seed)
        echoes = np.random.default_rng((seed, 5))
        self._tilt = _Timed[Tilt](sensors.tilt.rate_hz, lambda: self._inclinometer.read(self.time))
        self._scan = _Timed[Scan](
            sensors.ladar.rate_hz,
            lambda: sensors.ladar.measured(self._ranges(), _BEAMS, echoes),
        )
        self._wheels = _Timed[WheelState](
            sensors.wheels.rate_hz, lambda: encoders.read(self.time, *self._rolled())
        )
        self._gps = _Timed[Fix](
            sensors.gps.rate_hz,
            lambda: receiver.read(self.time, float(self._data.qpos[0]), float(self._data.qpos[1])),
        )

    @property
    def time(self) -> float:
        """Since the start [s]."""
        return self._steps * TIMESTEP

    @property
    def stamp_ns(self) -> int:
        """Since the start [ns]."""
        return self._steps * round(TIMESTEP * 1e9)

    @property
    def overturned(self) -> bool:
        """Whether the robot has fallen over, or off."""
        place = self.pose()
        return max(abs(place.pitch), abs(place.roll)) > _OVERTURNED

    @property
    def touched(self) -> frozenset[str]:
        """Names of the things that the robot has run into so far."""
        return frozenset(self._touched)

    def step(self, dt: float, speed: float, turn_rate: float) -> None:
        """Drive for a while.

        Parameters
        ----------
        dt : float
            How long [s]; rounded to whole steps of 2 ms.
        speed : float
            Commanded [m/s], ahead positive.
        turn_rate : float
            Commanded [rad/s], left positive.
        """
        half = 0.5 * self._chassis.track * turn_rate
        radius = self._chassis.wheel_radius
        self._data.ctrl[0] = (speed - half) / radius
        self._data.ctrl[1] = (speed + half) / radius
        self._advance(max(1, round(dt / TIMESTEP)))

    def _advance(self, steps: int) -> None:
        library = mujoco()
        for _ in range(steps):
            library.mj_step(self._model, self._data)
            self._steps += 1
            if self._steps < 0:
                continue
            self._note_contacts()
            self._inclinometer.feel(self.time, self.pose().attitude)
            for sensor in (self._tilt, self._scan, self._wheels, self._gps):
                sensor.tick(self.stamp_ns)

    def _note_contacts(self) -> None:
        for pair in self._data.contact.geom:
            for geom in pair:
                name = self._model.geom(int(geom)).name
                if name.startswith("thing "):
                    self._touched.add(self._scene.things[int(name.split()[1]) - 1].name)

    def pose(self) -> Place:
        """Return where ``base_link`` truly is."""
        turn = self._turn()
        x, y, z = (float(value) for value in self._data.qpos[:3])
        return Place(
            x=x,
            y=y,
            z=z,
            roll=math.atan2(turn[2, 1], turn[2, 2]),
            pitch=math.asin(min(1.0, max(-1.0, -float(turn[2, 0])))),
            yaw=math.atan2(turn[1, 0], turn[0, 0]),
        )

    def tilt(self) -> Reading[Tilt] | None:
        """Return the tilt sensor's latest reading."""
        return self._tilt.latest(self.stamp_ns)

    def scan(self) -> Reading[Scan] | None:
        """Return the LADAR's latest sweep; it sees no grass."""
        return self._scan.latest(self.stamp_ns)

    def wheels(self) -> Reading[WheelState] | None:
        """Return what the encoders said last; wheels may slip."""
        return self._wheels.latest(self.stamp_ns)

    def gps(self) -> Reading[Fix] | None:
        """Return the latest fix; the scene's x is east, its y north."""
        return self._gps.latest(self.stamp_ns)

    def view(self) -> View:
        """Return the left camera where the robot holds it now, in the scene."""
        turn, mount = self._turn(), self._rig.mount
        body_from_optical = rotation(roll=mount.roll, pitch=mount.pitch) @ OPTICAL_FROM_BODY.T
        level_from_optical: Float64 = turn @ body_from_optical
        on_body = np.array([mount.x, mount.y, mount.height])
        return View(
            camera=self._rig.camera,
            position=self._data.qpos[:3] + turn @ on_body,
            level_from_optical=level_from_optical,
            down=-level_from_optical[2],
        )

    def pair(self, *, noise: Strength | None = None) -> Rendered:
        """Take a stereo pair now, with its truth: see `describe_from`.

        Parameters
        ----------
        noise : {"weak", "medium", "strong"} or None
            Sensor model; every picture has its own noise.
        """
        view, stage = self.view(), self._open_stage()
        self._pictures += 1
        seed = (self._seed, self._pictures)
        left, right = photograph(stage, view, noise=noise, seed=seed, rig=self._seed)
        hits = behind_grass(cast(self._scene, view), stage.grass_depth(view), view)
        at = self.pose()
        place = (at.x, at.y, at.yaw)
        return Rendered(
            left=left,
            right=right,
            disparity=disparity_of(hits, self._rig),
            labels=hits.labels,
            truth=describe_from(self._scene, self._rig, view, hits, place=place, body=at.attitude),
        )

    def _open_stage(self) -> Stage:
        """Compile the pictures' model when the first one is taken."""
        if self._stage is None:
            height = self._rig.mount.height
            eyes = np.array(
                [
                    [x + ahead, y, self._scene.ground.at(x + ahead, y) + height]
                    for x, y in self._route
                    for ahead in (0.0, _FOREGROUND)
                ]
            )
            self._stage = Stage(
                self._scene,
                self._light,
                self._rig.camera,
                eyes,
                seed=self._seed,
                sharpness=_SHARPNESS,
            )
        return self._stage

    def _turn(self) -> Float64:
        """Return the rotation from body to level axes, shape (3, 3)."""
        flat = np.zeros(9)
        mujoco().mju_quat2Mat(flat, self._data.qpos[3:7])
        return flat.reshape(3, 3)

    def _rolled(self) -> tuple[float, float]:
        """Return how far the wheels have rolled [m]."""
        radius = self._chassis.wheel_radius
        left, right = (float(self._data.joint(name).qpos[0]) for name in ("left", "right"))
        return radius * left, radius * right

    def _ranges(self) -> Float64:
        """Return the LADAR's true ranges [m]; it sits below the camera and turns with the body."""
        turn, mount = self._turn(), self._rig.mount
        origin = self._data.qpos[:3] + turn @ np.array([mount.x, mount.y, HEIGHT])
        beams = turn @ np.stack([np.cos(_BEAMS), np.sin(_BEAMS), np.zeros(_BEAMS.size)])
        reach = np.full(_BEAMS.size, np.inf)
        with np.errstate(all="ignore"):
            for part, _ in self._scene.parts():
                reach = np.fmin(reach, part.hit(origin[:, None], beams))
        return reach

    def close(self) -> None:
        """Give OpenGL's memory back."""
        if self._stage is not None:
            self._stage.close()
            self._stage = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
