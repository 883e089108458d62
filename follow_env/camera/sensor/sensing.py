"""`RGBDSensing`: what arrives of the camera's pictures."""

from collections.abc import Callable

import numpy as np

from follow_env.camera import PinholeCamera, RGBDFrame
from follow_env.camera.measurement import GaussMarkov
from follow_env.camera.sensor.errors import RGBDSensor
from follow_env.sensors import BoxConfig, SensorConfig


class RGBDSensing:
    """Pictures with the sensor's errors, some of them dropped, and the box of the person in them.

    The count of random numbers that a picture takes does not depend on what is seen.

    Args:
        config: all errors.
        camera: the intrinsics.
        dt: control period, s.
        boxes: whether the person's box is wanted.
    """

    def __init__(self, config: SensorConfig, camera: PinholeCamera, dt: float, boxes: bool) -> None:
        self.config = config
        self._camera, self._dt, self._boxes = camera, dt, boxes
        self._sensor = RGBDSensor(config.depth, config.color, camera)
        self.restart()

    def restart(self) -> None:
        """Forget the last episode."""
        self._latest: tuple[RGBDFrame, float] | None = None
        self._box_error = GaussMarkov(4, self.config.box.correlation_s, self._dt)

    def sense(
        self, draw: Callable[[], RGBDFrame], time: float, rng: np.random.Generator
    ) -> tuple[RGBDFrame, np.ndarray, float]:
        """Return the latest frame, the person's jittered box (zeros if not detected) and when the frame was taken.

        Args:
            draw: renders the true frame; not called when the picture is dropped.
            time: of this moment, s.
            rng: the environment's generator.
        """
        seed = int(rng.integers(1 << 64, dtype=np.uint64))
        dropped = float(rng.random()) < self.config.frames.drop_share
        errors = self._box_error.step(rng)
        if dropped and self._latest is not None:
            frame, taken = self._latest
            return _copy(frame), np.zeros(4, np.float32), taken
        truth = draw()
        frame = self._sensor.corrupt(truth, seed)
        if self.config.frames.drop_share > 0.0:
            self._latest = _copy(frame), time  # the caller may write into what was observed
        tight = truth.person_box(self.config.box.min_pixels) if self._boxes else None
        if tight is None:
            return frame, np.zeros(4, np.float32), time
        return frame, _jittered(tight, errors, self.config.box, self._camera), time


def _jittered(
    tight: tuple[float, float, float, float], errors: list[float], config: BoxConfig, camera: PinholeCamera
) -> np.ndarray:
    u0, v0, u1, v1 = tight
    width, height = u1 - u0, v1 - v0
    u = 0.5 * (u0 + u1) + config.center_jitter * errors[0] * width
    v = 0.5 * (v0 + v1) + config.center_jitter * errors[1] * height
    half_w = 0.5 * width * max(1.0 + config.size_jitter * errors[2], 0.2)
    half_h = 0.5 * height * max(1.0 + config.size_jitter * errors[3], 0.2)
    limit_u, limit_v = float(camera.width), float(camera.height)
    corners = (
        min(max(u - half_w, 0.0), limit_u),
        min(max(v - half_h, 0.0), limit_v),
        min(max(u + half_w, 0.0), limit_u),
        min(max(v + half_h, 0.0), limit_v),
    )
    return np.array(corners, np.float32)


def _copy(frame: RGBDFrame) -> RGBDFrame:
    return RGBDFrame(frame.rgb.copy(), frame.depth.copy(), frame.ids)
