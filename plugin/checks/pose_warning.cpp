// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/checks/health_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mapping/base/named_choice.h"
#include "mapping/geometry/timestamp.h"

namespace efm {

std::string offsetsText(const Rig& rig, std::optional<std::size_t> camera, double shift_s) {
  std::string text;
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    const double offset_s =
        secondsBetween(0, rig.cameras[c].time_offset_ns) + (camera.value_or(c) == c ? shift_s : 0);
    text += (text.empty() ? "" : ",") + fmt::format("{:.3f}", offset_s);
  }
  return text;
}

namespace {

constexpr NamedChoice<PoseMistake> kNames[] = {{PoseMistake::kInverted, "poses-inverted"},
                                               {PoseMistake::kQuaternionOrder, "quaternion-order"},
                                               {PoseMistake::kCamerasSwapped, "cameras-swapped"},
                                               {PoseMistake::kStereoInverted, "cameras-swapped"},
                                               {PoseMistake::kAxes, "axis-convention"},
                                               {PoseMistake::kTimeShift, "time-shift"},
                                               {PoseMistake::kCameraClock, "camera-clocks"},
                                               {PoseMistake::kMirrored, "events-mirrored"},
                                               {PoseMistake::kPixels, "sensor-area"},
                                               {PoseMistake::kUnknown, "poses-unexplained"}};

/// Returns the axes of the rig as axes of the body: "-y, -z, x".
std::string axesText(const Eigen::Matrix3d& R_body_rig) {
  std::string text;
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) {
      if (std::abs(R_body_rig(row, column)) < 0.5) continue;
      text += column > 0 ? ", " : "";
      text += R_body_rig(row, column) < 0 ? "-" : "";
      text += "xyz"[row];
    }
  }
  return text;
}

std::string matrixText(const Eigen::Matrix3d& R_body_rig) {
  std::string text = "[";
  for (int row = 0; row < 3; ++row) {
    text += fmt::format("[{:g}, {:g}, {:g}, 0], ", R_body_rig(row, 0) + 0.0,
                        R_body_rig(row, 1) + 0.0, R_body_rig(row, 2) + 0.0);
  }
  return text + "[0, 0, 0, 1]]";
}

std::string mirrorText(const PixelChange& pixels) {
  if (pixels.exchange) {
    return "columns and rows exchanged; x and y of the events are in the wrong order "
           "(--event-columns)";
  }
  return fmt::format(
      "{0} mirrored; either a driver or a mirror turned the picture over, which must be undone in "
      "the recording, because no calibration describes it; or the poses are of a left-handed frame "
      "(Unity, Unreal, AirSim), whose {1} axis must be turned: {1}, q{2} and q{3} with the other "
      "sign",
      pixels.mirror_x ? "columns" : "rows", pixels.mirror_x ? "x" : "y",
      pixels.mirror_x ? "y" : "x", "z");
}

/// Returns the intrinsics that fit the pixels of the events, of the cameras whose pixels differ.
std::string pixelText(const PixelChange& pixels, const Rig& rig) {
  std::string text;
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    const Eigen::Vector2i& offset = pixels.offset_px[c];
    if (offset.isZero()) continue;
    const CameraModel& m = rig.cameras[c].model;
    text +=
        fmt::format("{}fx fy cx cy = {:g} {:g} {:g} {:g} of camera {}", text.empty() ? "" : ", ",
                    m.fx, m.fy, m.cx - offset.x(), m.cy - offset.y(), c);
  }
  return "if their pictures are cropped or moved; the calibration must be of the pixels that the "
         "events have: " +
         text + " (--calibration)";
}

std::string remedyOf(const PoseFinding& finding, const Rig& rig) {
  switch (finding.mistake) {
    case PoseMistake::kInverted:
      return "with each pose inverted; the poses must be T_world_rig, from the rig to the world "
             "(--poses)";
    case PoseMistake::kQuaternionOrder:
      return "with the quaternions read as qw qx qy qz; the order must be qx qy qz qw, or a header "
             "must name the columns (--poses)";
    case PoseMistake::kCamerasSwapped:
      return "with the events of cameras 0 and 1 exchanged; their files or the cameras of the "
             "calibration are in the wrong order (--calibration)";
    case PoseMistake::kStereoInverted:
      return "with the transform between cameras 0 and 1 inverted; T_cn_cnm1 maps from camera 0 to "
             "camera 1 (--calibration)";
    case PoseMistake::kAxes:
      return fmt::format(
          "if the rig's axes x, y, z are the axes {} of the poses; give a file with T_body_rig: {} "
          "(--hand-eye), after the hand-eye transform that there may be",
          axesText(finding.R_body_rig), matrixText(finding.R_body_rig));
    case PoseMistake::kTimeShift:
      return fmt::format("with the poses {:.3f} s {}; --set rig.time_offsets_s={} fixes it{}",
                         std::abs(finding.shift_s), finding.shift_s < 0 ? "later" : "earlier",
                         offsetsText(rig, finding.camera, finding.shift_s),
                         rig.cameras.size() > 1 ? "" : ", to some 30 ms: one camera tells no more");
    case PoseMistake::kCameraClock:
      return fmt::format(
          "with the events of camera {} {:.3f} s {}, as its clock differs from that "
          "of camera 0; --set rig.time_offsets_s={} fixes it",
          *finding.camera, std::abs(finding.shift_s), finding.shift_s < 0 ? "earlier" : "later",
          offsetsText(rig, finding.camera, finding.shift_s));
    case PoseMistake::kMirrored:
      return "with " + mirrorText(finding.pixels);
    case PoseMistake::kPixels:
      return pixelText(finding.pixels, rig);
    case PoseMistake::kUnknown:
      break;
  }
  return "";
}

std::string gainText(double gain) {
  if (gain < 1.15) return fmt::format("{:.0f} % sharper", 100 * (gain - 1));
  return fmt::format("{:.1f} times as sharp", gain);
}

}  // namespace

Warning poseWarning(const PoseFinding& finding, const Rig& rig) {
  Warning warning;
  warning.name = nameIn(kNames, finding.mistake);
  if (finding.mistake == PoseMistake::kUnknown && !finding.alternatives.empty()) {
    std::string names;
    for (const PoseMistake mistake : finding.alternatives) {
      const std::string name(nameIn(kNames, mistake));  // two mistakes share a name
      if (names.find(name) == std::string::npos) names += (names.empty() ? "" : ", ") + name;
    }
    warning.text = fmt::format(
        "the events are up to {} with other poses or pixels, but these data do not tell which of "
        "several mistakes it is ({}); a longer recording, other motions or a second camera tell "
        "(--poses, --hand-eye, --calibration)",
        gainText(finding.gain), names);
    return warning;
  }
  if (finding.mistake == PoseMistake::kPixels && finding.gain == 1) {
    warning.text =
        "the events leave a side of a sensor empty, and the poses do not explain them: are the "
        "pictures cropped, or their pixels binned? The calibration must be of the pixels that the "
        "events have: the resolution, and cx and cy less by an offset that was cut off "
        "(--calibration)";
    return warning;
  }
  if (finding.mistake == PoseMistake::kUnknown) {
    warning.text =
        "the poses do not explain the events: wrong poses explain them as well; are poses, events "
        "and calibration of one recording and of the same pixels, and are the positions in metres? "
        "(--poses, "
        "--calibration, --hand-eye)";
    return warning;
  }
  warning.text =
      fmt::format("the events are {} {}", gainText(finding.gain), remedyOf(finding, rig));
  if (!finding.alternatives.empty()) {
    warning.text += fmt::format("; or {}, which explains them as well",
                                finding.mistake == PoseMistake::kCamerasSwapped
                                    ? "the transform between cameras 0 and 1 is inverted"
                                    : "the events of cameras 0 and 1 are exchanged");
  }
  return warning;
}

std::optional<Warning> agreementWarning(const DepthAgreement& agreement) {
  // Measured on six simulated recordings. Right calibration: scales of 0.998 to 1.027, and 73 to 98
  // % of the pixels agree. 3 degrees between the cameras: 37 %; twice the focal length: 39 %; other
  // extrinsics: 10 to 14 %.
  constexpr double kMaxScale = 1.18;
  constexpr double kMinAgreeing = 0.45;
  if (agreement.agreeing < kMinAgreeing) {
    return Warning{
        "depths-disagree",
        fmt::format(
            "the depths from the cameras of the rig and those from the motion of one camera "
            "agree within 15 % in {:.0f} % of the pixels: expected most of them; the "
            "calibration (focal length, lens, pose of the cameras to each other, their clocks) "
            "or the poses are wrong or of another recording, or the tracker has errors within "
            "the windows (--calibration, --poses)",
            100 * agreement.agreeing)};
  }
  if (agreement.scale < kMaxScale && kMaxScale * agreement.scale > 1) return std::nullopt;
  return Warning{
      "scale",
      fmt::format("the depths from the motion are {:.3g} times those from the cameras of the rig: "
                  "the positions of the poses or the distance of the cameras have another unit or "
                  "scale; both must be in metres (--poses, --calibration)",
                  agreement.scale)};
}

std::optional<Warning> sensitivityWarning(const DepthSensitivity& sensitivity) {
  if (sensitivity.per_10_ms < std::max(kMinDepthChange, sensitivity.sigma)) return std::nullopt;
  const std::optional<double>& travel = sensitivity.per_percent_travel;
  return Warning{
      "depths-sensitive",
      fmt::format(
          "the depths change by {:.2g} % where the clock of the poses is off by 10 ms{}; their own "
          "standard deviation is {:.2g} %: are clocks and poses as exact as that? ([rig] "
          "time_offsets_s, --poses)",
          100 * sensitivity.per_10_ms,
          travel ? fmt::format(", and by {:.2g} % per percent of travel", 100 * *travel) : "",
          100 * sensitivity.sigma)};
}

}  // namespace efm
