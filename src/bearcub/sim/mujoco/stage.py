"""A scene as a MuJoCo model that can be drawn: meshes, textures, and the two cameras' pictures."""

import math
from dataclasses import dataclass
from itertools import pairwise
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from bearcub.errors import ConfigError
from bearcub.messages import Float64, UInt8
from bearcub.rig import Camera
from bearcub.sim.grass import Blades
from bearcub.sim.light import Light
from bearcub.sim.mujoco.baking import Baker, mip_maps, sky_ramp
from bearcub.sim.mujoco.lawn import lawns as lawns_of
from bearcub.sim.mujoco.lawn import palette_image
from bearcub.sim.mujoco.library import drawing_context, gl, mujoco
from bearcub.sim.mujoco.surfaces import FAR, patches
from bearcub.sim.render import View
from bearcub.sim.world import Scene

_NEAR = 0.03  # nothing nearer to the camera is drawn [m]
_SKY = 2.5 * FAR  # radius of the sky [m]
_SKY_END = 2.0 * _SKY  # nothing farther is drawn [m]
_SKY_STEPS = 256
_SHOWN, _GRASS, _UNSEEN = 0, 1, 5  # groups of geoms; what no view has shown is not drawn
_SAMPLES = 4  # per pixel, of edges; more than one halves the pixels that matchers get wrong there
_SECTORS = 48  # of the sky
_EMPTY = 2  # side of the textures that MuJoCo makes [texels]; the pictures follow later
_SHARPER = -1.0  # bias of the mip-map level: the ground is seen edge-on, and blurred otherwise


@dataclass(frozen=True, kw_only=True)
class _Mesh:
    """What MuJoCo needs of one surface."""

    name: str
    vertices: Float64
    faces: NDArray[np.int32]
    coordinates: Float64
    group: int = _SHOWN


class Stage:
    """A scene in MuJoCo's renderer; textures are made when they first come into view.

    Parameters
    ----------
    scene : Scene
    light : Light
    camera : Camera
        Of the pictures to come.
    eyes : ndarray of float64, shape (K, 3)
        Where it will be [m]: textures are as fine as these need, haze is reckoned from the first.
    seed : int
        Of the standing grass.
    sharpness : float
        Less than 1 makes textures coarser and faster to make.

    Raises
    ------
    ConfigError
        If the camera's pixels are not square: MuJoCo draws no others.
    DeviceError
        If MuJoCo or OpenGL is missing.
    """

    def __init__(
        self,
        scene: Scene,
        light: Light,
        camera: Camera,
        eyes: Float64,
        *,
        seed: int = 0,
        sharpness: float = 1.0,
    ) -> None:
        if not math.isclose(camera.fx, camera.fy, rel_tol=1e-3):
            raise ConfigError(
                f"camera.fx = {camera.fx}, camera.fy = {camera.fy}: the MuJoCo world needs "
                "square pixels; rectify the pair to one focal length"
            )
        self._light, self._camera, self._eye = light, camera, eyes[0]
        self._baker = Baker(scene, light, eyes[0])
        self._patches = list(patches(scene, eyes, sharpness * camera.fx))
        self._vertices = [patch.vertices() for patch in self._patches]
        self._facing = [patch.facing() for patch in self._patches]
        self._baked = np.zeros(len(self._patches), dtype=bool)
        meshes = [
            _Mesh(
                name=f"patch{index}",
                vertices=vertices,
                faces=patch.faces,
                coordinates=patch.texture_coordinates(),
                group=_UNSEEN,
            )
            for index, (patch, vertices) in enumerate(
                zip(self._patches, self._vertices, strict=True)
            )
        ]
        lawns = [
            _lawn(index, grass) for index, grass in enumerate(lawns_of(scene, light, seed=seed))
        ]
        self._has_grass = bool(lawns)
        self.model = _compile([*meshes, *lawns, _dome(self._eye)], camera)
        self._open()

    def _open(self) -> None:
        library = mujoco()
        width, height = self._camera.width, self._camera.height
        self._context = drawing_context(2 * width, height)
        self._drawing = library.MjrContext(self.model, library.mjtFontScale.mjFONTSCALE_50)
        self._drawing.readDepthMap = library.mjtDepthMap.mjDEPTH_ZEROFAR
        library.mjr_setBuffer(library.mjtFramebuffer.mjFB_OFFSCREEN, self._drawing)
        self._drawn = _drawn(self.model, (_SHOWN, _GRASS))
        for index in range(len(self._patches), self.model.ntex - 1):
            self._upload(index, palette_image(self._light), smaller=False)
        self._upload(self.model.ntex - 1, sky_ramp(self._light, _SKY_STEPS))
        if self._has_grass:
            self._grass = _drawn(self.model, (_GRASS,))
            self._grass.stereo = library.mjtStereo.mjSTEREO_NONE
            for flag in (library.mjtRndFlag.mjRND_SEGMENT, library.mjtRndFlag.mjRND_IDCOLOR):
                self._grass.flags[flag] = 1  # draws one sample per pixel, at its centre

    def pair(self, view: View) -> tuple[UInt8, UInt8]:
        """Draw both cameras' images (blue, green, red), each of shape (H, W, 3)."""
        library = mujoco()
        self._context.make_current()
        self._bake_what_shows(view)
        width, height = self._camera.width, self._camera.height
        eyes = (view.position, view.right_position())
        for index, (eye, shift) in enumerate(zip(eyes, (0.0, self._camera.doffs), strict=True)):
            _aim(self._drawn.camera[index], view, eye, shift)
        window = library.MjrRect(0, 0, 2 * width, height)
        library.mjr_render(window, self._drawn, self._drawing)
        picture = np.empty((height, 2 * width, 3), dtype=np.uint8)
        library.mjr_readPixels(picture, None, window, self._drawing)
        upright = picture[::-1, :, ::-1]
        return (
            np.ascontiguousarray(upright[:, :width]),
            np.ascontiguousarray(upright[:, width:]),
        )

    def grass_depth(self, view: View) -> Float64:
        """Return how far the nearest blade is in each left pixel, shape (H, W).

        Depth along the optical axis [m] of the ray through the pixel's centre; inf where no blade
        is.
        """
        height, width = self._camera.height, self._camera.width
        if not self._has_grass:
            return np.full((height, width), np.inf)
        library = mujoco()
        self._context.make_current()
        for index in range(2):
            _aim(self._grass.camera[index], view, view.position, 0.0)
        window = library.MjrRect(0, 0, width, height)
        library.mjr_render(window, self._grass, self._drawing)
        nearness = np.empty((height, width), dtype=np.float32)  # 1 at the near plane, 0 far off
        library.mjr_readPixels(None, nearness, window, self._drawing)
        near, far = np.float32(_NEAR), np.float32(_SKY_END)
        scale = float(near) * float(far) / (float(far) - float(near))
        depth = scale / (nearness[::-1].astype(np.float64) + scale / float(far))
        return np.where(nearness[::-1] > 0, depth, np.inf)

    def _bake_what_shows(self, view: View) -> None:
        """Make the textures of patches that this view is the first to show."""
        known = int(self._baked.sum())
        for index in np.flatnonzero(~self._baked).tolist():
            if _shows(self._vertices[index], view) and not _averted(self._facing[index], view):
                self._upload(index, self._baker.texture(self._patches[index]))
                self._baked[index] = True
                self.model.geom_group[index] = _SHOWN
        if self._baked.sum() > known:
            self._drawn = _drawn(self.model, (_SHOWN, _GRASS))

    def _upload(self, index: int, image: UInt8, *, smaller: bool = True) -> None:
        """Give OpenGL the picture of texture `index`; MuJoCo made it with a few texels only."""
        opengl = gl()
        kind, form, unit = opengl.GL_TEXTURE_2D, opengl.GL_RGB, opengl.GL_UNSIGNED_BYTE
        opengl.glBindTexture(kind, int(self._drawing.texture[index]))
        opengl.glPixelStorei(opengl.GL_UNPACK_ALIGNMENT, 1)
        for level, picture in enumerate(mip_maps(image) if smaller else [image]):
            rows, columns = picture.shape[:2]
            opengl.glTexImage2D(kind, level, form, columns, rows, 0, form, unit, picture)
        if not smaller:
            opengl.glTexParameteri(kind, opengl.GL_TEXTURE_MIN_FILTER, opengl.GL_LINEAR)
        for name in (opengl.GL_TEXTURE_WRAP_S, opengl.GL_TEXTURE_WRAP_T):
            opengl.glTexParameteri(kind, name, opengl.GL_CLAMP_TO_EDGE)
        opengl.glTexParameterf(kind, opengl.GL_TEXTURE_LOD_BIAS, _SHARPER)

    def close(self) -> None:
        """Give OpenGL's memory back; a second call does nothing."""
        if self._context is not None:
            self._context.make_current()  # another stage's context may be
            self._drawing.free()
            self._context.free()
            self._context = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def _aim(camera: Any, view: View, eye: Float64, shift: float) -> None:
    """Set MuJoCo's camera: an off-centre frustum through the pixels' outer edges."""
    lens, turn = view.camera, view.level_from_optical
    camera.pos, camera.forward, camera.up = eye, turn[:, 2], -turn[:, 1]
    scale = _NEAR / lens.fx
    camera.frustum_center = scale * (0.5 * lens.width - 0.5 - lens.cx - shift)
    camera.frustum_top = scale * (lens.cy + 0.5)
    camera.frustum_bottom = scale * (lens.cy + 0.5 - lens.height)
    camera.frustum_near, camera.frustum_far = _NEAR, _SKY_END
    camera.orthographic = 0


def _shows(vertices: Float64, view: View) -> bool:
    """Return whether a mesh (K, 3) may reach into the picture of either camera.

    Not, if all of it lies outside one of the frustum's sides, with a baseline to spare.
    """
    lens = view.camera
    x, y, z = view.level_from_optical.T @ (vertices.T - view.position[:, None])
    shift = abs(lens.doffs) / lens.fx
    left, right = -(lens.cx + 1) / lens.fx - shift, (lens.width - lens.cx) / lens.fx + shift
    top, bottom = -(lens.cy + 1) / lens.fy, (lens.height - lens.cy) / lens.fy
    spare = lens.baseline
    inside = (z, x - left * z + spare, right * z - x + spare, y - top * z, bottom * z - y)
    return all(bool((side > 0).any()) for side in inside)


def _averted(facing: tuple[Float64, Float64] | None, view: View) -> bool:
    """Return whether a flat patch turns its back to both cameras."""
    if facing is None:
        return False
    point, normal = facing
    eyes = (view.position, view.right_position())
    return all(float(normal @ (eye - point)) <= 0.0 for eye in eyes)


def _drawn(model: Any, groups: tuple[int, ...]) -> Any:
    """Return the geoms of some groups, made ready to be drawn without lamps."""
    library = mujoco()
    data, option = library.MjData(model), library.MjvOption()
    library.mj_forward(model, data)
    option.geomgroup[:] = 0
    for group in groups:
        option.geomgroup[group] = 1
    drawn, free = library.MjvScene(model, maxgeom=model.ngeom + 8), library.MjvCamera()
    library.mjv_updateScene(model, data, option, None, free, library.mjtCatBit.mjCAT_ALL, drawn)
    for flag in ("mjRND_CULL_FACE", "mjRND_SHADOW", "mjRND_REFLECTION", "mjRND_SKYBOX"):
        drawn.flags[getattr(library.mjtRndFlag, flag)] = 0
    drawn.stereo = library.mjtStereo.mjSTEREO_SIDEBYSIDE
    return drawn


def _lawn(index: int, grass: Blades) -> _Mesh:
    return _Mesh(
        name=f"grass{index}",
        vertices=grass.vertices,
        faces=grass.faces,
        coordinates=np.stack([grass.tones, grass.up], axis=1),
        group=_GRASS,
    )


def _dome(eye: Float64) -> _Mesh:
    """Return the sky: rings of equal steps of its texture, from the nadir to the zenith."""
    share = np.concatenate([[-1.0, -0.7, -0.3], np.linspace(0.0, 1.0, 49)])
    sine = np.sign(share) * share**2
    angles = np.linspace(0.0, 2.0 * math.pi, _SECTORS + 1)
    flat = np.sqrt(1.0 - sine**2)
    vertices = [
        eye + _SKY * np.array([c * math.cos(angle), c * math.sin(angle), s])
        for s, c in zip(sine, flat, strict=True)
        for angle in angles
    ]
    rings = range(len(share))
    faces = []
    for low, high in pairwise(rings):
        for sector in range(_SECTORS):
            a, b = low * (_SECTORS + 1) + sector, high * (_SECTORS + 1) + sector
            faces += [(a, a + 1, b + 1), (a, b + 1, b)]
    v = np.repeat(np.maximum(share, 0.0), _SECTORS + 1)
    return _Mesh(
        name="sky",
        vertices=np.array(vertices),
        faces=np.array(faces, dtype=np.int32),
        coordinates=np.stack([np.full_like(v, 0.5), v], axis=1),
    )


def _compile(meshes: list[_Mesh], camera: Camera) -> Any:
    """Return the model: one geom, material and texture per mesh, which shine by themselves."""
    library = mujoco()
    spec = library.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 2 * camera.width, camera.height
    spec.visual.quality.offsamples = _SAMPLES
    spec.visual.quality.shadowsize = 0
    spec.visual.headlight.active = 0
    role = int(library.mjtTextureRole.mjTEXROLE_RGB)
    for mesh in meshes:
        spec.add_texture(
            name=mesh.name,
            type=library.mjtTexture.mjTEXTURE_2D,
            builtin=library.mjtBuiltin.mjBUILTIN_FLAT,
            width=_EMPTY,
            height=_EMPTY,
        )
        material = spec.add_material(name=mesh.name, emission=1.0, specular=0.0, shininess=0.0)
        material.textures[role] = mesh.name
        spec.add_mesh(
            name=mesh.name,
            uservert=mesh.vertices.reshape(-1),
            userface=mesh.faces.reshape(-1),
            usertexcoord=mesh.coordinates.reshape(-1),
            inertia=library.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
        spec.worldbody.add_geom(
            name=mesh.name,
            type=library.mjtGeom.mjGEOM_MESH,
            meshname=mesh.name,
            material=mesh.name,
            group=mesh.group,
            contype=0,
            conaffinity=0,
            mass=0.0,
        )
    return spec.compile()
