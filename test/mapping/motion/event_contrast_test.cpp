// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion/event_contrast.h"

#include <gtest/gtest.h>

#include <vector>

#include "test/mapping/keyframes/random_scene.h"

namespace efm::event_contrast_test {
namespace {

constexpr int kPatchPx = 16;
const cv::Size kView(60, 45);

std::vector<std::vector<WarpedEvent>> randomEvents(std::uint32_t seed, int cameras, int count) {
  test::RandomScene random(seed);
  std::vector<std::vector<WarpedEvent>> events(static_cast<std::size_t>(cameras));
  for (auto& some : events) {
    for (int i = 0; i < count; ++i) {
      WarpedEvent event;
      event.pixel = Eigen::Vector2d(random.uniform(2, 57), random.uniform(2, 42)).cast<float>();
      for (int j = 0; j < 12; ++j) {
        event.by_velocity(j / 6, j % 6) = static_cast<float>(random.uniform(-1, 1));
      }
      event.by_inverse_depth =
          Eigen::Vector2d(random.uniform(-1, 1), random.uniform(-1, 1)).cast<float>();
      some.push_back(event);
    }
  }
  return events;
}

TEST(EventContrast, TheGradientIsTheNumericOne) {
  for (int cameras = 1; cameras <= 3; ++cameras) {
    const auto events = randomEvents(7, cameras, 300);
    EventContrast contrast(events, kView, kPatchPx);
    contrast.setBlur(1.5);
    Eigen::VectorXd gradient;
    Eigen::VectorXd unused;
    const Eigen::VectorXd place = Eigen::VectorXd::Constant(contrast.variables(), 0.01);
    contrast.at(place, gradient);
    for (Eigen::Index i = 0; i < contrast.variables(); ++i) {
      // Large against the rounding of floats; small against the pixels that events cross, where
      // bilinear images have kinks, which smoothing hardly leaves to be seen.
      constexpr double kStep = 5e-3;
      Eigen::VectorXd step = Eigen::VectorXd::Zero(contrast.variables());
      step[i] = kStep;
      const double numeric =
          (contrast.at(place + step, unused) - contrast.at(place - step, unused)) / (2 * kStep);
      EXPECT_NEAR(gradient[i], numeric, 0.02 * gradient.head<6>().norm())
          << cameras << " cameras, variable " << i;
    }
  }
}

TEST(EventContrast, EventsInOnePositionAreSharperThanSeparateOnes) {
  auto together = randomEvents(8, 2, 100);
  for (auto& some : together) {
    for (WarpedEvent& event : some) event.pixel = {30, 20};
  }
  const auto apart = randomEvents(8, 2, 100);
  Eigen::VectorXd gradient;
  const EventContrast one(together, kView, kPatchPx);
  const EventContrast other(apart, kView, kPatchPx);
  EXPECT_GT(one.at(Eigen::VectorXd::Zero(one.variables()), gradient),
            10 * other.at(Eigen::VectorXd::Zero(other.variables()), gradient));
}

TEST(EventContrast, CamerasMustMeet) {
  auto events = randomEvents(9, 2, 100);
  for (WarpedEvent& event : events[0]) event.pixel = {20, 20};
  for (WarpedEvent& event : events[1]) event.pixel = {20, 20};
  Eigen::VectorXd gradient;
  const EventContrast meeting(events, kView, kPatchPx);
  const double contrast = meeting.at(Eigen::VectorXd::Zero(meeting.variables()), gradient);
  for (WarpedEvent& event : events[1]) event.pixel = {40, 20};
  const EventContrast missing(events, kView, kPatchPx);
  EXPECT_GT(contrast, 0);
  EXPECT_EQ(missing.at(Eigen::VectorXd::Zero(missing.variables()), gradient), 0);
  EXPECT_TRUE(gradient.isZero());
}

TEST(EventContrast, OnlyPatchesWithEventsAreVariables) {
  auto events = randomEvents(10, 2, 3);
  for (WarpedEvent& event : events[0]) event.pixel = {5, 5};
  for (WarpedEvent& event : events[1]) event.pixel = {50, 40};
  const EventContrast contrast(events, kView, kPatchPx);
  EXPECT_EQ(contrast.variables(), 8);
  EXPECT_EQ(contrast.eventsInPatch(), (std::vector<std::size_t>{3, 3}));
}

}  // namespace
}  // namespace efm::event_contrast_test
