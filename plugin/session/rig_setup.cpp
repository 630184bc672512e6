// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/rig_setup.h"

#include "plugin/recordings/calibration/hand_eye_file.h"

namespace efm {

RigSetup readRigSetup(const RigOptions& options) {
  RigSetup setup;
  if (!options.calibration.empty()) setup.calibration = readCalibration(options.calibration);
  if (!options.hand_eye.empty()) {
    setup.T_body_rig =
        readHandEye(options.hand_eye, setup.calibration ? &*setup.calibration : nullptr);
  }
  return setup;
}

}  // namespace efm
