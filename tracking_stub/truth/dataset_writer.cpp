// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/truth/dataset_writer.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "mapping/base/option.h"
#include "mapping/base/picture_file.h"
#include "mapping/base/text.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/geometry/trajectory.h"
#include "tracking_stub/rendering/frame_renderer.h"

namespace efm {
namespace {

int cellsAlong(double length_m, double cell_m) {
  return std::max(1, static_cast<int>(std::lround(length_m / cell_m)));
}

/// Returns the cell of a position. The last cell contains its far border.
int cellOf(double position_m, double length_m, int cells) {
  return std::clamp(static_cast<int>(position_m / length_m * cells), 0, cells - 1);
}

namespace fs = std::filesystem;

constexpr std::int64_t kDepthPeriodNs = 50'000'000;

std::runtime_error cannotWrite(const fs::path& path) {
  const std::string why =
      errno == ENOSPC || errno == EFBIG ? ": " + std::string(std::strerror(errno)) : "";
  return std::runtime_error(path.string() + ": cannot be written" + why);
}

void makeFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw std::runtime_error(folder.string() + ": cannot be made: " + error.message());
}

void writeText(const fs::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary);
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.close();
  if (!stream) throw cannotWrite(file);
}

template <typename Number>
void appendNumber(std::string& text, Number number) {
  char digits[24];
  const auto result = std::to_chars(digits, digits + sizeof(digits), number);
  text.append(digits, result.ptr);
}

/// Appends seconds like formatSeconds, but fast enough for each event.
void appendSeconds(std::string& text, std::int64_t t_ns) {
  if (t_ns < 0) {
    text += formatSeconds(t_ns);
    return;
  }
  appendNumber(text, t_ns / kNanosecondsPerSecond);
  char decimals[] = ".000000000";
  for (std::int64_t rest = t_ns % kNanosecondsPerSecond, i = 9; rest > 0; rest /= 10, --i) {
    decimals[i] = static_cast<char>('0' + rest % 10);
  }
  text.append(decimals, 10);
}

/// Appends the matrix of a transform as YAML, in Kalibr's layout.
void appendMatrix(std::ostream& text, const Rigid3& T_a_b) {
  const Eigen::Matrix3d rotation = T_a_b.rotation.toRotationMatrix();
  for (int row = 0; row < 3; ++row) {
    text << "  - [" << rotation(row, 0) << ", " << rotation(row, 1) << ", " << rotation(row, 2)
         << ", " << T_a_b.translation[row] << "]\n";
  }
  text << "  - [0, 0, 0, 1]\n";
}

constexpr std::uint32_t kMinEvents = 3;
/// Time between two views. Rays of one view miss some cells; all views together hit these cells.
constexpr std::int64_t kViewPeriodNs = 20'000'000;

void addVisibleCells(const Scene& scene, const PixelRays& rays, const Rigid3& T_world_cam,
                     SurfaceCells& seen) {
  const SceneView view(scene, T_world_cam, rays.bounds());
  for (int y = 0; y < rays.height(); ++y) {
    for (int x = 0; x < rays.width(); ++x) {
      const Eigen::Vector2d& ray = rays(x, y).ray;
      seen.add(view.surfacePointOf(view.cast(ray), ray));
    }
  }
}

/// Writes the truth for maps: a point per cell of about `Simulation::truth_cell_m` on the true
/// surfaces, frame `world`. gt_cloud.ply has all cells that a pixel saw; gt_edges.ply has the cells
/// with at least 3 events, which a semi-dense map should contain.
void writeTruthClouds(const fs::path& folder, const Simulation& simulation,
                      const std::vector<CameraRecording>& recordings) {
  SurfaceCells seen(simulation.scene, simulation.truth_cell_m);
  SurfaceCells fired(simulation.scene, simulation.truth_cell_m);
  for (const RigCamera& camera : simulation.rig.cameras) {
    const PixelRays rays(camera.model);
    for (std::int64_t t_ns = simulation.start_ns; t_ns <= simulation.endNs();
         t_ns += kViewPeriodNs) {
      addVisibleCells(simulation.scene, rays, simulation.motion->poseAt(t_ns) * camera.T_rig_cam,
                      seen);
    }
  }
  for (const CameraRecording& recording : recordings) {
    for (const SurfacePoint& source : recording.sources) {
      seen.add(source);
      fired.add(source);
    }
  }
  writePly(folder / "gt_cloud.ply", seen.centers(1));
  writePly(folder / "gt_edges.ply", fired.centers(kMinEvents));
}

void writeDepthMaps(const fs::path& depth_folder, const Simulation& simulation,
                    const std::function<void()>& before_file) {
  makeFolder(depth_folder);
  const ReferenceView view = ReferenceView::of(simulation.rig.cameras[0].model);
  std::string index;
  for (std::int64_t t_ns = simulation.start_ns; t_ns <= simulation.endNs();
       t_ns += kDepthPeriodNs) {
    before_file();
    const std::string name = "cam0_" + formatSeconds(t_ns) + ".tiff";
    const fs::path file = depth_folder / name;
    const Rigid3 T_world_cam0 = simulation.motion->poseAt(t_ns);
    writeText(file, encodeTiff(renderDepth(simulation.scene, T_world_cam0, view)));
    index += formatSeconds(t_ns) + " " + name + "\n";
  }
  writeText(depth_folder / "index.txt", index);
}

}  // namespace

SurfaceCells::SurfaceCells(const Scene& scene, double cell_m) : scene_(&scene) {
  requireOption(cell_m > 0, "cell_m", cell_m, "above 0");
  for (int surface = 0; surface < scene.size(); ++surface) {
    const Rectangle& r = scene.rectangle(surface);
    Grid grid;
    grid.columns = cellsAlong(r.width_m, cell_m);
    grid.rows = cellsAlong(r.height_m, cell_m);
    grid.counts.resize(static_cast<std::size_t>(grid.columns) *
                       static_cast<std::size_t>(grid.rows));
    grids_.push_back(std::move(grid));
  }
}

void SurfaceCells::add(const SurfacePoint& point) {
  if (point.surface < 0) return;
  const Rectangle& r = scene_->rectangle(point.surface);
  Grid& grid = grids_[static_cast<std::size_t>(point.surface)];
  const int column = cellOf(point.u_m, r.width_m, grid.columns);
  const int row = cellOf(point.v_m, r.height_m, grid.rows);
  ++grid.counts[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
                static_cast<std::size_t>(column)];
}

std::vector<Eigen::Vector3f> SurfaceCells::centers(std::uint32_t min_count) const {
  std::vector<Eigen::Vector3f> centers;
  for (int surface = 0; surface < scene_->size(); ++surface) {
    const Rectangle& r = scene_->rectangle(surface);
    const Grid& grid = grids_[static_cast<std::size_t>(surface)];
    auto count = grid.counts.begin();
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        if (*count++ < min_count) continue;
        const Eigen::Vector3d center = r.pointAt((column + 0.5) * r.width_m / grid.columns,
                                                 (row + 0.5) * r.height_m / grid.rows);
        centers.push_back(center.cast<float>());
      }
    }
  }
  return centers;
}

void writeDataset(const fs::path& folder, const Simulation& simulation,
                  const std::vector<CameraRecording>& recordings,
                  const std::function<void()>& before_file) {
  const std::vector<RigCamera>& cameras = simulation.rig.cameras;
  requireOption(!cameras.empty() && recordings.size() == cameras.size(), "recordings",
                recordings.size(), "one per camera, at least one");
  const Rigid3& T_rig_cam0 = cameras[0].T_rig_cam;
  requireOption(T_rig_cam0.translation.isZero(0) && T_rig_cam0.rotation.vec().isZero(0),
                "T_rig_cam of camera 0", T_rig_cam0.translation.transpose(),
                "the identity: poses.txt holds T_world_cam0");

  for (std::size_t camera = 0; camera < cameras.size(); ++camera) {
    const fs::path camera_folder = folder / ("cam" + std::to_string(camera));
    makeFolder(camera_folder);
    before_file();
    writeEvents(camera_folder / "events.txt", recordings[camera].events);
  }
  writeText(folder / "camchain.yaml", formatCamchain(simulation.rig));
  writeTumTrajectory(folder / "poses.txt", samplePoses(simulation));
  writeDepthMaps(folder / "depth", simulation, before_file);
  before_file();
  writeTruthClouds(folder, simulation, recordings);
  before_file();
}

void appendEvents(std::string& text, EventSpan events) {
  for (const Event& event : events) {
    appendSeconds(text, event.t_ns);
    text += ' ';
    appendNumber(text, event.x);
    text += ' ';
    appendNumber(text, event.y);
    text += event.polarity ? " 1\n" : " 0\n";
  }
}

void writeEvents(const fs::path& file, const std::vector<Event>& events) {
  constexpr std::size_t kBlock = 50'000;
  std::ofstream stream(file, std::ios::binary);
  std::string text;
  for (std::size_t i = 0; i < events.size(); i += kBlock) {
    text.clear();
    appendEvents(text, EventSpan(events).part(i, std::min(i + kBlock, events.size())));
    stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  }
  stream.close();
  if (!stream) throw cannotWrite(file);
}

std::string formatCamchain(const Rig& rig) {
  NumberText text;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const CameraModel& model = rig.cameras[i].model;
    text << "cam" << i << ":\n";
    if (i > 0) {
      text << "  T_cn_cnm1:\n";
      appendMatrix(text, rig.cameras[i].T_rig_cam.inverse() * rig.cameras[i - 1].T_rig_cam);
    }
    text << "  camera_model: pinhole\n  distortion_coeffs: [";
    for (std::size_t k = 0; k < model.coefficients.size(); ++k) {
      text << (k > 0 ? ", " : "") << model.coefficients[k];
    }
    text << "]\n  distortion_model: " << nameOf(model.distortion) << "\n  intrinsics: [" << model.fx
         << ", " << model.fy << ", " << model.cx << ", " << model.cy << "]\n  resolution: ["
         << model.width << ", " << model.height << "]\n";
  }
  return text.str();
}

void writePly(const fs::path& file, const std::vector<Eigen::Vector3f>& points) {
  NumberText header;
  header << "ply\nformat binary_little_endian 1.0\nelement vertex " << points.size()
         << "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  std::ofstream stream(file, std::ios::binary);
  stream << header.str();
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  stream.write(reinterpret_cast<const char*>(points.data()),
               static_cast<std::streamsize>(points.size() * sizeof(Eigen::Vector3f)));
  stream.close();
  if (!stream) throw cannotWrite(file);
}

}  // namespace efm
