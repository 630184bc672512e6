// SPDX-License-Identifier: BSD-3-Clause
// A real rig's calibration on its real, smoothed trajectory through a simulated room, as a user
// runs it: simulate, map with the rig's own option file, compare with the exact truth.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>

#include "mapping/geometry/depth_planes.h"
#include "plugin/evaluation/depth_evaluation.h"
#include "test/paths.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

class RealRig : public TemporaryFolder {
 protected:
  int run(const std::string& arguments) const {
    const std::string command = "cd '" + folder().string() + "' && '" EFM_EVENT_FUSION "' " +
                                arguments + " >output.txt 2>&1 </dev/null";
    return std::system(command.c_str());
  }
};

TEST_F(RealRig, MvsecsDroneMapsASimulatedRoom) {
  const std::filesystem::path data = EFM_SHARED_DATA;
  const auto trajectory = data / "trajectories" / "mvsec_indoor_flying1.txt";
  const auto calibration = data / "calibration" / "mvsec" / "camchain.yaml";
  if (!exists(trajectory) || !exists(calibration)) {
    GTEST_SKIP() << "there is no real trajectory at " << trajectory;
  }
  ASSERT_EQ(run("simulate --scene room --trajectory '" + trajectory.string() + "' --calibration '" +
                calibration.string() + "' --duration 2.1 --out room"),
            0);
  ASSERT_EQ(run("map '" EFM_SOURCE_DIR "/config/davis346_mvsec.ini' room --out out"), 0);

  DepthEvaluationOptions options;
  options.pairing.tolerance_px = 1;
  const DepthEvaluation evaluation = evaluateDepth(folder() / "out", folder() / "room", options);
  ASSERT_EQ(evaluation.maps.size(), 2U);
  EXPECT_GT(evaluation.all.points, 4000U);
  const double step = DepthPlanes({1, 6.5, 100, PlaneSpacing::kInverse}).inverseDepthStep();
  const double error_steps = evaluation.all.median_inverse / step;
  std::cout << "median inverse depth error: " << error_steps << " plane steps of "
            << evaluation.all.points << " points\n";
  // Half the points within one plane: what the planes can tell.
  EXPECT_LE(error_steps, 1);
}

}  // namespace
}  // namespace efm
