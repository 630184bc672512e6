// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "test/plugin/program_test.h"
#include "tracking_stub/poses/tum_trajectory.h"

namespace efm {

/// `event-fusion map` and `depth` on a synthetic recording.
class MapCommand : public ProgramTest {
 protected:
  nlohmann::json reportIn(const std::string& name) const {
    return nlohmann::json::parse(contentOf(name + "/report.json"));
  }
  std::vector<StampedPose> posesIn(const std::string& name,
                                   const std::string& file = "trajectory.txt") const {
    return readTumTrajectory(folder() / name / file);
  }
  cv::Mat image(const std::filesystem::path& file) const {
    return cv::imread((folder() / file).string(), cv::IMREAD_UNCHANGED);
  }
};

}  // namespace efm
