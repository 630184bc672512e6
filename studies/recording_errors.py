# SPDX-License-Identifier: BSD-3-Clause
"""Errors of real recordings, for simulated ones: poses that sway, noise, a wrong calibration. The truth stays."""

import numpy as np
from rotations import rotations

import event_fusion as ef


def with_sway(recording, metres, degrees):
    """Return the recording with poses that sway around the true ones: a sine of about 1 Hz on each axis."""
    times, poses = recording.poses
    seconds = 1e-9 * (times - recording.simulation.start)[:, None]

    def sines(hz, phase):
        return np.sin(2 * np.pi * seconds * hz + phase + np.arange(3))

    swaying = poses.copy()
    swaying[:, :3, 3] += metres * sines(np.array([1, 1.3, 0.8]), 0)
    swaying[:, :3, :3] = poses[:, :3, :3] @ rotations(np.radians(degrees) * sines(np.array([0.9, 1.1, 1]), 0.5))
    return recording.but(poses=(times, swaying))


def with_noise(recording, hz, seed=1):
    """Return the recording with noise of a rate in every pixel, from NumPy's random numbers."""
    random, start, end, noisy = np.random.default_rng(seed), recording.simulation.start, recording.simulation.end, []
    for camera, clean in zip(recording.cameras, recording.events):
        noise = np.zeros(random.poisson(hz * camera.width * camera.height * 1e-9 * (end - start)), clean.dtype)
        for field, least, most in (("t", start, end), ("x", 0, camera.width), ("y", 0, camera.height), ("p", 0, 2)):
            noise[field] = random.integers(least, most, len(noise))
        both = np.concatenate([clean, noise])
        noisy.append(both[np.argsort(both["t"], kind="stable")])
    return recording.but(events=noisy)


def with_rotated_right(recording, radians):
    """Return the recording with the right camera rotated about its vertical axis: a wrong calibration."""
    left, right = recording.cameras
    turn = np.eye(4)
    turn[:3, :3] = rotations(np.array([[0, radians, 0]]))[0]
    lens = right.width, right.height, right.K, right.distortion, right.coefficients
    return recording.but(cameras=[left, ef.Camera(*lens, right.T_rig_cam @ turn)])
