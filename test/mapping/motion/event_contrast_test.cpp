// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion/event_contrast.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
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

TEST(EventContrast, IsTheSquareOfTheHarmonicMeanOfSmoothImages) {
  // One, two and three events of three cameras in one place: inside, and in the corners of the
  // view.
  WarpedEvent event;
  event.by_velocity.setZero();
  event.by_inverse_depth.setZero();
  for (const cv::Point& pixel : {cv::Point(30, 20), {0, 0}, {kView.width - 2, kView.height - 2}}) {
    event.pixel = {static_cast<float>(pixel.x) + 0.25F, static_cast<float>(pixel.y) + 0.5F};
    const std::vector<std::vector<WarpedEvent>> events = {
        {event}, std::vector<WarpedEvent>(2, event), std::vector<WarpedEvent>(3, event)};
    cv::Mat1f image = cv::Mat1f::zeros(kView);
    image.col(pixel.x).rowRange(pixel.y, pixel.y + 2) = 0.375F;
    image.col(pixel.x + 1).rowRange(pixel.y, pixel.y + 2) = 0.125F;
    for (const double blur_px : {1.0, 2.0}) {
      EventContrast contrast(events, kView, kPatchPx);
      contrast.setBlur(blur_px);
      const int side = blur_px == 1 ? 7 : 13;  // three standard deviations to either side
      cv::Mat1f smooth;
      cv::GaussianBlur(image, smooth, {side, side}, blur_px, blur_px, cv::BORDER_CONSTANT);
      Eigen::VectorXd gradient;
      const double mean = 3 / (1.0 + 1.0 / 2 + 1.0 / 3);
      EXPECT_NEAR(contrast.at(Eigen::VectorXd::Zero(contrast.variables()), gradient),
                  mean * mean * smooth.dot(smooth), 1e-3 * smooth.dot(smooth))
          << pixel;
      EXPECT_TRUE(gradient.isZero());
    }
  }
}

TEST(EventContrast, CamerasMustMeet) {
  auto events = randomEvents(9, 2, 100);
  for (WarpedEvent& event : events[0]) event.pixel = {20, 20};
  for (WarpedEvent& event : events[1]) event.pixel = {40, 20};
  Eigen::VectorXd gradient;
  const EventContrast missing(events, kView, kPatchPx);
  EXPECT_EQ(missing.at(Eigen::VectorXd::Zero(missing.variables()), gradient), 0);
  EXPECT_TRUE(gradient.isZero());
}

TEST(EventContrast, OnlyPatchesWithEventsAreVariables) {
  auto events = randomEvents(10, 2, 8);
  const Eigen::Vector2f pixels[] = {{5, 5},   {15.9F, 5}, {16, 5},  {5, 16},
                                    {-3, -3}, {99, 99},   {59, 44}, {46, 44}};
  for (std::size_t i = 0; i < 8; ++i) {
    events[0][i].pixel = pixels[i];
    events[1][i].pixel = {20, 5};
  }
  const EventContrast contrast(events, kView, kPatchPx);
  EXPECT_EQ(contrast.variables(), 6 + 5);
  EXPECT_EQ(contrast.eventsInPatch(), (std::vector<std::size_t>{3, 1 + 8, 1, 2, 1}));
}

}  // namespace
}  // namespace efm::event_contrast_test
