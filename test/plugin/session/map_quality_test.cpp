// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/map_quality.h"

#include <gmock/gmock.h>

#include <functional>
#include <string>
#include <vector>

namespace efm {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

/// A wall, seen from 0.1 m farther along x each time.
struct Wall {
  std::vector<double> depths_m = {2, 2.1, 2, 2.05};  // of the keyframes
  double parallax_px_m = 8;
  float probability = 0.99F;
  std::uint64_t at_farthest = 300;  // of 1000 pixels
  QualityFacts facts{};
  std::size_t num_cameras = 2;

  MapQuality quality() const {
    QualityStatistics statistics;
    int number = 0;
    for (const double depth_m : depths_m) {
      KeyframeDepthMap keyframe;
      keyframe.view = {64, 48, 50, 50, 31.5, 23.5};
      keyframe.T_world_ref.translation.x() = 0.1 * number++;
      keyframe.map.depth = cv::Mat1f(48, 64, static_cast<float>(depth_m));
      keyframe.map.variance = cv::Mat1f(48, 64, 1e-4F);
      keyframe.map.probability = cv::Mat1f(48, 64, probability);
      keyframe.map.pixels = {1000, 0, at_farthest, 0};
      keyframe.parallax_px_m = parallax_px_m;
      statistics.add(statistics.judge(keyframe, facts));
    }
    return statistics.quality(facts, {}, num_cameras);
  }
};

TEST(MapQuality, IsGoodWithEvidenceAndSaysWhyItIsNot) {
  const struct {
    const char* name;
    std::function<void(Wall&)> change;
    QualityWord word;
    const char* reason;
  } kWalls[] = {
      {"right", [](Wall&) {}, QualityWord::kGood, ""},
      {"keyframes that differ",
       [](Wall& w) {
         w.depths_m = {2, 2.5, 2, 2.5};
       },
       QualityWord::kWrong, "agree within 10 % in 0 % of the"},
      {"no parallax", [](Wall& w) { w.parallax_px_m = 2.8; }, QualityWord::kDoubtful,
       "parallax of the scene is 1.4 px"},
      {"little parallax, but keyframes confirm it", [](Wall& w) { w.parallax_px_m = 3.4; },
       QualityWord::kGood, ""},
      {"beyond the limit", [](Wall& w) { w.at_farthest = 500; }, QualityWord::kDoubtful,
       "50 % to the farthest, 5 m"},
      {"not sure", [](Wall& w) { w.probability = 0.93F; }, QualityWord::kWrong,
       "not sure by themselves"},
      {"one camera's keyframe", [](Wall& w) { w.depths_m = {2}, w.num_cameras = 1; },
       QualityWord::kDoubtful, "a second camera, 1.5 s or more, or motion sideways would help"},
      {"one camera", [](Wall& w) { w.num_cameras = 1; }, QualityWord::kGood, ""},
      {"one camera, poses not checked",
       [](Wall& w) { w.num_cameras = 1, w.facts.unchecked = "the poses could not be checked"; },
       QualityWord::kDoubtful, "could not be checked"},
      {"two cameras, poses not checked",
       [](Wall& w) { w.facts.unchecked = "the poses could not be checked"; },
       QualityWord::kDoubtful, "could not be checked"},
      {"a wrong calibration", [](Wall& w) { w.facts.sure_depth_m = 1.99; }, QualityWord::kWrong,
       "calibration between cameras makes 100 %"},
      {"a mistake", [](Wall& w) { w.facts.mistake = "scale"; }, QualityWord::kDoubtful,
       "see the warning scale"},
  };
  for (const auto& row : kWalls) {
    Wall wall;
    row.change(wall);
    const MapQuality quality = wall.quality();
    SCOPED_TRACE(row.name + (": " + textOf(quality)));
    EXPECT_EQ(quality.word, row.word);
    if (*row.reason == '\0') {
      EXPECT_THAT(quality.reasons, IsEmpty());
    } else {
      EXPECT_THAT(quality.reasons, Contains(HasSubstr(row.reason)));
    }
    EXPECT_EQ(quality.keyframes.size(), wall.depths_m.size());
  }
  EXPECT_EQ(QualityStatistics().quality({}, {}, 2).word, QualityWord::kUnknown);
}

TEST(MapQuality, NamesTheKeyframesThatAreMuchWorse) {
  Wall wall;
  wall.depths_m = {2, 2.05, 3, 2.1, 2, 2.05, 2, 2.05};
  const MapQuality quality = wall.quality();
  EXPECT_THAT(quality.reasons, Contains(HasSubstr("keyframe 3: much worse than the others")));
  for (std::size_t i = 0; i < quality.keyframes.size(); ++i) {
    EXPECT_EQ(quality.keyframes[i] < 0.5F, i == 2) << i;
  }
}

}  // namespace
}  // namespace efm
