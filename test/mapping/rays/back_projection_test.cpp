// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/rays/rays.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "test/mapping/keyframes/random_scene.h"

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
        // Coordinates on the plane at infinity are floats, and computed in them.
        EXPECT_NEAR((transferred - exact).norm(), 0, 2e-6 * (10 + exact.norm()));
      }
    }
  }
}

/// A camera with a sensor of 1280 x 720 pixels.
struct HdCamera {
  CameraModel model{1280,
                    720,
                    905.0,
                    904.0,
                    641.3,
                    357.8,
                    DistortionModel::kRadtan,
                    {-0.09, 0.06, 0.0004, -0.0003}};
  UndistortionTable undistortion{model};
  ReferenceView view = ReferenceView::of(model);
};

TEST(BackProjection, FloatsAreOffByLessThanAThousandthOfAPixelAtHd) {
  const HdCamera hd;
  const std::vector<Event> events = onePerPixel(hd.model);
  RandomScene random(2);
  for (int trial = 0; trial < 4; ++trial) {
    const Rigid3 T_ref_cam = random.pose(0.4, 0.3);
    const RayBundle rays =
        backProject(events, {{{0, events.size(), T_ref_cam}}, 0}, hd.undistortion, hd.view);
    ASSERT_EQ(rays.size(), events.size());
    double largest_px = 0;
    for (std::size_t i = 0; i < events.size(); ++i) {
      const Eigen::Vector3d ray_cam = hd.undistortion.ray(events[i].x, events[i].y).homogeneous();
      const Eigen::Vector2d exact = hd.view.project(T_ref_cam.rotation * ray_cam);
      const bool in_view = exact.x() >= 0 && exact.x() < hd.view.width && exact.y() >= 0 &&
                           exact.y() < hd.view.height;
      if (!in_view) continue;
      const Eigen::Vector2d computed(rays.x_inf[i], rays.y_inf[i]);
      largest_px = std::max(largest_px, (computed - exact).norm());
    }
    // Six roundings of 2^-24 each, of numbers up to 1280: 5e-4 where they all add up. A thousandth
    // is a twentieth of the error that sharing poses may cause.
    EXPECT_LT(largest_px, 1e-3);
    EXPECT_GT(largest_px, 1e-6) << "something was compared";
  }
}

TEST(BackProjection, RaysParallelToThePlanesAreNotFinite) {
  CameraModel model = test::smallCamera();
  model.distortion = DistortionModel::kNone;
  model.coefficients.clear();
  model.cx = 20;  // this column looks along z exactly
  // Half a rotation around (x + z) maps the z axis to the x axis.
  const Rigid3 T_ref_cam{Eigen::Quaterniond(0, std::sqrt(0.5), 0, std::sqrt(0.5)),
                         Eigen::Vector3d::Zero()};
  const std::vector<Event> events = onePerPixel(model);
  PosePackets packets{{{0, events.size(), T_ref_cam}}, 0};
  packets.packets[0].T_ref_cam.rotation.normalize();
  const RayBundle rays =
      backProject(events, packets, UndistortionTable(model), ReferenceView::of(model));
  EXPECT_EQ(rays.size(), events.size());
  const auto far_away = [](float x) { return !(std::abs(x) < 1e6F); };
  EXPECT_EQ(std::count_if(rays.x_inf.begin(), rays.x_inf.end(), far_away), model.height);
}

TEST(BackProjection, OfPlanesThoseBeforeTheCameraAlongItsRaysAreInFront) {
  const ReferenceView view = ReferenceView::of(test::smallCamera());
  for (const bool forward : {true, false}) {
    const RayPacket packet{0, 1, {0.1, 0.2, 1.0}, forward};
    EXPECT_FALSE(transferToPlane(packet, view, 1.0).in_front) << "on the plane";
    EXPECT_EQ(transferToPlane(packet, view, 1.0 + 1e-9).in_front, forward);
    EXPECT_EQ(transferToPlane(packet, view, 1.0 - 1e-9).in_front, !forward);
  }
}

TEST(BackProjection, RaysAreThoseOfTheLensInOrderForwardBeforeBackwardOfEachPacket) {
  RandomScene random(3);
  int split = 0;
  for (const CameraModel& model : {test::smallCamera(), test::foldingCamera()}) {
    const UndistortionTable undistortion(model);
    const ReferenceView view = ReferenceView::of(model);
    const std::vector<Event> events = onePerPixel(model);
    for (int trial = 0; trial < 20; ++trial) {
      // Events between the packets have no pose.
      const double most_rad = trial < 5 ? 0.2 : M_PI;
      const PosePackets packets{
          {{0, 700, random.pose(0.4, most_rad)}, {900, 1700, random.pose(0.4, most_rad)}}, 228};
      const RayBundle rays = backProject(events, packets, undistortion, view);
      std::vector<Eigen::Vector2d> expected;
      std::vector<RayPacket> expected_packets;
      for (const PosePacket& packet : packets.packets) {
        for (const bool forward : {true, false}) {
          const std::size_t begin = expected.size();
          for (std::size_t i = packet.begin; i < packet.end; ++i) {
            if (!undistortion.hasRay(events[i].x, events[i].y)) continue;
            const Eigen::Vector3d direction =
                packet.T_ref_cam.rotation *
                undistortion.ray(events[i].x, events[i].y).homogeneous();
            if ((direction.z() < 0) != forward) expected.push_back(view.project(direction));
          }
          if (expected.size() == begin) continue;
          expected_packets.push_back(
              {begin, expected.size(), packet.T_ref_cam.translation, forward});
        }
      }
      split += expected_packets.size() > 2 ? 1 : 0;
      ASSERT_EQ(rays.packets.size(), expected_packets.size());
      for (std::size_t p = 0; p < expected_packets.size(); ++p) {
        EXPECT_EQ(rays.packets[p].begin, expected_packets[p].begin);
        EXPECT_EQ(rays.packets[p].end, expected_packets[p].end);
        EXPECT_EQ(rays.packets[p].forward, expected_packets[p].forward);
        EXPECT_EQ(rays.packets[p].center_ref, expected_packets[p].center_ref);
      }
      ASSERT_EQ(rays.size(), expected.size());
      for (std::size_t i = 0; i < expected.size(); ++i) {
        EXPECT_NEAR(rays.x_inf[i], expected[i].x(), 1e-6 * (10 + expected[i].squaredNorm()));
        EXPECT_NEAR(rays.y_inf[i], expected[i].y(), 1e-6 * (10 + expected[i].squaredNorm()));
      }
    }
  }
  EXPECT_GT(split, 5) << "some packets look both ways";
}

}  // namespace
}  // namespace efm
