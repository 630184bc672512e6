// SPDX-License-Identifier: BSD-3-Clause
// event_fusion._engine: the engine of event_fusion/engine.h for Python. The package's Python files
// turn arguments into the types that are taken here, and document the functions.
#include <event_fusion/engine.h>
#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace py = pybind11;

namespace efm {
namespace {

/// An event as Metavision's arrays have it.
struct EventRecord {
  std::uint16_t x, y;
  std::int16_t p;
  std::int64_t t;
};

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
    throw std::invalid_argument(std::string(name) + ": expected a matrix of " +
                                std::to_string(rows) + " x " + std::to_string(rows) + " numbers");
  }
  return Eigen::Map<const Matrix>(array.data());
}

Matrix4 matrixOf(const Rigid3& T_a_b) {
  Matrix4 matrix = Matrix4::Identity();
  matrix.topLeftCorner<3, 3>() = T_a_b.rotation.toRotationMatrix();
  matrix.topRightCorner<3, 1>() = T_a_b.translation;
  return matrix;
}

/// Returns the pose of a matrix, or of tx ty tz qx qy qz qw.
/// @param name of the argument, for errors.
Rigid3 rigidOf(const Array& array, const char* name) {
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
Array kOf(double fx, double fy, double cx, double cy) {
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

py::array imageOf(const cv::Mat1f& image) {
  return sharedArray(py::dtype::of<float>(), {image.rows, image.cols},
                     {static_cast<py::ssize_t>(image.step[0]), sizeof(float)}, image.ptr<float>(),
                     image);
}

py::array pointsOf(const MapCloud::ConstPtr& cloud) {
  const py::dtype type(
      py::cast(std::vector<std::string>{"x", "y", "z", "intensity", "support", "sigma"}),
      py::cast(std::vector<std::string>{"f4", "f4", "f4", "f4", "u4", "f4"}),
      py::cast(std::vector<std::size_t>{offsetof(MapPoint, x), offsetof(MapPoint, y),
                                        offsetof(MapPoint, z), offsetof(MapPoint, intensity),
                                        offsetof(MapPoint, support), offsetof(MapPoint, sigma)}),
      sizeof(MapPoint));
  return sharedArray(type, {static_cast<py::ssize_t>(cloud->size())}, {sizeof(MapPoint)},
                     cloud->points.data(), cloud);
}

/// Poses as times (n,) in nanoseconds and matrices (n, 4, 4).
py::tuple posesOf(const std::vector<StampedPose>& poses) {
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

using EventArray = py::array_t<EventRecord, py::array::c_style>;

std::vector<Event> eventsOf(const EventArray& records) {
  const EventRecord* first = records.data();
  std::vector<Event> events(static_cast<std::size_t>(records.size()));
  const py::gil_scoped_release released;
  for (std::size_t i = 0; i < events.size(); ++i) {
    events[i] = {first[i].t, first[i].x, first[i].y, first[i].p > 0};
  }
  return events;
}

EventArray recordsOf(const std::vector<Event>& events) {
  EventArray records(static_cast<py::ssize_t>(events.size()));
  EventRecord* next = records.mutable_data();
  const py::gil_scoped_release released;
  for (const Event& event : events) {
    *next++ = {event.x, event.y, static_cast<std::int16_t>(event.polarity ? 1 : 0), event.t_ns};
  }
  return records;
}

/// Lets Ctrl-C end a long call.
void checkSignals() {
  const py::gil_scoped_acquire held;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

/// The events of a recording's camera. At damage, the events before it come first.
class EventReader {
 public:
  EventReader(const Paths& files, const Overrides& overrides)
      : recording_(openRecording(files, overrides)) {}

  /// Returns at most `count` events of the camera; none at the end.
  EventArray next(int camera, std::size_t count) {
    std::vector<Event> part;
    {
      const py::gil_scoped_release released;
      while (!damage_ && waiting_.size() < count && readPacket(camera)) checkSignals();
      if (damage_ && waiting_.empty()) std::rethrow_exception(damage_);
      const auto end =
          waiting_.begin() + static_cast<std::ptrdiff_t>(std::min(count, waiting_.size()));
      part.assign(waiting_.begin(), end);
      waiting_.erase(waiting_.begin(), end);
    }
    return recordsOf(part);
  }

 private:
  bool readPacket(int camera) {
    std::optional<Sample> sample;
    try {
      sample = recording_->next();
    } catch (const std::runtime_error&) {
      damage_ = std::current_exception();
    }
    if (!sample) return false;
    const auto* packet = std::get_if<EventPacket>(&*sample);
    if (packet != nullptr && packet->camera == camera) {
      waiting_.insert(waiting_.end(), packet->events.begin(), packet->events.end());
    }
    return true;
  }

  std::unique_ptr<Recording> recording_;
  std::vector<Event> waiting_;
  std::exception_ptr damage_;
};

std::vector<StampedPose> readPoses(const Paths& files, const Overrides& overrides) {
  const auto recording = openRecording(files, overrides);
  std::vector<StampedPose> poses;
  while (const auto sample = recording->next()) {
    if (const auto* pose = std::get_if<PoseSample>(&*sample)) {
      poses.push_back({pose->t_ns, rigPose(*pose, std::nullopt)});
    }
  }
  return poses;
}

using OnKeyframe = std::function<void(const std::shared_ptr<const Keyframe>&)>;

/// A mapper's own thread may wait for the interpreter's lock, so its end must not hold it.
struct DeleteReleased {
  void operator()(Mapper* mapper) const {
    const py::gil_scoped_release released;
    delete mapper;
  }
};
using MapperPointer = std::unique_ptr<Mapper, DeleteReleased>;

/// A mapper whose callback gets a shared keyframe: a copy shares the images.
MapperPointer makeMapper(const Options& options, const OnKeyframe& on_keyframe) {
  Mapper::Callbacks callbacks;
  if (on_keyframe) {
    callbacks.on_keyframe = [on_keyframe](const Keyframe& keyframe) {
      const py::gil_scoped_acquire held;
      on_keyframe(std::make_shared<const Keyframe>(keyframe));
    };
  }
  return MapperPointer(new Mapper(options, std::move(callbacks)));
}

void addRecording(Mapper& mapper, const Paths& files, const Overrides& overrides) {
  const auto recording = openRecording(files, overrides);
  while (auto sample = recording->next()) {
    mapper.add(std::move(*sample));
    checkSignals();
  }
}

void translateErrors() {
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const py::error_already_set&) {
      throw;
    } catch (const py::builtin_exception&) {
      throw;
    } catch (const std::runtime_error& error) {
      PyErr_SetString(PyExc_OSError, error.what());
    }
  });
}

void defineCameras(py::module_& module) {
  py::class_<RigCamera>(module, "Camera")
      .def(py::init([](int width, int height, const Array& K_array, const std::string& distortion,
                       std::vector<double> coefficients, const std::optional<Array>& T_rig_cam,
                       std::int64_t time_offset_ns) {
             const auto K = matrixOf<Matrix3>(K_array, "K");
             RigCamera camera{{width, height, K(0, 0), K(1, 1), K(0, 2), K(1, 2),
                               distortionModelFromName(distortion), std::move(coefficients)},
                              T_rig_cam ? rigidOf(*T_rig_cam, "T_rig_cam") : Rigid3{},
                              time_offset_ns};
             camera.validate();
             return camera;
           }),
           py::arg("width"), py::arg("height"), py::arg("K"), py::arg("distortion") = "none",
           py::arg("coefficients") = std::vector<double>{}, py::arg("T_rig_cam") = py::none(),
           py::arg("time_offset_ns") = 0)
      .def_property_readonly("width", [](const RigCamera& c) { return c.model.width; })
      .def_property_readonly("height", [](const RigCamera& c) { return c.model.height; })
      .def_property_readonly(
          "K",
          [](const RigCamera& c) { return kOf(c.model.fx, c.model.fy, c.model.cx, c.model.cy); })
      .def_property_readonly(
          "distortion", [](const RigCamera& c) { return std::string(nameOf(c.model.distortion)); })
      .def_property_readonly("coefficients",
                             [](const RigCamera& c) { return c.model.coefficients; })
      .def_property_readonly("T_rig_cam",
                             [](const RigCamera& c) { return arrayOf(matrixOf(c.T_rig_cam)); })
      .def_readonly("time_offset_ns", &RigCamera::time_offset_ns);
}

void defineKeyframes(py::module_& module) {
  py::class_<Keyframe, std::shared_ptr<Keyframe>>(module, "Keyframe")
      .def_property_readonly("t", [](const Keyframe& k) { return k.window.t_ref_ns; })
      .def_property_readonly(
          "window", [](const Keyframe& k) { return std::pair(k.window.t0_ns, k.window.t1_ns); })
      .def_property_readonly("depth", [](const Keyframe& k) { return imageOf(k.map.depth); })
      .def_property_readonly("confidence",
                             [](const Keyframe& k) { return imageOf(k.map.confidence); })
      .def_property_readonly("sigma",
                             [](const Keyframe& k) {
                               cv::Mat1f sigma = cv::Mat1f::zeros(k.map.depth.size());
                               for (int y = 0; y < sigma.rows; ++y) {
                                 for (int x = 0; x < sigma.cols; ++x) {
                                   const float z = k.map.depth(y, x);
                                   sigma(y, x) =
                                       z > 0 ? z * z * std::sqrt(k.map.variance(y, x)) : 0;
                                 }
                               }
                               return imageOf(sigma);
                             })
      .def_property_readonly("pose",
                             [](const Keyframe& k) { return arrayOf(matrixOf(k.T_world_ref)); })
      .def_property_readonly(
          "K", [](const Keyframe& k) { return kOf(k.view.fx, k.view.fy, k.view.cx, k.view.cy); });
}

void defineRecordings(py::module_& module) {
  py::class_<Overrides>(module, "Overrides")
      .def(py::init([](std::filesystem::path poses, std::filesystem::path calibration,
                       std::filesystem::path hand_eye, std::optional<std::int64_t> t0_ns,
                       std::optional<std::int64_t> t1_ns) {
        return Overrides{
            std::move(poses), std::move(calibration), std::move(hand_eye), {t0_ns, t1_ns}};
      }));
  py::class_<EventReader>(module, "EventReader")
      .def(py::init<const Paths&, const Overrides&>(), py::call_guard<py::gil_scoped_release>())
      .def("next", &EventReader::next);
  module.def("read_rig", [](const Paths& files, const Overrides& overrides) {
    const py::gil_scoped_release released;
    return openRecording(files, overrides)->rig().cameras;
  });
  module.def("read_poses", [](const Paths& files, const Overrides& overrides) {
    std::vector<StampedPose> poses;
    {
      const py::gil_scoped_release released;
      poses = readPoses(files, overrides);
    }
    return posesOf(poses);
  });
}

void defineMapper(py::module_& module) {
  py::class_<Options>(module, "Options").def(py::init<>()).def("set", &Options::set);
  const py::call_guard<py::gil_scoped_release> releases;
  py::class_<Mapper, MapperPointer>(module, "Mapper")
      .def(py::init(&makeMapper), py::arg("options"), py::arg("on_keyframe"))
      .def("add_camera", &Mapper::addCamera, releases)
      .def("add_events",
           [](Mapper& mapper, int camera, const EventArray& records) {
             std::vector<Event> events = eventsOf(records);
             const py::gil_scoped_release released;
             mapper.addEvents(camera, std::move(events));
           })
      .def("add_pose",
           [](Mapper& mapper, std::int64_t t_ns, const Array& T_world_rig) {
             const StampedPose pose{t_ns, rigidOf(T_world_rig, "T_world_rig")};
             const py::gil_scoped_release released;
             mapper.addPose(pose);
           })
      .def("add_recording", &addRecording, releases)
      .def("finish", &Mapper::finish, releases)
      .def("points", [](const Mapper& mapper) { return pointsOf(mapper.points()); })
      .def("trajectory", [](const Mapper& mapper) { return posesOf(mapper.trajectory()); })
      .def("warnings", [](const Mapper& mapper) {
        std::vector<std::pair<std::string, std::string>> warnings;
        for (const Warning& warning : mapper.warnings()) {
          warnings.emplace_back(warning.name, warning.text);
        }
        return warnings;
      });
}

}  // namespace

PYBIND11_MODULE(_engine, module) {
  PYBIND11_NUMPY_DTYPE(EventRecord, x, y, p, t);
  module.attr("EVENT_DTYPE") = py::dtype::of<EventRecord>();
  translateErrors();
  defineCameras(module);
  defineKeyframes(module);
  defineRecordings(module);
  defineMapper(module);
}

}  // namespace efm
