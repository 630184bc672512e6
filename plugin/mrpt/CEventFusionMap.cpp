// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/CEventFusionMap.h"

#include <fmt/format.h>
#include <mrpt/img/color_maps.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/opengl/CPointCloudColoured.h>
#include <mrpt/opengl/CSetOfObjects.h>
#include <mrpt/poses/CPose3D.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/serialization/stl_serialization.h>
#include <mrpt/system/COutputLogger.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ostream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "maps/io/point_cloud_file.h"
#include "plugin/mrpt/host_options.h"
#include "plugin/mrpt/pose_observation.h"
#include "plugin/options/option_keys.h"

MAP_DEFINITION_REGISTER("efm::CEventFusionMap,eventFusionMap", efm::CEventFusionMap)

IMPLEMENTS_SERIALIZABLE(CEventFusionMap, CMetricMap, efm)

namespace efm {
namespace {

using mrpt::maps::CPointsMapXYZI;
using mrpt::obs::CObservationPointCloud;

/// Returns the points with a confidence. (MRPT's clouds may also have points of intensity 0.)
/// @param sigma, probability see ViewPoint; one per point, or empty: not known.
std::shared_ptr<const std::vector<ViewPoint>> viewPointsOf(
    const CPointsMapXYZI& cloud, const std::vector<float>& sigma = {},
    const std::vector<float>& probability = {}) {
  const auto& x = cloud.getPointsBufferRef_x();
  const auto& y = cloud.getPointsBufferRef_y();
  const auto& z = cloud.getPointsBufferRef_z();
  const auto& confidence = cloud.getPointsBufferRef_intensity();
  auto points = std::make_shared<std::vector<ViewPoint>>();
  points->reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (confidence[i] == 0) continue;
    points->push_back({{x[i], y[i], z[i]}, confidence[i]});
    if (!sigma.empty()) points->back().sigma = sigma.at(i);
    if (!probability.empty()) points->back().probability = probability.at(i);
  }
  return points;
}

/// Returns a keyframe from an observation of a point cloud with intensities.
/// @return std::nullopt for other observations.
std::optional<StoredKeyframe> keyframeFrom(const mrpt::obs::CObservation& observation,
                                           const Rigid3& T_world_rig) {
  const auto* seen = dynamic_cast<const CObservationPointCloud*>(&observation);
  if (!seen) return std::nullopt;
  seen->load();  // the points may be in an external file
  const auto cloud = std::dynamic_pointer_cast<CPointsMapXYZI>(seen->pointcloud);
  if (!cloud) return std::nullopt;
  const std::int64_t t_ns =
      seen->timestamp == INVALID_TIMESTAMP ? 0 : nanosecondsFrom(seen->timestamp);
  return StoredKeyframe{t_ns, T_world_rig * rigidFrom(seen->sensorPose), viewPointsOf(*cloud)};
}

/// Rejects unknown keys in the section that MRPT reads for every map.
void checkGenericKeys(const mrpt::config::CConfigFileBase& source, const std::string& section) {
  constexpr std::array<std::string_view, 3> kKnown = {
      "enableSaveAs3DObject", "enableObservationLikelihood", "enableObservationInsertion"};
  std::vector<std::string> keys;
  source.getAllKeys(section, keys);
  for (const std::string& key : keys) {
    if (std::find(kKnown.begin(), kKnown.end(), key) != kKnown.end()) continue;
    throw std::invalid_argument(placeIn(source, section) + " " + key + ": unknown key");
  }
}

/// Reads the options of the consistency check. Maps of version 0 had no such check.
void readConsistency(mrpt::serialization::CArchive& in, std::uint8_t version,
                     ConsistencyOptions& options) {
  options.consistency = Consistency::kNone;
  if (version == 0) return;
  std::string name;
  in >> name >> options.consistency_tolerance >> options.consistency_cell_deg;
  options.consistency = fromName<Consistency>(name);
  options.max_contradictions = in.ReadAs<std::int32_t>();
}

/// Reads a number for each point; none if they are not known.
std::vector<float> readNumbers(mrpt::serialization::CArchive& in, std::size_t points,
                               const char* name) {
  std::vector<float> numbers;
  in >> numbers;
  if (!numbers.empty() && numbers.size() != points) {
    throw std::runtime_error(
        fmt::format("an event fusion map with {} {} for {} points", numbers.size(), name, points));
  }
  return numbers;
}

/// Reads the points of a keyframe. Maps of versions 0 and 1 had no sigma, 0 to 2 no probability.
std::shared_ptr<const std::vector<ViewPoint>> readPoints(mrpt::serialization::CArchive& in,
                                                         std::uint8_t version) {
  CPointsMapXYZI cloud;
  in >> cloud;
  std::vector<float> sigma;
  std::vector<float> probability;
  if (version >= 2) sigma = readNumbers(in, cloud.size(), "sigmas");
  if (version >= 3) probability = readNumbers(in, cloud.size(), "probabilities");
  return viewPointsOf(cloud, sigma, probability);
}

/// Returns a number of each point. Empty if none is known: a simplemap cannot store them.
std::vector<float> numbersOf(const std::vector<ViewPoint>& points, float ViewPoint::*number) {
  std::vector<float> numbers;
  bool is_known = false;
  for (const ViewPoint& point : points) {
    numbers.push_back(point.*number);
    is_known = is_known || !std::isnan(point.*number);
  }
  return is_known ? numbers : std::vector<float>();
}

}  // namespace

mrpt::maps::CPointsMapXYZI::Ptr pointsMapOf(const MapCloud& cloud) {
  auto map = mrpt::maps::CPointsMapXYZI::Create();
  map->resize(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3f p_world = positionIn(cloud, cloud[i]).cast<float>();
    map->setPointFast(i, p_world.x(), p_world.y(), p_world.z());
    map->setPointIntensity(i, cloud[i].intensity);
  }
  map->mark_as_modified();
  return map;
}

std::optional<std::string> roundingWarning(const MapCloud& cloud, double voxel_size_m) {
  const auto step_m = coarseStepOf(cloud, voxel_size_m);
  if (!step_m) return std::nullopt;
  return fmt::format(
      "MRPT's maps have float points, whose steps at the map's coordinates are {:.2g} m, over a "
      "tenth of a voxel of {:g} m: let poses begin nearer to the origin of the world",
      *step_m, voxel_size_m);
}

CPointsMapXYZI::Ptr cloudOf(const StoredKeyframe& keyframe) {
  const std::vector<ViewPoint>& points = *keyframe.points;
  auto cloud = CPointsMapXYZI::Create();
  cloud->resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f& p_ref = points[i].p_ref;
    cloud->setPointFast(i, p_ref.x(), p_ref.y(), p_ref.z());
    cloud->setPointIntensity(i, points[i].confidence);
  }
  cloud->mark_as_modified();
  return cloud;
}

void insertInto(mrpt::maps::CSimpleMap& map, const StoredKeyframe& keyframe,
                const CPointsMapXYZI::Ptr& cloud) {
  auto observation = CObservationPointCloud::Create();
  observation->sensorLabel = "keyframe";
  observation->timestamp = mrptTimeFrom(keyframe.t_ref_ns);
  observation->pointcloud = cloud;
  auto frame = mrpt::obs::CSensoryFrame::Create();
  frame->insert(observation);
  auto pose = mrpt::poses::CPose3DPDFGaussian::Create();
  pose->mean = mrptPoseFrom(keyframe.T_world_ref);
  map.insert(pose, frame);
}

std::vector<StoredKeyframe> keyframesOf(const mrpt::maps::CSimpleMap& map) {
  std::vector<StoredKeyframe> keyframes;
  std::size_t index = 0;
  for (const auto& [pose, frame] : map) {
    const Rigid3 T_world_rig = rigidFrom(pose->getMeanVal());
    const std::size_t before = keyframes.size();
    for (const mrpt::obs::CObservation::Ptr& observation : *frame) {
      if (auto keyframe = keyframeFrom(*observation, T_world_rig)) keyframes.push_back(*keyframe);
    }
    if (keyframes.size() == before) {
      throw std::invalid_argument(
          fmt::format("frame {} of the simplemap holds no point cloud with intensities: it is no "
                      "keyframe of a map",
                      index));
    }
    ++index;
  }
  return keyframes;
}

std::vector<StampedPose> readSimpleMap(const std::filesystem::path& file) {
  try {
    mrpt::maps::CSimpleMap map;
    if (!map.loadFromFile(file.string())) throw std::runtime_error("it is no simplemap");
    std::vector<StampedPose> poses;
    for (const StoredKeyframe& keyframe : keyframesOf(map)) {
      poses.push_back({keyframe.t_ref_ns, keyframe.T_world_ref});
    }
    return poses;
  } catch (const std::exception& error) {
    throw std::runtime_error("cannot read " + file.string() + ": " + error.what());
  }
}

using mrpt::maps::CSimplePointsMap;
using mrpt::serialization::CArchive;

CEventFusionMap::TMapDefinition::TMapDefinition() = default;

void CEventFusionMap::TMapDefinition::loadFromConfigFile_map_specific(
    const mrpt::config::CConfigFileBase& source, const std::string& prefix) {
  EventFusionOptions start;
  start.cloud = options;
  OptionReader reader(start);
  for (const std::string& section : sectionsBelow(source, prefix)) {
    if (section == prefix + "_insertOpts") {
      readHostSection(source, section, "map", reader);
    } else if (section == prefix + "_creationOpts") {
      checkGenericKeys(source, section);
    } else {
      throw std::invalid_argument(
          fmt::format("{} unknown section; known: {}_insertOpts, {}_creationOpts",
                      placeIn(source, section), prefix, prefix));
    }
  }
  options = reader.options().cloud;
}

void CEventFusionMap::TMapDefinition::dumpToTextStream_map_specific(std::ostream& out) const {
  EventFusionOptions all;
  all.cloud = options;
  for (const NamedOption& option : listOptions(all)) {
    if (option.section == "map") out << option.key << " = " << textOf(option.value) << "\n";
  }
}

mrpt::maps::CMetricMap* CEventFusionMap::internal_CreateFromMapDefinition(
    const mrpt::maps::TMetricMapInitializer& definition) {
  // MRPT takes ownership of a plain pointer.
  return new CEventFusionMap(dynamic_cast<const TMapDefinition&>(definition).options);
}

CEventFusionMap::CEventFusionMap(const GlobalCloudOptions& options) : cloud_(options) {}

void CEventFusionMap::insertKeyframe(const StoredKeyframe& keyframe) {
  cloud_.insert(keyframes_.size(), pointsInWorld(*keyframe.points, keyframe.T_world_ref),
                keyframe.T_world_ref);
  keyframes_.push_back(keyframe);
  simple_points_.reset();
}

void CEventFusionMap::moveKeyframe(std::size_t keyframe, const Rigid3& T_world_ref) {
  StoredKeyframe& stored = keyframes_.at(keyframe);
  const Rigid3 T_before_ref = std::exchange(stored.T_world_ref, T_world_ref);
  cloud_.remove(keyframe);
  try {
    cloud_.insert(keyframe, pointsInWorld(*stored.points, stored.T_world_ref), T_world_ref);
  } catch (const std::invalid_argument&) {
    stored.T_world_ref = T_before_ref;
    cloud_.insert(keyframe, pointsInWorld(*stored.points, stored.T_world_ref), T_before_ref);
    throw;
  }
  simple_points_.reset();
}

bool CEventFusionMap::internal_insertObservation(
    const mrpt::obs::CObservation& observation,
    const std::optional<const mrpt::poses::CPose3D>& robot_pose) {
  const Rigid3 T_world_rig = robot_pose ? rigidFrom(*robot_pose) : Rigid3{};
  std::optional<StoredKeyframe> keyframe = keyframeFrom(observation, T_world_rig);
  if (!keyframe) return false;
  insertKeyframe(*keyframe);
  return true;
}

void CEventFusionMap::internal_clear() {
  keyframes_.clear();
  cloud_ = GlobalCloud(cloud_.options());
  simple_points_.reset();
}

bool CEventFusionMap::internal_canComputeObservationLikelihood(
    const mrpt::obs::CObservation& /*observation*/) const {
  return false;
}

double CEventFusionMap::internal_computeObservationLikelihood(
    const mrpt::obs::CObservation& /*observation*/,
    const mrpt::poses::CPose3D& /*taken_from*/) const {
  return 0;
}

std::uint8_t CEventFusionMap::serializeGetVersion() const { return 3; }

void CEventFusionMap::serializeTo(CArchive& out) const {
  const GlobalCloudOptions& options = cloud_.options();
  out << genericMapParams << options.voxel_size_m;
  out.WriteAs<std::int32_t>(options.min_keyframes);
  out << options.outliers.outlier_radius_m;
  out.WriteAs<std::int32_t>(options.outliers.outlier_min_neighbors);
  out << std::string(nameOf(options.consistency.consistency))
      << options.consistency.consistency_tolerance << options.consistency.consistency_cell_deg;
  out.WriteAs<std::int32_t>(options.consistency.max_contradictions);
  out.WriteAs<std::uint32_t>(keyframes_.size());
  for (const StoredKeyframe& keyframe : keyframes_) {
    // Numbers instead of a pose of MRPT: MRPT's conversion changes the last digit.
    const Eigen::Vector3d& t = keyframe.T_world_ref.translation;
    const Eigen::Quaterniond& q = keyframe.T_world_ref.rotation;
    out << keyframe.t_ref_ns << t.x() << t.y() << t.z() << q.x() << q.y() << q.z() << q.w()
        << *cloudOf(keyframe) << numbersOf(*keyframe.points, &ViewPoint::sigma)
        << numbersOf(*keyframe.points, &ViewPoint::probability);
  }
}

void CEventFusionMap::serializeFrom(CArchive& in, std::uint8_t version) {
  if (version > 3) {
    throw std::runtime_error(fmt::format(
        "an event fusion map of version {}: this program reads versions 0 to 3", version));
  }
  GlobalCloudOptions options;
  in >> genericMapParams >> options.voxel_size_m;
  options.min_keyframes = in.ReadAs<std::int32_t>();
  in >> options.outliers.outlier_radius_m;
  options.outliers.outlier_min_neighbors = in.ReadAs<std::int32_t>();
  readConsistency(in, version, options.consistency);
  CEventFusionMap read(options);
  const auto count = in.ReadAs<std::uint32_t>();
  for (std::uint32_t i = 0; i < count; ++i) {
    StoredKeyframe keyframe;
    Eigen::Vector3d& t = keyframe.T_world_ref.translation;
    Eigen::Quaterniond& q = keyframe.T_world_ref.rotation;
    in >> keyframe.t_ref_ns >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w();
    keyframe.points = readPoints(in, version);
    read.insertKeyframe(keyframe);
  }
  keyframes_ = std::move(read.keyframes_);
  cloud_ = std::move(read.cloud_);
  simple_points_.reset();
}

bool CEventFusionMap::isEmpty() const {
  return std::all_of(keyframes_.begin(), keyframes_.end(),
                     [](const StoredKeyframe& keyframe) { return keyframe.points->empty(); });
}

std::string CEventFusionMap::asString() const {
  std::size_t points = 0;
  for (const StoredKeyframe& keyframe : keyframes_) points += keyframe.points->size();
  return fmt::format("event fusion map of {} keyframes with {} points in voxels of {} m",
                     cloud_.keyframes(), points,
                     textOf(OptionValue(cloud_.options().voxel_size_m)));
}

void CEventFusionMap::getVisualizationInto(mrpt::opengl::CSetOfObjects& out) const {
  if (!genericMapParams.enableSaveAs3DObject) return;
  const MapCloud::ConstPtr points = cloud_.points();
  warnOfRounding(*points);
  // The colour scale ends at the 95th percentile: a few points have far larger confidences.
  std::vector<float> sorted;
  sorted.reserve(points->size());
  for (const MapPoint& point : *points) sorted.push_back(point.intensity);
  const std::size_t below = sorted.size() - sorted.size() / 20;
  std::sort(sorted.begin(), sorted.end());
  const float scale = sorted.empty() ? 1.0F : sorted[below > 0 ? below - 1 : 0];

  auto drawn = mrpt::opengl::CPointCloudColoured::Create();
  drawn->setPointSize(2);
  drawn->reserve(points->size());
  for (const MapPoint& point : *points) {
    const Eigen::Vector3f p_world = positionIn(*points, point).cast<float>();
    const mrpt::img::TColor colour =
        mrpt::img::colormap(mrpt::img::cmJET, std::min(1.0F, point.intensity / scale));
    drawn->insertPoint({p_world.x(), p_world.y(), p_world.z(), colour.R, colour.G, colour.B});
  }
  out.insert(drawn);
}

/// Warns once.
void CEventFusionMap::warnOfRounding(const MapCloud& points) const {
  if (warned_of_rounding_) return;
  const auto warning = roundingWarning(points, cloud_.options().voxel_size_m);
  if (!warning) return;
  warned_of_rounding_ = true;
  mrpt::system::COutputLogger("CEventFusionMap").logStr(mrpt::system::LVL_WARN, *warning);
}

void CEventFusionMap::saveMetricMapRepresentationToFile(const std::string& prefix) const {
  writePcd(prefix + ".pcd", *cloud_.points());
}

const CSimplePointsMap* CEventFusionMap::getAsSimplePointsMap() const {
  if (!simple_points_) {
    simple_points_.emplace();
    const MapCloud::ConstPtr points = cloud_.points();
    warnOfRounding(*points);
    for (const MapPoint& point : *points) {
      const Eigen::Vector3f p_world = positionIn(*points, point).cast<float>();
      simple_points_->insertPointFast(p_world.x(), p_world.y(), p_world.z());
    }
    simple_points_->mark_as_modified();
  }
  return &*simple_points_;
}

}  // namespace efm
