// SPDX-License-Identifier: BSD-3-Clause
// event_fusion._engine: the engine of event_fusion/engine.h for Python. The package's Python files
// turn arguments into the types that are taken here, and document the functions.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "arrays.h"
#include "plugin/engine/host_text.h"
#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/open/open_recording.h"
#include "plugin/session/event_fusion_options.h"

namespace efm {
namespace {

/// Opens a recording to read it: poses and calibration may be missing.
std::unique_ptr<Recording> openToRead(RecordingSource source) {
  source.complete = false;
  return openRecording(source);
}

/// The events of a recording's camera. At damage, the events before it come first.
class EventReader {
 public:
  explicit EventReader(const RecordingSource& source) : recording_(openToRead(source)) {}

  /// Returns at most `count` events of the camera; none at the end.
  EventArray next(int camera, std::size_t count) {
    std::vector<Event> part;
    {
      const Released released;
      const std::lock_guard<std::mutex> lock(mutex_);
      while (waiting_.size() < count && readPacket(camera)) checkSignals();
      if (waiting_.empty()) {  // the recording has ended
        const std::string damage = recording_->damage();
        if (!damage.empty()) throw std::runtime_error(damage);
      }
      const auto end =
          waiting_.begin() + static_cast<std::ptrdiff_t>(std::min(count, waiting_.size()));
      part.assign(waiting_.begin(), end);
      waiting_.erase(waiting_.begin(), end);
    }
    return recordsOf(part);
  }

 private:
  bool readPacket(int camera) {
    const std::optional<Sample> sample = recording_->read();
    if (!sample) return false;
    const auto* packet = std::get_if<EventPacket>(&*sample);
    if (packet != nullptr && packet->camera == camera) {
      waiting_.insert(waiting_.end(), packet->events.begin(), packet->events.end());
    }
    return true;
  }

  std::mutex mutex_;  // several threads may take turns
  std::unique_ptr<Recording> recording_;
  std::vector<Event> waiting_;
};

/// Returns the time of a recording's first event, of any camera.
std::optional<std::int64_t> firstEvent(const RecordingSource& source) {
  const auto recording = openToRead(source);
  while (const auto sample = recording->next()) {
    const auto* packet = std::get_if<EventPacket>(&*sample);
    if (packet != nullptr && !packet->events.empty()) return packet->events.front().t_ns;
  }
  return std::nullopt;
}

std::vector<StampedPose> readPoses(const RecordingSource& source) {
  const auto recording = openToRead(source);
  std::vector<StampedPose> poses;
  while (const auto sample = recording->next()) {
    if (const auto* pose = std::get_if<PoseSample>(&*sample)) {
      poses.push_back({pose->t_ns, pose->T_world_rig()});
    }
  }
  return poses;
}

/// Returns the result of a call without the interpreter's lock.
template <typename Call>
auto released(const Call& call) {
  const Released guard;
  return call();
}

void addPoses(Mapper& mapper, const py::array_t<std::int64_t>& t_ns, const Array& T_world_rig) {
  const std::vector<StampedPose> poses = stampedPoses(t_ns, T_world_rig);
  const Released released;
  for (const StampedPose& pose : poses) mapper.addPose(pose);
}

/// A mapper's own thread may wait for the interpreter's lock, so its end must not hold it.
struct DeleteReleased {
  void operator()(Mapper* mapper) const {
    const Released released;
    delete mapper;
  }
};
using MapperPointer = std::unique_ptr<Mapper, DeleteReleased>;

MapperPointer makeMapper(const Options& options, const OnKeyframe& on_keyframe,
                         const std::function<void(const std::string&)>& on_warning) {
  Mapper::Callbacks callbacks;
  callbacks.on_keyframe = [on_keyframe](const Keyframe& keyframe) {
    if (on_keyframe) give(keyframe, on_keyframe);
    checkSignals();  // has no effect in the mapper's own thread
  };
  callbacks.warn = on_warning;
  return MapperPointer(new Mapper(options, std::move(callbacks)));
}

void addRecording(Mapper& mapper, const RecordingSource& source) {
  const auto recording = openRecording(source);
  mapper.addCameras(recording->rig());
  while (auto sample = recording->next()) {
    mapper.add(std::move(*sample));
    checkSignals();
  }
}

/// Sets an error of Python. Names of files need not be UTF-8.
void setError(PyObject* type, const char* what) {
  const std::string text = hostText(what, HostFace::kRecording);
  const auto decoded = py::reinterpret_steal<py::object>(
      PyUnicode_DecodeUTF8(text.data(), static_cast<py::ssize_t>(text.size()), "surrogateescape"));
  if (decoded) PyErr_SetObject(type, decoded.ptr());
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
      setError(PyExc_OSError, error.what());
    } catch (const std::invalid_argument& error) {
      setError(PyExc_ValueError, error.what());
    } catch (const std::logic_error& error) {
      setError(PyExc_RuntimeError, error.what());
    }
  });
}

void defineCameras(py::module_& module) {
  py::class_<RigCamera>(module, "Camera", R"(A calibrated camera of a rig.

Parameters
----------
width, height : int
    Pixels of the sensor.
K : array_like, shape (3, 3)
    Camera matrix, pixels, without skew.
distortion : str
    The lens, as Kalibr calls it: 'none', 'radtan' or 'equidistant'.
coefficients : sequence of float
    k1 k2 p1 p2, or k1 k2 p1 p2 k3, of radtan; k1 k2 k3 k4 of equidistant.
T_rig_cam : array_like, shape (4, 4) or (7,)
    Maps coordinates of the camera (x right, y down, z forward) to the rig's, metres; a matrix, or tx ty tz qx qy qz qw.
    By default the camera's frame is the rig's.
time_offset_ns : int
    Added to the camera's times to get the clock of the poses.

Raises
------
ValueError
    If a value is not that of a camera.
)")
      .def(py::init([](int width, int height, const Array& K_array, const std::string& distortion,
                       std::vector<double> coefficients, const std::optional<Array>& T_rig_cam,
                       std::int64_t time_offset_ns) {
             const auto K = matrixOf<Matrix3>(K_array, "K");
             if (!isCameraMatrix({K.data(), K.data() + K.size()})) {
               throw std::invalid_argument(
                   "K: expected [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], without skew");
             }
             RigCamera camera{{width, height, K(0, 0), K(1, 1), K(0, 2), K(1, 2),
                               fromName<DistortionModel>(distortion), std::move(coefficients)},
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
      .def_readonly("time_offset_ns", &RigCamera::time_offset_ns)
      .def("__repr__", [](const RigCamera& c) {
        return fmt::format("<Camera of {} x {} pixels, focal length {:g} px, lens {}>",
                           c.model.width, c.model.height, c.model.fx, nameOf(c.model.distortion));
      });
}

/// Returns a copy of an array as an image.
cv::Mat1f imageFrom(const py::handle& pickled) {
  using Image = py::array_t<float, py::array::c_style | py::array::forcecast>;
  const auto array = pickled.cast<Image>();
  if (array.ndim() != 2) throw std::invalid_argument("a pickled keyframe: expected images");
  return cv::Mat1f(static_cast<int>(array.shape(0)), static_cast<int>(array.shape(1)),
                   const_cast<float*>(array.data()))
      .clone();
}

/// Returns the standard deviation of each depth, in metres; 0 where there is no depth.
cv::Mat1f sigmaOf(const DepthMap& map) {
  cv::Mat1f sigma = cv::Mat1f::zeros(map.depth.size());
  for (int y = 0; y < sigma.rows; ++y) {
    for (int x = 0; x < sigma.cols; ++x) {
      const float z = map.depth(y, x);
      if (z > 0) sigma(y, x) = z * z * std::sqrt(map.variance(y, x));
    }
  }
  return sigma;
}

/// Returns the points (n, 3) of a keyframe's pixels with depth, in the world, row by row.
py::array_t<double> worldPoints(const Keyframe& keyframe) {
  const cv::Mat1f& depth = keyframe.map.depth;
  const ReferenceView& view = keyframe.view;
  py::array_t<double> points({py::ssize_t{cv::countNonZero(depth)}, py::ssize_t{3}});
  double* next = points.mutable_data();
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const double z = depth(y, x);
      if (!(z > 0)) continue;
      const Eigen::Vector3d p_ref((x - view.cx) / view.fx * z, (y - view.cy) / view.fy * z, z);
      Eigen::Map<Eigen::Vector3d>{next} = keyframe.T_world_ref * p_ref;
      next += 3;
    }
  }
  return points;
}

void defineKeyframes(py::module_& module) {
  py::class_<Keyframe, std::shared_ptr<Keyframe>>(module, "Keyframe",
                                                  R"(The depth map of a window of events.

Attributes
----------
t : int
    Time of the view, nanoseconds.
window : (int, int)
    Begin and end of the events, nanoseconds.
depth : numpy.ndarray, float32, shape (rows, columns)
    Metres along z of the view; 0: no depth. Read-only, as the others.
confidence : numpy.ndarray, float32, shape (rows, columns)
    Fused ray density at the depth, or the largest of the pixel.
sigma : numpy.ndarray, float32, shape (rows, columns)
    Standard deviation of the depth, metres; 0: no depth.
probability : numpy.ndarray, float32, shape (rows, columns)
    Probability that the depth is within 10 % of the truth; 0: no depth, NaN: not known (``depth.extraction``: paper).
pose : numpy.ndarray, float64, shape (4, 4)
    T_world_ref: maps coordinates of the view (x right, y down, z forward) to the world.
K : numpy.ndarray, float64, shape (3, 3)
    Camera matrix of the view, which has no distortion.
)")
      .def_property_readonly("t", [](const Keyframe& k) { return k.window.t_ref_ns; })
      .def_property_readonly(
          "window", [](const Keyframe& k) { return std::pair(k.window.t0_ns, k.window.t1_ns); })
      .def_property_readonly("depth", [](const Keyframe& k) { return imageOf(k.map.depth); })
      .def_property_readonly("confidence",
                             [](const Keyframe& k) { return imageOf(k.map.confidence); })
      .def_property_readonly("sigma", [](const Keyframe& k) { return imageOf(sigmaOf(k.map)); })
      .def_property_readonly("probability",
                             [](const Keyframe& k) { return imageOf(k.map.probability); })
      .def("points", &worldPoints,
           "The points (n, 3) of the depths in the world, metres, row by row.")
      .def_property_readonly("pose",
                             [](const Keyframe& k) { return arrayOf(matrixOf(k.T_world_ref)); })
      .def_property_readonly(
          "K", [](const Keyframe& k) { return kOf(k.view.fx, k.view.fy, k.view.cx, k.view.cy); })
      .def(py::pickle(
          [](const Keyframe& k) {
            const Eigen::Quaterniond& q = k.T_world_ref.rotation;
            const Eigen::Vector3d& p = k.T_world_ref.translation;
            return py::make_tuple(k.window.t0_ns, k.window.t1_ns, k.window.t_ref_ns,
                                  std::array{p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()},
                                  std::array{k.view.fx, k.view.fy, k.view.cx, k.view.cy},
                                  imageOf(k.map.depth), imageOf(k.map.confidence),
                                  imageOf(k.map.variance), imageOf(k.map.probability));
          },
          [](const py::tuple& state) {
            auto keyframe = std::make_shared<Keyframe>();
            const auto pose = state[3].cast<std::array<double, 7>>();
            const auto view = state[4].cast<std::array<double, 4>>();
            keyframe->window = {state[0].cast<std::int64_t>(), state[1].cast<std::int64_t>(),
                                state[2].cast<std::int64_t>()};
            keyframe->T_world_ref = {{pose[6], pose[3], pose[4], pose[5]},
                                     {pose[0], pose[1], pose[2]}};
            keyframe->map.depth = imageFrom(state[5]);
            keyframe->map.confidence = imageFrom(state[6]);
            keyframe->map.variance = imageFrom(state[7]);
            if (state.size() > 8) {
              keyframe->map.probability = imageFrom(state[8]);
            } else {  // pickled by an earlier version
              keyframe->map.probability = keyframe->map.depth.clone();
              keyframe->map.probability.setTo(NAN, keyframe->map.depth > 0);
            }
            const cv::Size size = keyframe->map.depth.size();
            keyframe->view = {size.width, size.height, view[0], view[1], view[2], view[3]};
            return keyframe;
          }))
      .def("__repr__", [](const Keyframe& k) {
        return fmt::format("<Keyframe at {} ns: {} depths>", k.window.t_ref_ns,
                           cv::countNonZero(k.map.depth));
      });
}

void defineRecordings(py::module_& module) {
  py::class_<RecordingSource>(module, "Source")
      .def(py::init([](const Paths& files, std::filesystem::path poses,
                       std::filesystem::path calibration, std::filesystem::path hand_eye,
                       std::string format, std::vector<std::string> topics,
                       std::string event_columns, std::string time_unit, std::string pose_time_unit,
                       std::optional<std::pair<int, int>> sensor_size,
                       std::uint64_t skip_bad_events, std::vector<int> cameras) {
        Overrides overrides{std::move(poses),          std::move(calibration),
                            std::move(hand_eye),       {},
                            std::move(format),         std::move(topics),
                            std::move(event_columns),  std::move(time_unit),
                            std::move(pose_time_unit), sensor_size,
                            skip_bad_events,           std::move(cameras)};
        return sourceOf(files, overrides);
      }))
      .def("set_limits", [](RecordingSource& source, std::optional<std::int64_t> t0_ns,
                            std::optional<std::int64_t> t1_ns) {
        source.limits = {t0_ns, t1_ns};
        source.limits.validate();
      });
  py::class_<EventReader>(module, "EventReader")
      .def(py::init<const RecordingSource&>(), py::call_guard<Released>())
      .def("next", &EventReader::next);
  module.def("read_rig", [](const RecordingSource& source) {
    const Released released;
    return openToRead(source)->rig().cameras;
  });
  module.def("first_event", &firstEvent, py::call_guard<Released>());
  module.def("read_poses", [](const RecordingSource& source) {
    std::vector<StampedPose> poses;
    {
      const Released released;
      poses = readPoses(source);
    }
    return posesOf(poses);
  });
}

void defineMapper(py::module_& module) {
  py::class_<Options>(module, "Options")
      .def(py::init<>())
      .def("set", &Options::set)
      .def("read", &Options::read)
      .def("validate", [](const Options& options) { options.values(); });
  const py::call_guard<Released> releases;
  py::class_<Mapper, MapperPointer>(module, "Mapper")
      .def(py::init(&makeMapper), py::arg("options"), py::arg("on_keyframe"), py::arg("on_warning"))
      .def("add_camera", &Mapper::addCamera, releases)
      .def(
          "add_events",
          [](Mapper& mapper, int camera, const EventArray& records) {
            std::vector<Event> events = eventsOf(records);
            const Released released;
            mapper.addEvents(camera, std::move(events));
          },
          py::arg("camera"), py::arg("records").noconvert())  // it would convert by position
      .def("add_poses", &addPoses)
      .def("add_recording", &addRecording, releases)
      .def("finish", &Mapper::finish, releases)
      .def("stop", &Mapper::stop, releases)
      .def(
          "save",
          [](const Mapper& mapper, const std::filesystem::path& file) {
            savePoints(*mapper.snapshot(), file);
          },
          releases)
      .def(
          "status",
          [](const Mapper& mapper) {
            const SessionStatus status = mapper.status();
            return std::pair(status.counts.keyframes, status.live ? status.live->dropRatio() : 0);
          },
          releases)
      .def(
          "points",
          [](const Mapper& mapper) { return pointsOf(*released([&] { return mapper.points(); })); })
      .def(
          "hash", [](const Mapper& mapper) { return mapHash(*mapper.points()); },
          py::call_guard<Released>())
      .def("trajectory",
           [](const Mapper& mapper) {
             return posesOf(released([&] { return mapper.trajectory(); }));
           })
      .def(
          "warnings",
          [](const Mapper& mapper) {
            std::vector<std::pair<std::string, std::string>> warnings;
            for (const Warning& warning : mapper.warnings()) {
              warnings.emplace_back(warning.name, warning.text);
            }
            return warnings;
          },
          releases);
}

}  // namespace

PYBIND11_MODULE(_engine, module) {
  PYBIND11_NUMPY_DTYPE(EventRecord, x, y, p, t);
  PYBIND11_NUMPY_DTYPE(PointRecord, x, y, z, intensity, support, sigma, probability);
  module.attr("VERSION") = EFM_VERSION;
  hostIsPython() = true;
  module.def("python_text",
             [](const std::string& text) { return hostText(text, HostFace::kRecording); });
  module.attr("EVENT_DTYPE") = py::dtype::of<EventRecord>();
  translateErrors();
  defineCameras(module);
  defineKeyframes(module);
  defineRecordings(module);
  defineMapper(module);
  defineJobs(module);
  defineExperiments(module);
  // At Python's exit, after the mappers are stopped.
  module.def("wait_for_calls", &ReleasedCalls::end);
}

}  // namespace efm
