// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/back_projection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "test/mapping/random_scene.h"

namespace efm {
namespace {

using test::RandomScene;

std::vector<Event> onePerPixel(const CameraModel& model) {
  std::vector<Event> events;
  for (int y = 0; y < model.height; ++y) {
    for (int x = 0; x < model.width; ++x) {
      events.push_back({0, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), true});
    }
  }
  return events;
}

TEST(BackProjection, TheTransferMeetsEveryPlaneWhereTheRayItselfDoes) {
  const CameraModel model = test::smallCamera();
  const UndistortionTable undistortion(model);
  const ReferenceView view = ReferenceView::of(model);
  const std::vector<Event> events = onePerPixel(model);
  RandomScene random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Rigid3 T_ref_cam = random.pose(0.4, 0.5);
    const RayBundle rays =
        backProject(events, {{{0, events.size(), T_ref_cam}}, 0}, undistortion, view);
    ASSERT_EQ(rays.packets.size(), 1U);
    for (const double depth_m : {0.5, 1.0, 5.0, 80.0}) {
      const PlaneTransfer transfer = transferToPlane(rays.packets[0], view, depth_m);
      EXPECT_TRUE(transfer.in_front);
      for (std::size_t i = 0; i < events.size(); ++i) {
        const Eigen::Vector3d direction =
            T_ref_cam.rotation * undistortion.ray(events[i].x, events[i].y).homogeneous();
        const double along = (depth_m - T_ref_cam.translation.z()) / direction.z();
        const Eigen::Vector2d exact = view.project(T_ref_cam.translation + along * direction);
        const Eigen::Vector2d transferred(transfer.scale * rays.x_inf[i] + transfer.offset_x,
                                          transfer.scale * rays.y_inf[i] + transfer.offset_y);
        // Coordinates on the plane at infinity are floats.
        EXPECT_NEAR((transferred - exact).norm(), 0, 1e-6 * (10 + exact.norm()));
      }
    }
  }
}

TEST(BackProjection, ACameraCentreOnAPlaneIsNoSpecialCaseForTheOthers) {
  const CameraModel model = test::smallCamera();
  const ReferenceView view = ReferenceView::of(model);
  const RayPacket packet{0, 1, {0.1, 0.2, 1.0}, true};
  const PlaneTransfer on_plane = transferToPlane(packet, view, 1.0);
  EXPECT_FALSE(on_plane.in_front);
  EXPECT_TRUE(transferToPlane(packet, view, 1.0 + 1e-9).in_front);
  EXPECT_FALSE(transferToPlane(packet, view, 0.5).in_front);
}

TEST(BackProjection, ACameraThatLooksBackSeesThePlanesBehindIt) {
  const CameraModel model = test::smallCamera();
  const ReferenceView view = ReferenceView::of(model);
  // 3 m ahead of the reference view, looking back at it.
  const Rigid3 T_ref_cam{Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitY())),
                         {0, 0, 3}};
  const std::vector<Event> events = onePerPixel(model);
  const RayBundle rays =
      backProject(events, {{{0, events.size(), T_ref_cam}}, 0}, UndistortionTable(model), view);
  ASSERT_EQ(rays.packets.size(), 1U);
  EXPECT_FALSE(rays.packets[0].forward);
  EXPECT_TRUE(transferToPlane(rays.packets[0], view, 1.0).in_front);
  EXPECT_FALSE(transferToPlane(rays.packets[0], view, 4.0).in_front);
}

TEST(BackProjection, APacketThatLooksBothWaysIsSplit) {
  const CameraModel model = test::smallCamera();
  const ReferenceView view = ReferenceView::of(model);
  const Rigid3 T_ref_cam{Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY())),
                         {0, 0, 0}};
  const std::vector<Event> events = onePerPixel(model);
  const RayBundle rays =
      backProject(events, {{{0, events.size(), T_ref_cam}}, 0}, UndistortionTable(model), view);
  ASSERT_EQ(rays.packets.size(), 2U);
  EXPECT_TRUE(rays.packets[0].forward);
  EXPECT_FALSE(rays.packets[1].forward);
  EXPECT_EQ(rays.packets[1].begin, rays.packets[0].end);
  EXPECT_EQ(rays.packets[1].end, events.size());
}

TEST(BackProjection, EventsBetweenPacketsAreLeftOut) {
  const CameraModel model = test::smallCamera();
  const std::vector<Event> events = onePerPixel(model);
  const RayBundle rays = backProject(events, {{{10, 20, {}}, {30, 35, {}}}, 15},
                                     UndistortionTable(model), ReferenceView::of(model));
  EXPECT_EQ(rays.size(), 15U);
  ASSERT_EQ(rays.packets.size(), 2U);
  EXPECT_EQ(rays.packets[1].begin, 10U);
  EXPECT_EQ(rays.packets[1].end, 15U);
}

}  // namespace
}  // namespace efm
