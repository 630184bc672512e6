// SPDX-License-Identifier: BSD-3-Clause
// NumPy arrays of the engine's types, for the files of the module _engine.
#pragma once

#include <event_fusion/engine.h>
#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "plugin/recordings/text/event_columns.h"

namespace efm {

namespace py = pybind11;

using Paths = std::vector<std::filesystem::path>;
using Matrix4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

template <typename Matrix>
Array arrayOf(const Matrix& matrix) {
  Array array({matrix.rows(), matrix.cols()});
  Eigen::Map<Matrix>(array.mutable_data()) = matrix;
  return array;
}

template <typename Matrix>
Matrix matrixOf(const Array& array, const char* name) {
  const auto rows = Matrix::RowsAtCompileTime;
  if (array.ndim() != 2 || array.shape(0) != rows || array.shape(1) != rows) {
    std::string shape;
    for (py::ssize_t i = 0; i < array.ndim(); ++i) {
      shape += (i > 0 ? " x " : "") + std::to_string(array.shape(i));
    }
    throw std::invalid_argument(std::string(name) + " has " + shape +
                                " numbers: expected a matrix of " + std::to_string(rows) + " x " +
                                std::to_string(rows));
  }
  return Eigen::Map<const Matrix>(array.data());
}

inline Matrix4 matrixOf(const Rigid3& T_a_b) {
  Matrix4 matrix = Matrix4::Identity();
  matrix.topLeftCorner<3, 3>() = T_a_b.rotation.toRotationMatrix();
  matrix.topRightCorner<3, 1>() = T_a_b.translation;
  return matrix;
}

/// Returns the pose of a matrix, or of tx ty tz qx qy qz qw.
/// @param name of the argument, for errors.
inline Rigid3 rigidOf(const Array& array, const char* name) {
  if (array.ndim() == 1 && array.size() == 7) {
    const double* v = array.data();
    const auto rotation =
        rotationNear(Eigen::Quaterniond(v[6], v[3], v[4], v[5]));  // as of a TUM file
    if (!rotation) {
      throw std::invalid_argument(std::string(name) +
                                  ": expected tx ty tz qx qy qz qw, with a quaternion of length 1");
    }
    return {*rotation, {v[0], v[1], v[2]}};
  }
  const auto T_a_b = transformNear(matrixOf<Matrix4>(array, name));
  if (!T_a_b) {
    throw std::invalid_argument(std::string(name) +
                                ": expected [R t; 0 0 0 1] with a rotation matrix R");
  }
  return *T_a_b;
}

/// Returns a camera matrix.
inline Array kOf(double fx, double fy, double cx, double cy) {
  Matrix3 K;
  K << fx, 0, cx, 0, fy, cy, 0, 0, 1;
  return arrayOf(K);
}

/// Returns an array that shares the memory of `owner`, read-only.
template <typename T, typename Owner>
py::array sharedArray(const py::dtype& type, std::vector<py::ssize_t> shape,
                      std::vector<py::ssize_t> strides, const T* data, Owner owner) {
  const py::capsule base(new Owner(std::move(owner)),
                         [](void* kept) { delete static_cast<Owner*>(kept); });
  py::array array(type, std::move(shape), std::move(strides), data, base);
  array.attr("flags").attr("writeable") = false;
  return array;
}

inline py::array imageOf(const cv::Mat1f& image) {
  return sharedArray(py::dtype::of<float>(), {image.rows, image.cols},
                     {static_cast<py::ssize_t>(image.step[0]), sizeof(float)}, image.ptr<float>(),
                     image);
}

/// A point of a map in the world. A cloud's own floats are relative to its origin.
struct PointRecord {
  double x, y, z;
  float intensity;
  std::uint32_t support;
  float sigma, probability;
};

inline py::array pointsOf(const MapCloud& cloud) {
  py::array_t<PointRecord> records(static_cast<py::ssize_t>(cloud.size()));
  PointRecord* next = records.mutable_data();
  for (const MapPoint& point : cloud.points) {
    const Eigen::Vector3d p_world = positionIn(cloud, point);
    *next++ = {p_world.x(),   p_world.y(), p_world.z(),      point.intensity,
               point.support, point.sigma, point.probability};
  }
  records.attr("flags").attr("writeable") = false;
  return records;
}

/// Poses as times (n,) in nanoseconds and matrices (n, 4, 4).
inline py::tuple posesOf(const std::vector<StampedPose>& poses) {
  const auto count = static_cast<py::ssize_t>(poses.size());
  py::array_t<std::int64_t> times(count);
  py::array_t<double> matrices({count, py::ssize_t{4}, py::ssize_t{4}});
  for (py::ssize_t i = 0; i < count; ++i) {
    const StampedPose& pose = poses[static_cast<std::size_t>(i)];
    times.mutable_at(i) = pose.t_ns;
    Eigen::Map<Matrix4>(matrices.mutable_data(i)) = matrixOf(pose.T_world_rig);
  }
  return py::make_tuple(times, matrices);
}

/// Returns the poses of times (n,) in nanoseconds, and matrices (n, 4, 4) or rows (n, 7).
inline std::vector<StampedPose> stampedPoses(const py::array_t<std::int64_t>& t_ns,
                                             const Array& T_world_rig) {
  const py::ssize_t count = t_ns.size();
  if (count == 0) return {};
  if (t_ns.ndim() != 1 || T_world_rig.ndim() < 2 || T_world_rig.shape(0) != count) {
    throw std::invalid_argument(
        "poses: expected times of shape (n,), and matrices (n, 4, 4) or rows (n, 7)");
  }
  const std::vector<py::ssize_t> shape(T_world_rig.shape() + 1,
                                       T_world_rig.shape() + T_world_rig.ndim());
  std::vector<StampedPose> poses;
  for (py::ssize_t i = 0; i < count; ++i) {
    const Array one(shape, T_world_rig.data() + i * T_world_rig.size() / count, T_world_rig);
    poses.push_back({t_ns.at(i), rigidOf(one, "T_world_rig")});
  }
  return poses;
}

/// Calls that run without the interpreter's lock. At its exit, Python kills threads that ask for
/// the lock again, and C++ cannot bear that: the exit waits until there are no such calls, and a
/// call of another thread after that, perhaps a daemon that asks for the state, does not return.
class ReleasedCalls {
 public:
  static bool ending() { return ending_thread_.load() != std::thread::id(); }
  /// Waits for the calls of all threads. Only this thread may call then.
  static void end() {
    ending_thread_ = std::this_thread::get_id();
    const py::gil_scoped_release released;
    while (count_ > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

  ReleasedCalls() {
    if (ending() && ending_thread_.load() != std::this_thread::get_id()) {
      PyEval_SaveThread();
      while (true) std::this_thread::sleep_for(std::chrono::hours(1));
    }
    ++count_;
  }
  ~ReleasedCalls() { --count_; }
  ReleasedCalls(const ReleasedCalls&) = delete;
  ReleasedCalls& operator=(const ReleasedCalls&) = delete;

 private:
  inline static std::atomic<int> count_ = 0;
  inline static std::atomic<std::thread::id> ending_thread_{};
};

/// Releases the interpreter's lock for a call. It is counted until it has the lock again.
struct Released {
  ReleasedCalls counted;
  py::gil_scoped_release released;
};

/// Lets Ctrl-C and Python's exit end a long call.
inline void checkSignals() {
  if (ReleasedCalls::ending()) throw std::runtime_error("Python has ended");
  const py::gil_scoped_acquire held;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

/// An event as Metavision's arrays have it.
struct EventRecord {
  std::uint16_t x, y;
  std::int16_t p;
  std::int64_t t;
};

using EventArray = py::array_t<EventRecord, py::array::c_style>;

inline std::vector<Event> eventsOf(const EventArray& records) {
  const EventRecord* first = records.data();
  std::vector<Event> events(static_cast<std::size_t>(records.size()));
  const Released released;
  for (std::size_t i = 0; i < events.size(); ++i) {
    if (first[i].p < -1 || first[i].p > 1) {
      throw std::invalid_argument(
          fmt::format("p[{}] = {}: expected {}", i, first[i].p, kExpectedPolarity));
    }
    events[i] = {first[i].t, first[i].x, first[i].y, first[i].p > 0};
  }
  return events;
}

inline EventArray recordsOf(const std::vector<Event>& events) {
  EventArray records(static_cast<py::ssize_t>(events.size()));
  EventRecord* next = records.mutable_data();
  const Released released;
  for (const Event& event : events) {
    *next++ = {event.x, event.y, static_cast<std::int16_t>(event.polarity ? 1 : 0), event.t_ns};
  }
  return records;
}

using OnProgress = std::function<void(const std::string& activity, double fraction)>;

/// Gives the progress to Python ten times a second.
class ProgressCalls {
 public:
  explicit ProgressCalls(OnProgress on_progress) : on_progress_(std::move(on_progress)) {}

  void operator()(const char* activity, double fraction) {
    const auto now = std::chrono::steady_clock::now();
    if (!on_progress_ || now < next_) return;
    next_ = now + std::chrono::milliseconds(100);
    const py::gil_scoped_acquire held;
    on_progress_(activity, fraction);
  }

 private:
  OnProgress on_progress_;
  std::chrono::steady_clock::time_point next_{};
};

/// Writes a map as the name of the file says.
inline void savePoints(const MapSnapshot& map, const std::filesystem::path& file) {
  const auto type = file.extension();
  if (type != ".ply" && type != ".pcd") {
    throw std::invalid_argument(file.string() + ": expected a name that ends with .pcd or .ply");
  }
  type == ".ply" ? writePly(file, *map.points, map.trajectory) : writePcd(file, *map.points);
}

using OnKeyframe = std::function<void(const std::shared_ptr<const Keyframe>&)>;

/// Gives a keyframe to Python: a copy shares the images.
inline void give(const Keyframe& keyframe, const OnKeyframe& on_keyframe) {
  const py::gil_scoped_acquire held;
  on_keyframe(std::make_shared<const Keyframe>(keyframe));
}

/// Defines the functions that map and evaluate recordings.
void defineJobs(py::module_& module);
/// Defines simulations, and functions on arrays.
void defineExperiments(py::module_& module);

}  // namespace efm
