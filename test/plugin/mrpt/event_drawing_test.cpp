// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/CObservationEvents.h"

#include <gtest/gtest.h>
#include <mrpt/opengl/CPointCloudColoured.h>
#include <mrpt/opengl/CSetOfLines.h>
#include <mrpt/opengl/CSetOfObjects.h>

namespace efm {
namespace {

using mrpt::opengl::CPointCloudColoured;
using mrpt::opengl::CSetOfObjects;

/// 240 x 180 pixels, f = 200 and 150: a line of brighter events on the left, of darker ones on the
/// right.
CObservationEvents twoLines() {
  CObservationEvents packet;
  packet.camera = {240, 180, 200, 150, 119.5, 89.5, DistortionModel::kNone, {}};
  for (std::uint16_t y = 20; y < 160; ++y) {
    packet.events.push_back({1000 * y, 40, y, true});
    packet.events.push_back({1000 * y, 200, y, false});
  }
  return packet;
}

CPointCloudColoured::Ptr pointsOf(const CObservationEvents& packet) {
  const auto camera = packet.getVisualization()->getByClass<CSetOfObjects>();
  return camera->getByClass<CPointCloudColoured>();
}

TEST(EventDrawing, AnEventIsAPointOnTheImagePlaneInTheColourOfItsPolarity) {
  CObservationEvents packet = twoLines();
  for (const bool calibrated : {true, false}) {  // otherwise the focal length is the width
    if (!calibrated) packet.camera = {240, 180, 0, 0, 0, 0, DistortionModel::kNone, {}};
    const double fx = calibrated ? 200 : 240;
    const double fy = calibrated ? 150 : 240;
    const auto points = pointsOf(packet);
    ASSERT_EQ(points->size(), packet.events.size());
    EXPECT_NEAR(points->getPoint3Df(0).x, (40 - 119.5) / fx * kDrawnPlaneM, 1e-6);
    EXPECT_NEAR(points->getPoint3Df(0).y, (20 - 89.5) / fy * kDrawnPlaneM, 1e-6);
    EXPECT_EQ(points->getPoint3Df(0).z, kDrawnPlaneM);
    for (const int i : {0, 1}) {
      EXPECT_EQ(points->getPointColor(i).R, i == 0 ? 220 : 0);
      EXPECT_EQ(points->getPointColor(i).G, 0);
      EXPECT_EQ(points->getPointColor(i).B, i == 0 ? 0 : 220);
    }
    // From the camera to each corner of the image, and around it.
    const auto camera = packet.getVisualization()->getByClass<CSetOfObjects>();
    const auto lines = camera->getByClass<mrpt::opengl::CSetOfLines>();
    const std::vector<mrpt::math::TSegment3D> segments(lines->begin(), lines->end());
    ASSERT_EQ(segments.size(), 8U);
    const double x_m = 120 / fx * kDrawnPlaneM;
    const double y_m = 90 / fy * kDrawnPlaneM;
    const mrpt::math::TPoint3D corners[] = {{-x_m, -y_m, kDrawnPlaneM},
                                            {x_m, -y_m, kDrawnPlaneM},
                                            {x_m, y_m, kDrawnPlaneM},
                                            {-x_m, y_m, kDrawnPlaneM}};
    for (std::size_t i = 0; i < 4; ++i) {
      const auto& ray = segments[2 * i];
      const auto& edge = segments[2 * i + 1];
      EXPECT_EQ(ray.point1, mrpt::math::TPoint3D(0, 0, 0));
      EXPECT_LT((ray.point2 - corners[i]).norm(), 1e-6) << i;
      EXPECT_LT((edge.point1 - corners[i]).norm(), 1e-6) << i;
      EXPECT_LT((edge.point2 - corners[(i + 1) % 4]).norm(), 1e-6) << i;
    }
  }
  packet.events.clear();
  EXPECT_EQ(pointsOf(packet)->size(), 0U);
}

TEST(EventDrawing, IsDrawnAtTheCamerasPoseOnTheRig) {
  CObservationEvents packet = twoLines();
  packet.camera_pose = mrpt::poses::CPose3D(1, 2, 3, 0.1, 0.2, 0.3);
  const auto camera = packet.getVisualization()->getByClass<CSetOfObjects>();
  EXPECT_LT(mrpt::poses::CPose3D(camera->getPose()).distanceTo(packet.camera_pose), 1e-6);
  EXPECT_NEAR(camera->getPose().yaw, 0.1, 1e-6);
}

TEST(EventDrawing, OfALargePacketAnEvenSelectionOfEventsIsDrawn) {
  CObservationEvents packet = twoLines();
  packet.events.assign(3 * kMaxDrawnEvents, {0, 10, 10, true});
  for (std::size_t i = 0; i < packet.events.size(); i += 3) packet.events[i].polarity = false;
  const auto points = pointsOf(packet);
  ASSERT_EQ(points->size(), kMaxDrawnEvents);
  for (std::size_t i = 0; i < points->size(); ++i) ASSERT_EQ(points->getPointColor(i).B, 220) << i;
}

}  // namespace
}  // namespace efm
