// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/calibration/calibration_formats.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mapping/base/named_choice.h"
#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

constexpr const char* kOpenVins = "T_imu_cam";
constexpr const char* kMatrix = "9, fx 0 cx 0 fy cy 0 0 1";
constexpr const char* kSeven = "7, a position and a quaternion";

/// The names that programs give to the models of lenses, in lower case.
constexpr NamedChoice<DistortionModel> kLenses[] = {
    {DistortionModel::kRadtan, "radtan"},
    {DistortionModel::kRadtan, "plumb_bob"},
    {DistortionModel::kRadtan, "radialtangential"},
    {DistortionModel::kRadtan, "pinhole"},
    {DistortionModel::kRadtan, "opencv"},
    {DistortionModel::kRadtan, "0"},  // fisheye_model
    {DistortionModel::kRadtan, "false"},
    {DistortionModel::kEquidistant, "equidistant"},
    {DistortionModel::kEquidistant, "fisheye"},
    {DistortionModel::kEquidistant, "kannala_brandt"},
    {DistortionModel::kEquidistant, "kb4"},
    {DistortionModel::kEquidistant, "opencv_fisheye"},
    {DistortionModel::kEquidistant, "1"},
    {DistortionModel::kEquidistant, "true"},
    {DistortionModel::kNone, "none"},
};

/// The keys of a camera in the files of a program; "a: b c" are the keys b and c below a. Values
/// are numbers or lists of numbers, taken together.
struct CameraForm {
  const char* intrinsics;  ///< fx fy cx cy, or a 3x3 matrix.
  bool is_matrix;
  const char* size;  ///< Width and height; null: they are elsewhere.
  const char* lens;  ///< The model of the lens, a name of kLenses; the first key that exists.
  const char* default_lens;  ///< The model without these keys; null: it is an error.
  const char* coefficients;
};

constexpr CameraForm kKalibr = {"intrinsics",       false,   "resolution",
                                "distortion_model", nullptr, "distortion_coeffs"};
constexpr CameraForm kDsec = {"camera_matrix",    false,   "resolution",
                              "distortion_model", nullptr, "distortion_coeffs"};
constexpr CameraForm kBasalt = {"intrinsics: fx fy cx cy", false, nullptr, "camera_type", nullptr,
                                "intrinsics: k1 k2 k3 k4"};
constexpr CameraForm kDv = {
    "focalLength principalPoint", false, "resolution", "distortionModel", nullptr,
    "distortionCoefficients"};
/// camera_calibration of ROS, and OpenCV, whose files do not name the model.
constexpr CameraForm kOpenCv = {"camera_matrix",
                                true,
                                "image_width image_height",
                                "distortion_model camera_model fisheye_model use_fisheye_model",
                                "plumb_bob",
                                "distortion_coefficients"};
/// transforms.json of nerfstudio.
constexpr CameraForm kNerfFisheye = {"fl_x fl_y cx cy", false,   "w h",
                                     "camera_model",    nullptr, "k1 k2 k3 k4"};
constexpr CameraForm kNerf = {"fl_x fl_y cx cy", false,    "w h",
                              "camera_model",    "opencv", "k1 k2 p1 p2 k3 k4"};
constexpr CameraForm kMrpt = {"fx fy cx cy", false, "resolution", "distortion_model distortion",
                              "plumb_bob",   "dist"};

/// The files of one camera, by a key that only these files have.
constexpr std::pair<const char*, CameraForm> kOneCamera[] = {
    // Metavision
    {"img_size", {"K", true, "img_size", "type", nullptr, "D"}},
    {"camera_matrix", kOpenCv},
    // The arrays of OpenCV's tutorial, see `readCalibration`
    {"mtx", {"mtx", true, nullptr, "distortion_model", "plumb_bob", "dist"}},
    // Messages of CameraInfo as text, of ROS 1 and 2
    {"K", {"K", true, "width height", "distortion_model", nullptr, "D"}},
    {"k", {"k", true, "width height", "distortion_model", nullptr, "d"}},
    // VINS and camodocal
    {"projection_parameters: mu",
     {"projection_parameters: mu mv u0 v0", false, "image_width image_height", "model_type",
      nullptr, "projection_parameters: k2 k3 k4 k5"}},
    {"projection_parameters: fx",
     {"projection_parameters: fx fy cx cy", false, "image_width image_height", "model_type",
      nullptr, "distortion_parameters: k1 k2 p1 p2"}},
};

/// Returns the part of a file with keys, and the keys in it: a part and "b c" for "a: b c".
std::pair<YamlEntry, std::vector<std::string>> placeOf(const YamlEntry& entry,
                                                       std::string_view keys) {
  const std::size_t colon = keys.find(": ");
  if (colon != std::string_view::npos) {
    return placeOf(entry.section(std::string(keys.substr(0, colon)).c_str()),
                   keys.substr(colon + 2));
  }
  const auto words = splitWords(keys);
  return {entry, {words.begin(), words.end()}};
}

bool hasPlace(const YamlEntry& entry, const std::string& keys) {
  const std::string first = keys.substr(0, keys.find(": "));
  return entry.has(first.c_str()) &&
         (first == keys || entry.section(first.c_str()).has(keys.substr(first.size() + 2).c_str()));
}

/// @param count expected number of numbers; 0: any.
std::vector<double> numbersAt(const YamlEntry& entry, const char* keys, std::size_t count,
                              const char* expected) {
  const auto [place, names] = placeOf(entry, keys);
  if (names.size() == 1) return place.numbers(names[0].c_str(), count, expected);
  std::vector<double> all;
  for (const std::string& name : names) {
    if ((name == "k3" || name == "k4") && !place.has(name.c_str())) continue;  // 0
    if (place.sizeOf(name.c_str()) == 0) {
      all.push_back(place.number(name.c_str()));
      continue;
    }
    const std::vector<double> list = place.numbers(name.c_str(), 2, "2 numbers");
    all.insert(all.end(), list.begin(), list.end());
  }
  if (count == 0 || all.size() == count) return all;
  throw place.fail(fmt::format("{}: {} numbers: expected {}", keys, all.size(), expected));
}

/// Sets the size of the sensor. @param keys its keys, for errors.
void setSensorSize(const YamlEntry& entry, std::string_view keys, double width, double height,
                   CameraModel& model) {
  const std::vector<std::string> names = placeOf(entry, keys).second;
  for (const auto& [side, name] : {std::pair(width, names.front()), {height, names.back()}}) {
    if (std::floor(side) == side && side >= 1 && side <= 65535) continue;
    throw entry.failKey(name.c_str(), fmt::format("{:g}", side), "whole numbers from 1 to 65535");
  }
  model.width = static_cast<int>(width);
  model.height = static_cast<int>(height);
}

DistortionModel lensOf(const YamlEntry& entry, const CameraForm& form) {
  const std::vector<std::string> keys = placeOf(entry, form.lens).second;
  const auto key = std::find_if(keys.begin(), keys.end(),
                                [&](const std::string& name) { return entry.has(name.c_str()); });
  const bool is_default = key == keys.end() && form.default_lens != nullptr;
  const std::string& used = key == keys.end() ? keys.front() : *key;
  const std::string name = is_default ? form.default_lens : entry.text(used.c_str());
  std::string lower;
  for (const char c : name) lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const auto& lens : kLenses) {
    if (lens.name == lower) return lens.value;
  }
  throw entry.failKey(used.c_str(), inQuotes(name),
                      "radtan (plumb_bob, radialTangential, PINHOLE), equidistant (fisheye, "
                      "kannala_brandt, kb4) or none; another model is not read");
}

/// Reads a camera. Coefficients after the model's own must be 0.
/// @param size the sensor's size if the form does not have it.
CameraModel readCamera(const YamlEntry& entry, const CameraForm& form,
                       const CameraSize& size = {}) {
  const DistortionModel lens = lensOf(entry, form);
  std::vector<double> k = form.is_matrix ? numbersAt(entry, form.intrinsics, 9, kMatrix)
                                         : numbersAt(entry, form.intrinsics, 4, "4, fx fy cx cy");
  if (form.is_matrix) {
    if (!isCameraMatrix(k)) {
      const auto [place, names] = placeOf(entry, form.intrinsics);
      throw place.failKey(names[0].c_str(), "a matrix with skew or another last row", kMatrix);
    }
    k = {k[0], k[4], k[2], k[5]};
  }
  CameraModel model{size.width, size.height, k[0], k[1], k[2], k[3], lens, {}};
  const bool sized =
      form.size != nullptr &&
      (form.default_lens == nullptr || entry.has(placeOf(entry, form.size).second[0].c_str()));
  if (sized) {
    const std::vector<double> sides = numbersAt(entry, form.size, 2, "2, width height");
    setSensorSize(entry, form.size, sides[0], sides[1], model);
  }
  if (model.distortion != DistortionModel::kNone || hasPlace(entry, form.coefficients)) {
    model.coefficients = numbersAt(entry, form.coefficients, 0, "a list of numbers");
  }
  const std::size_t most = model.distortion == DistortionModel::kRadtan        ? 5
                           : model.distortion == DistortionModel::kEquidistant ? 4
                                                                               : 0;
  while (model.coefficients.size() > most && model.coefficients.back() == 0) {
    model.coefficients.pop_back();
  }
  if (entry.has("binning_x") || entry.has("roi")) {
    const auto value = [](const YamlEntry& of, const char* key) {
      return of.has(key) ? of.number(key) : 0;
    };
    SensorArea area{value(entry, "binning_x"), value(entry, "binning_y")};
    if (entry.has("roi")) {
      const YamlEntry roi = entry.section("roi");
      area = {area.binning_x,         area.binning_y,      value(roi, "x_offset"),
              value(roi, "y_offset"), value(roi, "width"), value(roi, "height")};
    }
    try {
      model = cutTo(area, model);
    } catch (const std::runtime_error& error) {
      throw entry.fail(error.what());
    }
  }
  try {
    CameraModel whole = model;
    if (!sized && model.width == 0) whole.width = whole.height = 1;  // not in the file
    whole.validate();
  } catch (const std::invalid_argument& error) {
    throw entry.fail(error.what());
  }
  return model;
}

/// @param v x y z qx qy qz qw.
Rigid3 rigidFrom(const YamlEntry& entry, const std::vector<double>& v) {
  try {
    return transformOf(v);
  } catch (const std::runtime_error& error) {
    throw entry.fail(error.what());
  }
}

CameraModel readKalibrCamera(const YamlEntry& entry, const CameraForm& form) {
  const std::string kind = entry.text("camera_model");
  if (kind != "pinhole") throw entry.failKey("camera_model", inQuotes(kind), "pinhole");
  return readCamera(entry, form);
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
    camera.model = readKalibrCamera(entry, kKalibr);
    if (n > 0) {
      const bool open_vins = entry.has(kOpenVins) && !entry.has("T_cn_cnm1");
      camera.T_rig_cam =
          open_vins
              ? YamlEntry(file.string(), "cam0", root["cam0"]).transform(kOpenVins).inverse() *
                    entry.transform(kOpenVins)
              : rig.cameras[n - 1].T_rig_cam * entry.transform("T_cn_cnm1").inverse();
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
  if (cam0.has(kKey)) return cam0.transform(kKey).inverse();
  return cam0.has(kOpenVins) ? std::optional(cam0.transform(kOpenVins)) : std::nullopt;
}

std::optional<CameraModel> readOneCamera(const YamlEntry& root) {
  if (root.has("fl_x")) {
    const bool fisheye = root.has("camera_model") && root.text("camera_model") == "OPENCV_FISHEYE";
    return readCamera(root, fisheye ? kNerfFisheye : kNerf);
  }
  for (const auto& [found, form] : kOneCamera) {
    if (hasPlace(root, found)) return readCamera(root, form);
  }
  const auto part = root.onlyPart("camera_matrix");
  return part ? std::optional(readCamera(*part, kOpenCv)) : std::nullopt;
}

Rig readDvCameras(const YamlEntry& root) {
  Rig rig;
  const std::size_t count = root.sizeOf("cameras");
  for (std::size_t n = 0; n < count; ++n) {
    const YamlEntry entry = root.item("cameras", n);
    rig.cameras.push_back({readCamera(entry, kDv), entry.transform("transformationToC0"), 0});
  }
  return rig;
}

Rigid3 readEasyHandEye(const YamlEntry& root) {
  if (root.has("parameters")) {
    const YamlEntry parameters = root.section("parameters");
    for (const auto& [key, on_body] :
         {std::pair("eye_on_hand", "true"), std::pair("calibration_type", "eye_in_hand")}) {
      if (!parameters.has(key) || parameters.text(key) == on_body) continue;
      throw parameters.failKey(key, inQuotes(parameters.text(key)),
                               std::string(on_body) + ": a camera on the tracked body");
    }
  }
  if (root.has("transform")) {
    std::vector<double> v = numbersAt(root, "transform: translation: x y z", 3, "3, x y z");
    for (const double q : numbersAt(root, "transform: rotation: x y z w", 4, "4, x y z w")) {
      v.push_back(q);
    }
    return rigidFrom(root, v);
  }
  return rigidFrom(root, numbersAt(root, "transformation: x y z qx qy qz qw", 7, kSeven));
}

Calibration readDsecCalibration(const YamlEntry& root, const std::filesystem::path& file) {
  const YamlEntry intrinsics = root.section("intrinsics");
  const YamlEntry extrinsics = root.section("extrinsics");
  Calibration calibration{file, {}};
  for (const char* name : {"cam0", "cam3"}) {
    RigCamera& camera = calibration.rig.cameras.emplace_back();
    camera.model = readKalibrCamera(intrinsics.section(name), kDsec);
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

Rigid3 jsonPose(const YamlEntry& pose) {
  return rigidFrom(pose, numbersAt(pose, "px py pz qx qy qz qw", 7, kSeven));
}

CameraModel kb4Camera(const YamlEntry& value, std::size_t index, const Eigen::MatrixXd& sizes) {
  const auto row = static_cast<Eigen::Index>(index);
  CameraModel sized;
  setSensorSize(value, "resolution", sizes(row, 0), sizes(row, 1), sized);
  return readCamera(value.item("intrinsics", index), kBasalt, {sized.width, sized.height});
}

}  // namespace

Calibration readBasaltCalibration(const YamlEntry& root, const std::filesystem::path& file) {
  const YamlEntry value = root.section("value0");
  const std::size_t count = value.sizeOf("resolution");
  const Eigen::MatrixXd sizes = value.matrix("resolution", static_cast<int>(count), 2);
  const bool tum_vie = count == 4 && sizes.row(0) != sizes.row(2);
  Calibration calibration{file, {}};
  for (std::size_t index = tum_vie ? 2 : 0; index < count; ++index) {
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

Rigid3 mrptPose(const YamlEntry& entry) {
  const auto v = entry.numbers("pose_quaternion", 7, "7, x y z qw qx qy qz");
  return rigidFrom(entry, {v[0], v[1], v[2], v[4], v[5], v[6], v[3]});
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
    rig.cameras.push_back({readCamera(entry_of(cameras[0]), kMrpt), {}, 0});
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
  rig.cameras.push_back({readCamera(entry_of(cameras[0]), kMrpt), {}, 0});
  rig.cameras.push_back(
      {readCamera(entry_of(cameras[1]), kMrpt), mrptPose(entry_of(prefix + kPose)), 0});
  return rig;
}

}  // namespace efm
