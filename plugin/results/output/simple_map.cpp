// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/output/simple_map.h"

#include <zlib.h>
#include <Eigen/Geometry>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "mapping/base/number_bytes.h"
#include "mapping/geometry/rigid3.h"
#include "plugin/recordings/streams/sample.h"

namespace efm {
namespace {

/// Bytes of MRPT's archives.
class Archive {
 public:
  /// Adds an object: its class, the version of its members, the members, and a mark.
  template <typename Members>
  void object(std::string_view name, std::uint8_t version, const Members& members) {
    constexpr std::uint8_t kNameMark = 0x80;  // with the length of the name
    constexpr std::uint8_t kEndMark = 0x88;
    number(static_cast<std::uint8_t>(kNameMark | name.size()));
    bytes_ += name;
    number(version);
    members();
    number(kEndMark);
  }
  template <typename Number>
  void number(Number value) {
    appendLittleEndian(bytes_, value);
  }
  void flag(bool value) { number(std::uint8_t{value}); }
  void count(std::size_t value) { number(static_cast<std::uint32_t>(value)); }
  void text(std::string_view value) {
    count(value.size());
    bytes_ += value;
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

void addPose(Archive& archive, const Rigid3& T_a_b) {
  archive.object("mrpt::poses::CPose3D", 3, [&] {
    for (const double value : T_a_b.translation) archive.number(value);
    const Eigen::Matrix3d rotation = T_a_b.rotation.normalized().toRotationMatrix();
    for (const auto& row : rotation.rowwise()) {
      for (const double value : row) archive.number(value);
    }
  });
}

void addPoints(Archive& archive, const std::vector<ViewPoint>& points) {
  archive.object("mrpt::maps::CPointsMapXYZI", 0, [&] {
    archive.count(points.size());
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      for (const ViewPoint& point : points) archive.number(point.p_ref[axis]);
    }
    for (const ViewPoint& point : points) archive.number(point.confidence);
    // MRPT's defaults of the options of a map of points. First those of insertions:
    archive.number(std::uint8_t{0});  // version
    archive.number(0.02F);            // minDistBetweenLaserPoints
    archive.flag(true);               // addToExistingPointsMap
    archive.flag(false);              // also_interpolate
    archive.flag(true);               // disableDeletion
    archive.flag(false);              // fuseWithExisting
    archive.flag(false);              // isPlanarMap
    constexpr double kToleranceDeg = 0.05;
    archive.number(static_cast<float>(kRadiansPerDegree * kToleranceDeg));  // horizontalTolerance
    archive.number(2.0F);  // maxDistForInterpolatePoints
    archive.flag(false);   // insertInvalidPoints
    // and those of likelihoods:
    archive.number(std::uint8_t{0});    // version
    archive.number(0.0025);             // sigma_dist
    archive.number(1.0);                // max_corr_distance
    archive.number(std::uint32_t{10});  // decimation
  });
}

void addKeyframe(Archive& archive, const StoredKeyframe& keyframe) {
  archive.object("mrpt::poses::CPose3DPDFGaussian", 1, [&] {
    constexpr int kNumbers = 21;  // of a symmetric matrix
    addPose(archive, keyframe.T_world_ref);
    for (int i = 0; i < kNumbers; ++i) archive.number(0.0);
  });
  archive.object("mrpt::obs::CSensoryFrame", 2, [&] {
    archive.count(1);
    archive.object("mrpt::obs::CObservationPointCloud", 0, [&] {
      archive.text("keyframe");
      archive.number(nearestTick(keyframe.t_ref_ns) / kTickNs + kMrptTicksAtUnixEpoch);
      addPose(archive, {});
      archive.number(std::uint8_t{0});  // the points are not in a file of their own
      addPoints(archive, *keyframe.points);
    });
  });
}

}  // namespace

std::string simpleMapArchive(const std::vector<StoredKeyframe>& keyframes) {
  Archive archive;
  archive.object("mrpt::maps::CSimpleMap", 1, [&] {
    archive.count(keyframes.size());
    for (const StoredKeyframe& keyframe : keyframes) addKeyframe(archive, keyframe);
  });
  return archive.take();
}

void writeSimpleMap(const std::filesystem::path& file,
                    const std::vector<StoredKeyframe>& keyframes) {
  const std::string archive = simpleMapArchive(keyframes);
  std::unique_ptr<gzFile_s, int (*)(gzFile_s*)> stream(gzopen(file.c_str(), "wb1"), gzclose);
  const bool written = stream && gzfwrite(archive.data(), archive.size(), 1, stream.get()) == 1 &&
                       gzclose(stream.release()) == Z_OK;
  if (!written) throw std::runtime_error("the file cannot be created or the disk is full");
}

}  // namespace efm
