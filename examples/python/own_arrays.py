#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Own arrays of events and poses in, own.pcd out: own_arrays.py RECORDING (which stands for a driver and a tracker)."""

import sys

import event_fusion as ef

if len(sys.argv) < 2:
    sys.exit(__doc__)
recording = ef.open(sys.argv[1])
poses_t, T_world_rig = recording.poses  # nanoseconds (n,), and matrices (n, 4, 4)

mapper = ef.Mapper(on_keyframe=lambda keyframe: print("keyframe at", keyframe.t, "ns:", (keyframe.depth > 0).sum(), "depths"))
for camera in recording.rig:
    # T_rig_cam maps coordinates of the camera (x right, y down, z forward) to the rig.
    mapper.add_camera(
        ef.Camera(
            camera.width, camera.height, camera.K, camera.distortion, camera.coefficients, camera.T_rig_cam,
            camera.time_offset_ns,
        )
    )
mapper.add_poses(poses_t, T_world_rig)
for index in range(len(recording.rig)):
    for part in recording.events(index):
        x, y, p, t = part["x"], part["y"], part["p"], part["t"]
        mapper.add_events(index, ef.events(x, y, p, t, time_unit="ns"))
mapper.finish()
mapper.save("own.pcd")
print(len(mapper.points), "points in own.pcd")
