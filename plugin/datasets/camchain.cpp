// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/datasets/camchain.h"

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>
#include <cstddef>
#include <limits>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "mapping/quoted_text.h"

namespace efm {
namespace {

constexpr double kMaxRotationError = 1e-3;

std::string lineOf(const YAML::Mark& mark) {
  return mark.is_null() ? "" : ":" + std::to_string(mark.line + 1);
}

/// One camera's part of the file, which knows how to call itself in errors.
class CameraEntry {
 public:
  CameraEntry(std::string file, std::string name, const YAML::Node& node)
      : file_(std::move(file)), name_(std::move(name)), node_(node) {
    if (!node_.IsMap()) throw fail(node_, ": expected keys such as intrinsics");
  }

  bool has(const char* key) const { return static_cast<bool>(node_[key]); }

  std::string text(const char* key) const {
    const YAML::Node value = find(key);
    if (!value.IsScalar()) throw fail(value, std::string(": ") + key + ": expected a word");
    return value.Scalar();
  }

  /// @param expected what the numbers are, for errors.
  std::vector<double> numbers(const char* key, const char* expected) const {
    return numbersOf(find(key), key, expected);
  }
  std::vector<double> numbers(const char* key, std::size_t count, const char* expected) const {
    return numbersOf(find(key), key, count, expected);
  }

  Eigen::Matrix4d matrix(const char* key) const {
    const YAML::Node rows = find(key);
    constexpr const char* kExpected = "4 rows of 4 numbers";
    if (!rows.IsSequence() || rows.size() != 4) throw failKey(rows, key, kExpected);
    Eigen::Matrix4d matrix;
    for (int row = 0; row < 4; ++row) {
      const std::vector<double> values =
          numbersOf(rows[static_cast<std::size_t>(row)], key, 4, kExpected);
      matrix.row(row) = Eigen::RowVector4d::Map(values.data());
    }
    return matrix;
  }

  std::runtime_error failKey(const char* key, const std::string& found,
                             const std::string& expected) const {
    return fail(find(key), std::string(": ") + key + " = " + found + ": expected " + expected);
  }
  std::runtime_error fail(const std::string& what) const { return fail(node_, ": " + what); }

 private:
  YAML::Node find(const char* key) const {
    const YAML::Node value = node_[key];
    if (!value) throw fail(node_, std::string(": ") + key + " is missing");
    return value;
  }

  std::vector<double> numbersOf(const YAML::Node& list, const char* key,
                                const char* expected) const {
    if (!list.IsSequence()) throw failKey(list, key, expected);
    std::vector<double> values;
    for (const YAML::Node& item : list) {
      double value = std::numeric_limits<double>::quiet_NaN();
      if (!item.IsScalar() || !YAML::convert<double>::decode(item, value) ||
          !std::isfinite(value)) {
        throw failKey(item, key, "finite numbers");
      }
      values.push_back(value);
    }
    return values;
  }

  std::vector<double> numbersOf(const YAML::Node& list, const char* key, std::size_t count,
                                const char* expected) const {
    std::vector<double> values = numbersOf(list, key, expected);
    if (values.size() == count) return values;
    throw fail(list, std::string(": ") + key + ": " + std::to_string(values.size()) +
                         " numbers: expected " + expected);
  }

  std::runtime_error failKey(const YAML::Node& node, const char* key,
                             const std::string& expected) const {
    const std::string found = node.IsScalar()     ? inQuotes(node.Scalar())
                              : node.IsSequence() ? "a list"
                              : node.IsMap()      ? "keys"
                                                  : "nothing";
    return fail(node, std::string(": ") + key + " = " + found + ": expected " + expected);
  }

  std::runtime_error fail(const YAML::Node& node, const std::string& what) const {
    return std::runtime_error(file_ + lineOf(node.Mark()) + ": " + name_ + what);
  }

  std::string file_;
  std::string name_;
  YAML::Node node_;
};

int sideOf(double value, const CameraEntry& entry) {
  if (std::floor(value) == value && value >= 1 && value <= 65535) return static_cast<int>(value);
  std::ostringstream found;
  found << value;
  throw entry.failKey("resolution", found.str(), "whole numbers from 1 to 65535");
}

CameraModel readModel(const CameraEntry& entry) {
  const std::string kind = entry.text("camera_model");
  if (kind != "pinhole") throw entry.failKey("camera_model", inQuotes(kind), "pinhole");

  CameraModel model;
  const std::vector<double> intrinsics = entry.numbers("intrinsics", 4, "4, fx fy cx cy");
  model.fx = intrinsics[0];
  model.fy = intrinsics[1];
  model.cx = intrinsics[2];
  model.cy = intrinsics[3];
  const std::vector<double> resolution = entry.numbers("resolution", 2, "2, width height");
  model.width = sideOf(resolution[0], entry);
  model.height = sideOf(resolution[1], entry);
  const std::string distortion = entry.text("distortion_model");
  try {
    model.distortion = distortionModelFromName(distortion);
  } catch (const std::invalid_argument&) {
    throw entry.failKey("distortion_model", inQuotes(distortion), "radtan, equidistant or none");
  }
  if (model.distortion != DistortionModel::kNone || entry.has("distortion_coeffs")) {
    model.coefficients = entry.numbers("distortion_coeffs", "a list of numbers");
  }
  try {
    model.validate();
  } catch (const std::invalid_argument& error) {
    throw entry.fail(error.what());
  }
  return model;
}

Rigid3 readTransform(const CameraEntry& entry, const char* key) {
  const Eigen::Matrix4d matrix = entry.matrix(key);
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const double error =
      (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= kMaxRotationError)) {
    throw entry.failKey(key,
                        "a matrix whose columns are off orthonormal by " + std::to_string(error),
                        "a rotation, to 0.001");
  }
  if (rotation.determinant() < 0) throw entry.failKey(key, "a reflection", "a rotation");
  if (matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    throw entry.failKey(key, "a matrix with another last row", "0 0 0 1 there");
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d nearest = svd.matrixU() * svd.matrixV().transpose();
  return {Eigen::Quaterniond(nearest).normalized(), matrix.topRightCorner<3, 1>()};
}

/// The number N of a key "camN"; nothing else is a camera.
bool isCameraName(const std::string& name) {
  return name.size() > 3 && name.compare(0, 3, "cam") == 0 &&
         name.find_first_not_of("0123456789", 3) == std::string::npos;
}

/// How many cameras there are: cam0, cam1, … without gaps.
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
  while (names.erase("cam" + std::to_string(count)) > 0) ++count;
  if (!names.empty()) {
    throw std::runtime_error(file + ": " + *names.begin() + " without cam" + std::to_string(count) +
                             ": expected cameras numbered from cam0 without gaps");
  }
  return count;
}

YAML::Node loadYaml(const std::string& file) {
  try {
    return YAML::LoadFile(file);
  } catch (const YAML::BadFile&) {
    throw std::runtime_error(file + ": cannot be opened for reading");
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(file + lineOf(error.mark) + ": not YAML: " + error.msg);
  }
}

}  // namespace

Rig readCamchain(const std::filesystem::path& file) {
  const YAML::Node root = loadYaml(file.string());
  const std::size_t count = countCameras(file.string(), root);
  Rig rig;
  for (std::size_t n = 0; n < count; ++n) {
    const std::string name = "cam" + std::to_string(n);
    const CameraEntry entry(file.string(), name, root[name]);
    RigCamera camera;
    camera.model = readModel(entry);
    if (n > 0) {
      const Rigid3 T_cn_cnm1 = readTransform(entry, "T_cn_cnm1");
      camera.T_rig_cam = rig.cameras[n - 1].T_rig_cam * T_cn_cnm1.inverse();
    }
    rig.cameras.push_back(camera);
  }
  return rig;
}

}  // namespace efm
