// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/calibration/calibration_formats.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// Sets the size of the sensor. @param key key of the size, for errors.
void setSensorSize(const YamlEntry& entry, const char* key, double width, double height,
                   CameraModel& model) {
  for (const double side : {width, height}) {
    if (std::floor(side) == side && side >= 1 && side <= 65535) continue;
    throw entry.failKey(key, fmt::format("{:g}", side), "whole numbers from 1 to 65535");
  }
  model.width = static_cast<int>(width);
  model.height = static_cast<int>(height);
}

/// @throws std::runtime_error naming the entry, if `CameraModel::validate` rejects the model.
void requireValid(const YamlEntry& entry, const CameraModel& model) {
  try {
    model.validate();
  } catch (const std::invalid_argument& error) {
    throw entry.fail(error.what());
  }
}

/// Reads a camera from the keys camera_model (pinhole), distortion_model (radtan, equidistant or
/// none), distortion_coeffs and resolution, and the four intrinsics fx fy cx cy.
/// @param intrinsics_key "intrinsics" in Kalibr's files, "camera_matrix" in DSEC's.
CameraModel readKalibrCamera(const YamlEntry& entry, const char* intrinsics_key) {
  const std::string kind = entry.text("camera_model");
  if (kind != "pinhole") throw entry.failKey("camera_model", inQuotes(kind), "pinhole");

  const std::vector<double> k = entry.numbers(intrinsics_key, 4, "4, fx fy cx cy");
  CameraModel model{0, 0, k[0], k[1], k[2], k[3], DistortionModel::kNone, {}};
  const std::vector<double> resolution = entry.numbers("resolution", 2, "2, width height");
  setSensorSize(entry, "resolution", resolution[0], resolution[1], model);
  const std::string distortion = entry.text("distortion_model");
  try {
    model.distortion = distortionModelFromName(distortion);
  } catch (const std::invalid_argument&) {
    throw entry.failKey("distortion_model", inQuotes(distortion), "radtan, equidistant or none");
  }
  if (model.distortion != DistortionModel::kNone || entry.has("distortion_coeffs")) {
    model.coefficients = entry.numbers("distortion_coeffs", 0, "a list of numbers");
  }
  requireValid(entry, model);
  return model;
}

/// Reads the offset of the camera's clock: t_imu = t_cam + timeshift_cam_imu.
std::int64_t timeShiftOf(const YamlEntry& entry) {
  constexpr const char* kKey = "timeshift_cam_imu";
  const std::string text = entry.text(kKey);
  const std::optional<std::int64_t> shift_ns = parseSeconds(text);
  if (shift_ns && std::abs(*shift_ns) < kEndOfTimeNs) return *shift_ns;
  throw entry.failKey(kKey, inQuotes(text), "a time in seconds");
}

/// Returns whether a key is "camN" with a number N.
bool isCameraName(const std::string& name) {
  return name.size() > 3 && name.compare(0, 3, "cam") == 0 &&
         name.find_first_not_of("0123456789", 3) == std::string::npos;
}

/// Counts the cameras: cam0, cam1, … without gaps.
std::size_t countCameras(const std::string& file, const YAML::Node& root) {
  std::set<std::string> names;
  if (root.IsMap()) {
    for (const auto& entry : root) {
      if (entry.first.IsScalar() && isCameraName(entry.first.Scalar())) {
        names.insert(entry.first.Scalar());
      }
    }
  }
  if (names.count("cam0") == 0) {
    throw std::runtime_error(file + ": cam0 is missing: expected a camera chain as Kalibr has it");
  }
  std::size_t count = 0;
  while (names.erase(fmt::format("cam{}", count)) > 0) ++count;
  if (!names.empty()) {
    throw std::runtime_error(
        fmt::format("{}: {} without cam{}: expected cameras numbered from cam0 without gaps", file,
                    *names.begin(), count));
  }
  return count;
}

}  // namespace

Rig readCamchain(const std::filesystem::path& file) {
  const YAML::Node root = loadYaml(file.string());
  const std::size_t count = countCameras(file.string(), root);
  std::vector<std::int64_t> shifts_ns;
  Rig rig;
  for (std::size_t n = 0; n < count; ++n) {
    const std::string name = fmt::format("cam{}", n);
    const YamlEntry entry(file.string(), name, root[name]);
    RigCamera camera;
    camera.model = readKalibrCamera(entry, "intrinsics");
    if (n > 0) {
      const Rigid3 T_cn_cnm1 = entry.transform("T_cn_cnm1");
      camera.T_rig_cam = rig.cameras[n - 1].T_rig_cam * T_cn_cnm1.inverse();
    }
    if (entry.has("timeshift_cam_imu") || !shifts_ns.empty()) {
      if (shifts_ns.size() != n) {
        throw entry.fail("timeshift_cam_imu: expected for all cameras, or for none");
      }
      shifts_ns.push_back(timeShiftOf(entry));
      camera.time_offset_ns = shifts_ns[n] - shifts_ns[0];
    }
    rig.cameras.push_back(camera);
  }
  return rig;
}

std::optional<Rigid3> readCamchainImu(const std::filesystem::path& file) {
  constexpr const char* kKey = "T_cam_imu";
  const YAML::Node root = loadYaml(file.string());
  countCameras(file.string(), root);
  const YamlEntry cam0(file.string(), "cam0", root["cam0"]);
  if (!cam0.has(kKey)) return std::nullopt;
  return cam0.transform(kKey).inverse();
}

CameraModel readCameraInfo(const YamlEntry& root) {
  constexpr const char* kForm = "9, fx 0 cx 0 fy cy 0 0 1";
  const YamlEntry matrix = root.section("camera_matrix");
  const std::vector<double> k = matrix.numbers("data", 9, kForm);
  if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
    throw matrix.failKey("data", "a matrix with skew or another last row", kForm);
  }
  CameraModel model{0, 0, k[0], k[4], k[2], k[5], DistortionModel::kRadtan, {}};
  const double width = root.number("image_width");
  setSensorSize(root, "image_width", width, 1, model);
  setSensorSize(root, "image_height", width, root.number("image_height"), model);

  // OpenCV's files have no model; some of ROS call it camera_model.
  const char* const key = root.has("distortion_model") ? "distortion_model" : "camera_model";
  const std::string distortion = root.has(key) ? root.text(key) : "plumb_bob";
  if (distortion == "equidistant" || distortion == "fisheye") {
    model.distortion = DistortionModel::kEquidistant;
  } else if (distortion != "plumb_bob") {
    throw root.failKey(key, inQuotes(distortion), "plumb_bob, equidistant or fisheye");
  }
  model.coefficients =
      root.section("distortion_coefficients").numbers("data", 0, "a list of numbers");
  requireValid(root, model);
  return model;
}

CameraModel readMetavisionCamera(const YamlEntry& root) {
  const std::vector<double> k = root.numbers("K", 9, "9, fx 0 cx 0 fy cy 0 0 1");
  const std::vector<double> size = root.numbers("img_size", 2, "2, width height");
  CameraModel model{0, 0, k[0], k[4], k[2], k[5], DistortionModel::kRadtan, {}};
  setSensorSize(root, "img_size", size[0], size[1], model);
  const std::string type = root.text("type");
  if (type != "PINHOLE") throw root.failKey("type", inQuotes(type), "PINHOLE");
  model.coefficients = root.numbers("D", 0, "a list of numbers");
  requireValid(root, model);
  return model;
}

Rig readDvCameras(const YamlEntry& root) {
  Rig rig;
  const std::size_t count = root.sizeOf("cameras");
  for (std::size_t n = 0; n < count; ++n) {
    const YamlEntry entry = root.item("cameras", n);
    const std::vector<double> focal = entry.numbers("focalLength", 2, "2, fx fy");
    const std::vector<double> center = entry.numbers("principalPoint", 2, "2, cx cy");
    const std::vector<double> size = entry.numbers("resolution", 2, "2, width height");
    CameraModel model{0, 0, focal[0], focal[1], center[0], center[1], DistortionModel::kRadtan, {}};
    setSensorSize(entry, "resolution", size[0], size[1], model);
    const std::string distortion = entry.text("distortionModel");
    if (distortion == "equidistant") {
      model.distortion = DistortionModel::kEquidistant;
    } else if (distortion != "radialTangential") {
      throw entry.failKey("distortionModel", inQuotes(distortion),
                          "radialTangential or equidistant");
    }
    model.coefficients = entry.numbers("distortionCoefficients", 0, "a list of numbers");
    requireValid(entry, model);
    rig.cameras.push_back({model, entry.transform("transformationToC0"), 0});
  }
  return rig;
}

Rigid3 readEasyHandEye(const YamlEntry& root) {
  if (root.has("parameters")) {
    const YamlEntry parameters = root.section("parameters");
    if (parameters.has("eye_on_hand") && parameters.text("eye_on_hand") != "true") {
      throw parameters.failKey("eye_on_hand", inQuotes(parameters.text("eye_on_hand")),
                               "true: a camera on the tracked body");
    }
  }
  const YamlEntry t = root.section("transformation");
  const Eigen::Quaterniond numbers(t.number("qw"), t.number("qx"), t.number("qy"), t.number("qz"));
  const auto rotation = rotationNear(numbers);
  if (!rotation) throw t.fail("qx qy qz qw: expected a quaternion of length 1");
  return {*rotation, {t.number("x"), t.number("y"), t.number("z")}};
}

Calibration readDsecCalibration(const YamlEntry& root, const std::filesystem::path& file) {
  const YamlEntry intrinsics = root.section("intrinsics");
  const YamlEntry extrinsics = root.section("extrinsics");
  Calibration calibration{file, {}};
  for (const char* name : {"cam0", "cam3"}) {
    RigCamera& camera = calibration.rig.cameras.emplace_back();
    camera.model = readKalibrCamera(intrinsics.section(name), "camera_matrix");
  }
  const Rigid3 T_cam1_cam0 = extrinsics.transform("T_10");
  const Rigid3 T_cam3_cam0 =
      extrinsics.transform("T_32") * extrinsics.transform("T_21") * T_cam1_cam0;
  calibration.rig.cameras[1].T_rig_cam = T_cam3_cam0.inverse();
  calibration.T_camRect1_rig =
      Rigid3{extrinsics.rotation("R_rect1"), Eigen::Vector3d::Zero()} * T_cam1_cam0;
  return calibration;
}

Rigid3 readDsecHandEye(const YamlEntry& root, const Calibration* calibration) {
  const Rigid3 T_lidar_camRect1 = root.transform("T_lidar_camRect1");
  if (calibration == nullptr || !calibration->T_camRect1_rig) {
    throw root.fail(
        "T_lidar_camRect1 is of a rectified frame camera: expected the calibration "
        "cam_to_cam.yaml, too");
  }
  return T_lidar_camRect1 * *calibration->T_camRect1_rig;
}

namespace {

constexpr Eigen::Index kTumVieCameras = 4;
constexpr std::size_t kTumVieEventCameras[] = {2, 3};

Rigid3 jsonPose(const YamlEntry& pose) {
  const Eigen::Quaterniond rotation(pose.number("qw"), pose.number("qx"), pose.number("qy"),
                                    pose.number("qz"));
  const double norm = rotation.norm();
  if (!(std::abs(norm - 1) <= 1e-3)) {
    throw pose.fail(
        fmt::format("qx qy qz qw of length {:g}: expected a rotation, of length 1 to 0.001", norm));
  }
  return {rotation.normalized(), {pose.number("px"), pose.number("py"), pose.number("pz")}};
}

CameraModel pinholeOf(const YamlEntry& entry) {
  CameraModel model;
  model.fx = entry.number("fx");
  model.fy = entry.number("fy");
  model.cx = entry.number("cx");
  model.cy = entry.number("cy");
  return model;
}

CameraModel kb4Camera(const YamlEntry& value, std::size_t index, const Eigen::MatrixXd& sizes) {
  const YamlEntry camera = value.item("intrinsics", index);
  const std::string type = camera.text("camera_type");
  if (type != "kb4") throw camera.failKey("camera_type", inQuotes(type), "kb4");
  const YamlEntry numbers = camera.section("intrinsics");
  CameraModel model = pinholeOf(numbers);
  model.distortion = DistortionModel::kEquidistant;
  for (const char* key : {"k1", "k2", "k3", "k4"}) {
    model.coefficients.push_back(numbers.number(key));
  }
  const auto row = static_cast<Eigen::Index>(index);
  setSensorSize(value, "resolution", sizes(row, 0), sizes(row, 1), model);
  requireValid(numbers, model);
  return model;
}

}  // namespace

Calibration readTumVieCalibration(const YamlEntry& root, const std::filesystem::path& file) {
  const YamlEntry value = root.section("value0");
  const Eigen::MatrixXd sizes = value.matrix("resolution", kTumVieCameras, 2);
  Calibration calibration{file, {}};
  for (const std::size_t index : kTumVieEventCameras) {
    RigCamera& camera = calibration.rig.cameras.emplace_back();
    camera.model = kb4Camera(value, index, sizes);
    const Rigid3 T_imu_cam = jsonPose(value.item("T_imu_cam", index));
    if (!calibration.T_imu_rig) {
      calibration.T_imu_rig = T_imu_cam;
    } else {
      camera.T_rig_cam = calibration.T_imu_rig->inverse() * T_imu_cam;
    }
  }
  return calibration;
}

Rigid3 readTumVieHandEye(const YamlEntry& root, const Calibration* calibration) {
  const YamlEntry value = root.section("value0");
  const Rigid3 T_imu_marker = jsonPose(value.section("T_imu_marker"));
  if (calibration == nullptr || !calibration->T_imu_rig) {
    throw value.fail(
        "T_imu_marker is of the IMU: expected a calibration with the IMU, "
        "camera-calibration*.json, too");
  }
  return T_imu_marker.inverse() * *calibration->T_imu_rig;
}

namespace {

constexpr const char* kLeft = "_LEFT";
constexpr const char* kRight = "_RIGHT";
constexpr const char* kPose = "_LEFT2RIGHT_POSE";

/// Returns the line without its comment, and without blanks at both ends.
std::string_view iniContent(std::string_view line) {
  for (const std::string_view comment : {";", "#", "//", "%"}) {
    line = line.substr(0, line.find(comment));
  }
  return trimmed(line);
}

bool isSection(std::string_view line) {
  return line.size() > 2 && line.front() == '[' && line.back() == ']' &&
         line.find_first_of(", ") == std::string_view::npos;
}

/// Makes a node of a value. A value in brackets is a list.
YAML::Node nodeOf(std::string_view value) {
  if (value.size() < 2 || value.front() != '[' || value.back() != ']') {
    return YAML::Node(std::string(value));
  }
  YAML::Node list(YAML::NodeType::Sequence);
  for (const std::string_view word : splitWords(value.substr(1, value.size() - 2), " \t\r,")) {
    list.push_back(std::string(word));
  }
  return list;
}

/// Returns sections and keys as YAML, so that YamlEntry reads their values as strictly.
std::map<std::string, YAML::Node> iniSections(std::string_view text,
                                              const std::filesystem::path& file) {
  std::map<std::string, YAML::Node> sections;
  std::string section;
  for (int number = 1; !text.empty(); ++number) {
    const std::string_view line = iniContent(takeLine(text));
    if (line.empty()) continue;
    if (isSection(line)) {
      section = std::string(line.substr(1, line.size() - 2));
      sections.emplace(section, YAML::Node(YAML::NodeType::Map));
      continue;
    }
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos) {
      throw std::runtime_error(fmt::format("{}:{}: {}: expected [section] or key = value",
                                           file.string(), number, inQuotes(line)));
    }
    sections[section][std::string(trimmed(line.substr(0, equals)))] =
        nodeOf(trimmed(line.substr(equals + 1)));
  }
  return sections;
}

CameraModel mrptCamera(const YamlEntry& entry) {
  CameraModel model = pinholeOf(entry);
  const std::vector<double> size = entry.numbers("resolution", 2, "2, width height");
  setSensorSize(entry, "resolution", size[0], size[1], model);

  const char* const key = entry.has("distortion_model") ? "distortion_model" : "distortion";
  const std::string distortion = entry.has(key) ? entry.text(key) : "plumb_bob";
  if (distortion == "plumb_bob") {
    model.distortion = DistortionModel::kRadtan;
    model.coefficients = entry.numbers("dist", 0, "a list of numbers");
    while (model.coefficients.size() > 5 && model.coefficients.back() == 0) {
      model.coefficients.pop_back();
    }
  } else if (distortion == "kannala_brandt") {
    model.distortion = DistortionModel::kEquidistant;
    model.coefficients = entry.numbers("dist", 4, "4, k1 k2 k3 k4");
  } else if (distortion != "none") {
    throw entry.failKey(key, inQuotes(distortion), "none, plumb_bob or kannala_brandt");
  }
  requireValid(entry, model);
  return model;
}

Rigid3 mrptPose(const YamlEntry& entry) {
  constexpr const char* kKey = "pose_quaternion";
  const std::vector<double> v = entry.numbers(kKey, 7, "7, x y z qw qx qy qz");
  const Eigen::Quaterniond rotation(v[3], v[4], v[5], v[6]);
  const double norm = rotation.norm();
  if (!(std::abs(norm - 1) <= 1e-3)) {
    throw entry.failKey(kKey, fmt::format("a quaternion of length {:g}", norm),
                        "a rotation, of length 1 to 0.001");
  }
  return {rotation.normalized(), {v[0], v[1], v[2]}};
}

}  // namespace

bool looksLikeIni(std::string_view text) {
  while (!text.empty()) {
    const std::string_view line = iniContent(takeLine(text));
    if (!line.empty()) return isSection(line);
  }
  return false;
}

Rig readMrptCameras(std::string_view text, const std::filesystem::path& file) {
  const std::map<std::string, YAML::Node> sections = iniSections(text, file);
  const auto entry_of = [&](const std::string& name) {
    const auto found = sections.find(name);
    if (found != sections.end()) {
      return YamlEntry(file.string(), "[" + name + "]", found->second);
    }
    throw std::runtime_error(fmt::format(
        "{}: [{}] is missing: expected it with the cameras' sections", file.string(), name));
  };
  std::vector<std::string> cameras;
  for (const auto& [name, keys] : sections) {
    if (keys["fx"]) cameras.push_back(name);
  }
  Rig rig;
  if (cameras.size() == 1) {
    rig.cameras.push_back({mrptCamera(entry_of(cameras[0])), {}, 0});
    return rig;
  }
  const std::string prefix =
      cameras.empty() ? ""
                      : cameras[0].substr(0, std::min(cameras[0].rfind('_'), cameras[0].size()));
  if (cameras != std::vector<std::string>{prefix + kLeft, prefix + kRight}) {
    throw std::runtime_error(fmt::format(
        "{}: {} sections with fx: expected one camera, or [NAME_LEFT] and [NAME_RIGHT], as MRPT's "
        "camera calibration writes them",
        file.string(), cameras.size()));
  }
  rig.cameras.push_back({mrptCamera(entry_of(cameras[0])), {}, 0});
  rig.cameras.push_back({mrptCamera(entry_of(cameras[1])), mrptPose(entry_of(prefix + kPose)), 0});
  return rig;
}

}  // namespace efm
