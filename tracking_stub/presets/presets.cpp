// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/presets/presets.h"

#include <Eigen/Geometry>
#include <memory>
#include <string_view>

#include "mapping/geometry/timestamp.h"
#include "tracking_stub/motion/motion.h"
#include "tracking_stub/scenes/furnishing.h"
#include "tracking_stub/scenes/scenes.h"

namespace efm {
namespace {

using Eigen::Vector3d;

/// Start time of every preset.
constexpr std::int64_t kPresetStartNs = kNanosecondsPerSecond;

/// Returns R_world_cam of a level camera (x right, y down, z forward) that looks along +y in a
/// world whose z axis is up.
Eigen::Quaterniond lookingAlongY() {
  Eigen::Matrix3d R_world_cam;
  R_world_cam << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return Eigen::Quaterniond(R_world_cam);
}

/// Returns a preset without scene, rig and motion.
/// @param threshold contrast threshold of both polarities, in log intensity.
Simulation emptyPreset(double duration_s, double threshold, std::uint64_t seed) {
  Simulation simulation;
  simulation.start_ns = kPresetStartNs;
  simulation.duration_ns = durationFromSeconds(duration_s);
  simulation.pixels.threshold_on = simulation.pixels.threshold_off = threshold;
  simulation.seed = seed;
  return simulation;
}

void addDeskRoom(Scene& scene, Painting& painting) {
  const Vector3d x = Vector3d::UnitX();
  const Vector3d y = Vector3d::UnitY();
  const Vector3d z = Vector3d::UnitZ();
  // Floor, back wall, left wall, right wall, ceiling. The normals point into the room.
  scene.addRectangle({{-2.2, -0.5, -0.75}, x, y, 4.4, 4.8}, painting.clutter(1.3, 0.22));
  scene.addRectangle({{-2.2, 4.1, -0.75}, x, z, 4.4, 3.6}, painting.clutter(3.2, 0.36));
  scene.addRectangle({{-2.2, -0.5, -0.75}, y, z, 4.8, 3.6}, painting.clutter(2.0, 0.30));
  scene.addRectangle({{2.2, -0.5, -0.75}, z, y, 3.6, 4.8}, painting.clutter(2.0, 0.30));
  scene.addRectangle({{-2.2, -0.5, 2.85}, y, x, 4.8, 4.4}, painting.clutter(2.0, 0.40));
}

void addDeskFurniture(Scene& scene, Painting& painting) {
  addStandingBox(scene, {-1.35, 3.1, -0.75}, {0.7, 0.45, 1.75}, 18, painting.clutter(2.4, 0.22));
  addStandingBox(scene, {0.45, 3.3, -0.75}, {0.8, 0.4, 1.15}, -12, painting.clutter(2.4, 0.22));
  addStandingBox(scene, {1.45, 2.2, -0.75}, {0.5, 0.5, 0.95}, 35, painting.clutter(1.6, 0.18));
  // The desk: its top is at z = 0.
  addStandingBox(scene, {0, 0.72, -0.05}, {1.7, 1.6, 0.05}, 0, painting.clutter(0.6, 0.13));
}

void addDeskObjects(Scene& scene, Painting& painting) {
  addStandingBox(scene, {-0.42, 1.15, 0}, {0.26, 0.20, 0.32}, 24, painting.clutter(0.7, 0.10));
  addStandingBox(scene, {0.10, 1.30, 0}, {0.30, 0.08, 0.42}, -9, painting.clutter(0.8, 0.11));
  addStandingBox(scene, {0.55, 1.05, 0}, {0.18, 0.24, 0.22}, -33, painting.clutter(0.6, 0.09));
  addStandingBox(scene, {-0.16, 0.86, 0}, {0.14, 0.11, 0.16}, 41, painting.clutter(0.6, 0.07));
  addStandingBox(scene, {0.24, 0.83, 0}, {0.22, 0.15, 0.07}, 15, painting.clutter(0.6, 0.07));
  addStandingBox(scene, {0.22, 0.83, 0.07}, {0.18, 0.13, 0.05}, -20, painting.clutter(0.6, 0.07));
  addStandingBox(scene, {-0.62, 0.80, 0}, {0.12, 0.16, 0.10}, 12, painting.clutter(0.6, 0.07));
  // A leaning board: its planes and edges are neither level nor upright.
  Rigid3 T_world_board;
  T_world_board.rotation = Eigen::AngleAxisd(radians(-30), Vector3d::UnitZ()) *
                           Eigen::AngleAxisd(radians(25), Vector3d::UnitX()) *
                           Eigen::AngleAxisd(radians(14), Vector3d::UnitY());
  T_world_board.translation = {0.62, 1.42, 0.28};
  scene.addBox(T_world_board, {0.36, 0.03, 0.48}, painting.clutter(0.8, 0.11));
}

std::shared_ptr<const Motion> deskMotion() {
  SmoothMotionOptions options;
  options.start_ns = kPresetStartNs;
  // Looks along +y and 15 degrees down; camera x is world x.
  options.T_world_center.rotation =
      lookingAlongY() * Eigen::AngleAxisd(radians(-15), Vector3d::UnitX());
  options.T_world_center.translation = {-0.05, 0, 0.68};
  // The phases of x and y differ by a quarter of a period, which makes a circle: the camera never
  // rests, and edges of every orientation have parallax.
  options.translation[0] = {{0.09, 0.43, 0.0}, {0.010, 1.7, 0.9}};
  options.translation[1] = {{0.12, 0.48, 1.3}, {0.010, 1.9, 2.5}};
  options.translation[2] = {{0.06, 0.60, 3.6}, {0.006, 1.5, 0.4}};
  options.rotation[0] = {{radians(0.9), 0.8, 0.3}, {radians(0.2), 2.1, 1.1}};
  options.rotation[1] = {{radians(1.0), 0.7, 2.0}, {radians(0.2), 1.8, 2.0}};
  options.rotation[2] = {{radians(2.5), 0.6, 1.9}, {radians(0.4), 1.6, 0.2}};
  return std::make_shared<SmoothMotion>(options);
}

/// Makes a hand-held stereo pair that looks over a cluttered desk into a room. World: x right, y
/// into the room, z up, the desk's top at z = 0. About a million events per camera.
Simulation makeDeskStereo(std::uint64_t seed) {
  constexpr double kFocalPx = 226;
  Simulation simulation = emptyPreset(2, 0.21, seed);
  Painting painting(PaintingOptions{seed, kFocalPx});
  addDeskRoom(simulation.scene, painting);
  addDeskFurniture(simulation.scene, painting);
  addDeskObjects(simulation.scene, painting);
  simulation.rig = makeStereoRig(makePinhole(346, 260, kFocalPx), 0.10);
  simulation.motion = deskMotion();
  return simulation;
}

/// Makes a stereo pair on a car's roof, 1.9 m above the road, that drives along a street at 8 m/s.
/// World: y along the street, z up, the road at z = 0. Some pixels see the sky.
Simulation makeDriveStereo(std::uint64_t seed) {
  constexpr double kBaselineM = 0.60;
  constexpr double kSpeed = 8;  // m/s
  constexpr double kDurationS = 1.2;
  StreetOptions street;
  for (double y = 0; y <= kSpeed * kDurationS; ++y) street.path.emplace_back(0, y);
  street.min_length_m = 49;
  street.focal_px = 550;
  street.seed = seed;

  CameraModel model = makePinhole(640, 480, street.focal_px);
  model.distortion = DistortionModel::kRadtan;
  model.coefficients = {-0.09, 0.18, 0.0001, 0.0006};

  SmoothMotionOptions motion;
  motion.start_ns = kPresetStartNs;
  motion.T_world_center.rotation = lookingAlongY();
  // The pair is in the middle of the car.
  motion.T_world_center.translation = {-0.5 * kBaselineM, 0, 1.9};
  motion.velocity = {0, 0, kSpeed};  // along the camera's axes: forwards
  // Sideways within the lane, and up and down on the springs.
  motion.translation[0] = {{0.15, 0.35, 0.2}};
  motion.translation[1] = {{0.015, 1.5, 0.4}};
  motion.rotation[0] = {{radians(0.25), 1.5, 1.0}};
  motion.rotation[1] = {{radians(0.8), 0.35, 1.8}};
  motion.rotation[2] = {{radians(0.3), 1.1, 0.5}};

  Simulation simulation = emptyPreset(kDurationS, 0.25, seed);
  simulation.scene = makeStreet(street);
  simulation.rig = makeStereoRig(model, kBaselineM);
  simulation.motion = std::make_shared<SmoothMotion>(motion);
  // The road directly before the car moves six times as fast as most of the image. Its edges are
  // softer: with a blur of a pixel, a step of 1 misplaces an edge by 0.15 pixels.
  simulation.max_step_px = 1;
  simulation.truth_cell_m = 0.05;
  return simulation;
}

/// Makes a stereo pair of high resolution in a furnished room. World: z up. About 2.8 million
/// events per camera.
Simulation makeHdStereo(std::uint64_t seed) {
  RoomOptions room;
  room.size_m = {4.8, 4.2, 2.6};
  room.furniture_depth_m = 0.7;
  room.nearest_m = 1.8;  // edges on nearer surfaces are slightly softer
  room.focal_px = 900;
  room.seed = seed;

  CameraModel model = makePinhole(1280, 720, room.focal_px);
  model.distortion = DistortionModel::kRadtan;
  model.coefficients = {-0.10, 0.06, 0.0004, -0.0006};

  SmoothMotionOptions motion;
  motion.start_ns = kPresetStartNs;
  motion.T_world_center.rotation =
      lookingAlongY() * Eigen::AngleAxisd(radians(-8), Eigen::Vector3d::UnitX());
  motion.T_world_center.translation = {0.3, 0.1, 1.3};
  motion.velocity = {0.2, 0, 0.05};
  motion.translation[1] = {{0.04, 0.8, 0.5}};
  motion.rotation[2] = {{radians(1.0), 0.7, 1.9}};

  Simulation simulation = emptyPreset(0.8, 0.16, seed);
  simulation.scene = makeRoom(room);
  simulation.rig = makeStereoRig(model, 0.12);
  simulation.rig.cameras[1].model.fx = simulation.rig.cameras[1].model.fy = 904;
  simulation.rig.cameras[1].model.coefficients = {-0.11, 0.07, -0.0003, 0.0005};
  simulation.motion = std::make_shared<SmoothMotion>(motion);
  simulation.max_step_px = 0.5;  // misplaces an edge by at most 0.04 pixels
  return simulation;
}

/// Makes the cameras of desk_stereo in front of thin poles, 3 to 6 pixels wide, and a wall behind
/// the poles. World: y forward, z up, the origin at the cameras.
Simulation makePolesStereo(std::uint64_t seed) {
  PolesOptions poles;
  poles.nearest_m = 1.05;
  poles.farthest_m = 3;
  poles.wall_m = 4;
  poles.focal_px = 226;
  poles.seed = seed;

  SmoothMotionOptions motion;
  motion.start_ns = kPresetStartNs;
  motion.T_world_center.rotation = lookingAlongY();
  motion.translation[0] = {{0.16, 0.45, 0.0}, {0.010, 1.7, 0.9}};
  motion.translation[1] = {{0.12, 0.55, 1.3}, {0.006, 1.9, 2.5}};
  motion.translation[2] = {{0.10, 0.50, 2.0}, {0.004, 1.5, 0.4}};
  motion.rotation[0] = {{radians(1.2), 0.8, 0.3}};
  motion.rotation[1] = {{radians(1.2), 0.7, 2.0}};
  motion.rotation[2] = {{radians(2.0), 0.6, 1.9}};

  Simulation simulation = emptyPreset(1.5, 0.21, seed);
  simulation.scene = makePoles(poles);
  simulation.rig = makeStereoRig(makePinhole(346, 260, poles.focal_px), 0.10);
  simulation.motion = std::make_shared<SmoothMotion>(motion);
  return simulation;
}

/// Makes the cameras of desk_stereo move once around in a furnished room and look outwards. The
/// last pose is the first pose. World: origin in the middle of the floor, z up.
Simulation makeRoomStereo(std::uint64_t seed) {
  constexpr double kDurationS = 8;
  RoomOptions room;
  room.size_m = {7.2, 5.8, 2.8};
  room.nearest_m = 1.0;
  room.focal_px = 226;
  room.seed = seed;

  // The sway of a hand. The loop has whole periods of the sway, so that the loop closes.
  SmoothMotionOptions sway;
  sway.start_ns = kPresetStartNs;
  const double loop_hz = 1 / kDurationS;
  sway.translation[0] = {{0.02, 7 * loop_hz, 0.4}};
  sway.translation[1] = {{0.08, 5 * loop_hz, 1.1}};
  sway.translation[2] = {{0.06, 6 * loop_hz, 2.0}};
  sway.rotation[0] = {{radians(5), 3 * loop_hz, 0.3}, {radians(0.2), 11 * loop_hz, 1.1}};
  sway.rotation[1] = {{radians(2), 4 * loop_hz, 2.0}};
  sway.rotation[2] = {{radians(2), 5 * loop_hz, 1.9}};

  LoopMotionOptions loop;
  loop.start_ns = kPresetStartNs;
  loop.period_s = kDurationS;
  loop.radius_x_m = 1.0;
  loop.radius_y_m = 0.65;
  loop.height_m = 1.25;
  loop.heading_rad = radians(35);
  loop.sway = std::make_shared<SmoothMotion>(sway);

  Simulation simulation = emptyPreset(kDurationS, 0.42, seed);
  simulation.scene = makeRoom(room);
  simulation.rig = makeStereoRig(makePinhole(346, 260, room.focal_px), 0.10);
  simulation.motion = std::make_shared<LoopMotion>(loop);
  // The rotation moves the image by 1.25 pixels in the corners and 0.8 pixels in the middle. This
  // misplaces an edge by at most 0.25 and 0.1 pixels, with both signs equally often.
  simulation.max_step_px = 1.25;
  return simulation;
}

/// Adds a board or box before the camera; its front is rotated to the right by `right_deg`.
void addBoard(Scene& scene, const Vector3d& center, const Vector3d& size_m, double right_deg,
              const Scene::Painter& paint) {
  Rigid3 T_world_board;
  T_world_board.translation = center;
  T_world_board.rotation = Eigen::AngleAxisd(radians(right_deg), Vector3d::UnitY()) *
                           Eigen::AngleAxisd(radians(0.3 * right_deg), Vector3d::UnitZ());
  scene.addBox(T_world_board, size_m, paint);
}

Scene sliderScene(std::uint64_t seed, double focal_px) {
  Painting painting(PaintingOptions{seed, focal_px});
  Scene scene;
  // The wall: x right, y down. Its normal, x cross -y, points to the camera.
  scene.addRectangle({{-2, 1.5, 2.3}, Vector3d::UnitX(), -Vector3d::UnitY(), 4, 3},
                     painting.clutter(2.3, 0.2));
  addBoard(scene, {-0.62, 0.28, 1.9}, {0.42, 0.5, 0.1}, 20, painting.clutter(1.7, 0.14));
  addBoard(scene, {0.58, -0.22, 1.75}, {0.4, 0.34, 0.06}, -25, painting.clutter(1.6, 0.13));
  addBoard(scene, {0.02, -0.3, 1.5}, {0.3, 0.26, 0.2}, 30, painting.clutter(1.3, 0.11));
  addBoard(scene, {0.36, 0.32, 1.45}, {0.5, 0.3, 0.05}, 28, painting.clutter(1.3, 0.12));
  addBoard(scene, {-0.5, -0.36, 1.6}, {0.4, 0.3, 0.08}, -22, painting.clutter(1.4, 0.12));
  addBoard(scene, {-0.34, -0.1, 1.1}, {0.16, 0.3, 0.12}, 15, painting.clutter(0.95, 0.08));
  addBoard(scene, {0.3, 0.2, 0.95}, {0.2, 0.18, 0.1}, -18, painting.clutter(0.8, 0.07));
  addBoard(scene, {-0.06, 0.14, 0.68}, {0.1, 0.1, 0.04}, 12, painting.clutter(0.6, 0.045));
  addBoard(scene, {-0.2, 0.13, 0.62}, {0.06, 0.12, 0.05}, -30, painting.clutter(0.55, 0.04));
  return scene;
}

/// Makes a camera on a linear slider that passes boards and boxes, like `slider_depth` of the Event
/// Camera Dataset (Mueggler et al., IJRR 2017). It does not rotate, so edges along the motion fire
/// no events and have no depth. World: the camera's frame in the middle of the path.
Simulation makeSlider(std::uint64_t seed) {
  constexpr double kFocalPx = 335;
  constexpr double kSpeed = 0.32;  // m/s
  constexpr double kDurationS = 2;
  RigCamera camera;
  camera.model = makePinhole(240, 180, kFocalPx);
  camera.model.cx = 129.9;
  camera.model.cy = 99.2;
  camera.model.distortion = DistortionModel::kRadtan;
  camera.model.coefficients = {-0.1386, 0.0934, -0.0003, 0.0002};
  SmoothMotionOptions motion;
  motion.start_ns = kPresetStartNs;
  motion.T_world_center.translation = {-0.5 * kSpeed * kDurationS, 0, 0};
  motion.velocity = {kSpeed, 0, 0};
  Simulation simulation = emptyPreset(kDurationS, 0.21, seed);
  simulation.scene = sliderScene(seed, kFocalPx);
  simulation.rig.cameras = {camera};
  simulation.motion = std::make_shared<SmoothMotion>(motion);
  return simulation;
}

CameraModel makeFisheye(double focal_px, const std::vector<double>& coefficients) {
  CameraModel model = makePinhole(640, 480, focal_px);
  model.distortion = DistortionModel::kEquidistant;
  model.coefficients = coefficients;
  return model;
}

/// Returns a rotation about y (to the right), x (up) and z (clockwise), in this order. Degrees.
Eigen::Quaterniond rotationOf(double right, double up, double clockwise) {
  return Eigen::AngleAxisd(radians(right), Vector3d::UnitY()) *
         Eigen::AngleAxisd(radians(up), Vector3d::UnitX()) *
         Eigen::AngleAxisd(radians(clockwise), Vector3d::UnitZ());
}

Rig trinocularRig(double focal_px) {
  Rig rig;
  rig.cameras.resize(3);
  rig.cameras[0].model = makeFisheye(focal_px, {-0.045, 0.012, -0.02, 0.008});
  rig.cameras[1].model = makeFisheye(410, {-0.03, -0.01, 0.006, -0.002});
  rig.cameras[1].model.cx += 4.5;
  rig.cameras[1].T_rig_cam = {rotationOf(-5, 1.5, 3), {0.16, 0.01, 0.005}};
  rig.cameras[2].model = makeFisheye(405, {-0.05, 0.02, -0.03, 0.01});
  rig.cameras[2].model.cy -= 6.25;
  rig.cameras[2].T_rig_cam = {rotationOf(-2, -5, 90), {0.08, -0.14, 0.01}};
  return rig;
}

std::shared_ptr<const Motion> trinocularMotion() {
  SmoothMotionOptions options;
  options.start_ns = kPresetStartNs;
  options.T_world_center.rotation = lookingAlongY() * rotationOf(15, -12, 0);
  options.T_world_center.translation = {-0.5, 0.2, 1.35};
  options.translation[0] = {{0.14, 0.55, 0.0}, {0.008, 1.9, 0.9}};
  options.translation[1] = {{0.12, 0.60, 1.4}, {0.006, 1.7, 2.5}};
  options.translation[2] = {{0.11, 0.60, 1.9}, {0.006, 1.5, 0.4}};
  options.rotation[0] = {{radians(1.0), 0.8, 0.3}};
  options.rotation[1] = {{radians(0.8), 0.7, 2.0}};
  options.rotation[2] = {{radians(1.5), 0.6, 1.9}};
  return std::make_shared<SmoothMotion>(options);
}

/// Makes three cameras, each with its own calibration, that look into a corner of a furnished room.
/// Camera 1 is 0.16 m to the right of camera 0 and looks slightly inwards. Camera 2 is 0.14 m above
/// the middle of cameras 0 and 1, tilted down, and rotated by 90 degrees about its axis. All
/// cameras see the middle of camera 0's view. World: z up.
Simulation makeTrinocular(std::uint64_t seed) {
  RoomOptions room;
  room.size_m = {4.6, 4.4, 2.6};
  room.furniture_depth_m = 0.8;
  room.focal_px = 400;
  room.nearest_m = 0.9;
  room.seed = seed;
  Simulation simulation = emptyPreset(1, 0.21, seed);
  simulation.scene = makeRoom(room);
  simulation.rig = trinocularRig(room.focal_px);
  simulation.motion = trinocularMotion();
  return simulation;
}

using MakePreset = Simulation (*)(std::uint64_t seed);

constexpr NamedChoice<MakePreset> kPresets[] = {
    {makeDeskStereo, "desk_stereo"}, {makeDriveStereo, "drive_stereo"},
    {makeHdStereo, "hd_stereo"},     {makePolesStereo, "poles_stereo"},
    {makeRoomStereo, "room_stereo"}, {makeSlider, "slider"},
    {makeTrinocular, "trinocular"},
};

}  // namespace

std::vector<std::string> simulationPresets() {
  std::vector<std::string> names;
  for (const auto& preset : kPresets) names.emplace_back(preset.name);
  return names;
}

Simulation makeSimulation(const SimulationOptions& options) {
  if (options.duration_s) {
    requireOption(*options.duration_s >= 0.001 && *options.duration_s <= 600, "duration_s",
                  *options.duration_s, "0.001 to 600");
  }
  Simulation simulation = options.scene.empty()
                              ? makerIn(kPresets, "preset", options.preset)(options.seed)
                              : emptyPreset(0, EventPixelOptions{}.threshold_on, options.seed);
  if (!options.cameras.empty()) simulation.rig.cameras = options.cameras;
  if (!options.scene.empty() || !options.poses.empty()) {
    moveAlong(options, simulation);
  } else if (options.duration_s) {
    simulation.duration_ns = durationFromSeconds(*options.duration_s);
  }
  EventPixelOptions& pixels = simulation.pixels;
  pixels.threshold_on = options.threshold_on.value_or(pixels.threshold_on);
  pixels.threshold_off = options.threshold_off.value_or(pixels.threshold_off);
  pixels.mismatch = options.mismatch;
  pixels.refractory_ns = durationFromSeconds(options.refractory_us * 1e-6);
  simulation.noise = options.noise;
  pixels.validate();
  simulation.noise.validate();
  return simulation;
}

}  // namespace efm
