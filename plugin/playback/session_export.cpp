// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/playback/session_export.h"

#include <fmt/format.h>

#include <optional>
#include <set>
#include <stdexcept>

#include "event_fusion/engine.h"
#include "mapping/base/atomic_file.h"
#include "maps/io/point_cloud_file.h"
#include "maps/io/point_spool.h"
#include "plugin/results/output/colmap_model.h"
#include "plugin/results/output/simple_map.h"
#include "plugin/results/pictures/map_picture.h"
#include "plugin/results/viewer/map_page.h"
#include "plugin/session_file/run_record.h"

namespace efm {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

enum class MapFile { kPcd, kPly, kPage, kSimpleMap, kSession, kColmap };

/// @param out a trailing slash is allowed.
std::optional<MapFile> kindOf(const fs::path& out) {
  const fs::path path = out.has_filename() ? out : out.parent_path();
  const std::string ending = path.extension().string();
  if (ending == ".pcd") return MapFile::kPcd;
  if (ending == ".ply") return MapFile::kPly;
  if (ending == ".html") return MapFile::kPage;
  if (ending == ".simplemap") return MapFile::kSimpleMap;
  if (ending == ".mcap") return MapFile::kSession;
  constexpr std::string_view kFolder = "colmap";
  const std::string name = path.filename().string();
  const bool is_folder = name.size() >= kFolder.size() &&
                         name.compare(name.size() - kFolder.size(), kFolder.size(), kFolder) == 0;
  return is_folder ? std::optional(MapFile::kColmap) : std::nullopt;
}

/// The points of a map, slab by slab: the memory does not grow with the map.
class SlabMap {
 public:
  /// @param beside the points are kept in the folder of this file.
  SlabMap(const SessionMap& map, const fs::path& beside, const SessionMap::OnKeyframe& on_keyframe)
      : map_(map), spool_(beside) {
    constexpr std::size_t kMaxVoxels = 1'500'000;
    CloudOrigin origin(map.options().cloud.voxel_size_m);
    map.visitSlabs(kMaxVoxels, on_keyframe, [&](const std::vector<CloudPoint>& slab) {
      origin.add(slab);
      spool_.add(slab);
    });
    origin_ = origin.origin();
    MapHasher hash;
    visit([&](const MapCloud& slab) {
      made_.points += slab.size();
      hash.add(slab);
    });
    made_.hash = hash.finish();
  }

  const Eigen::Vector3f& origin() const { return origin_; }
  const ExportedMap& made() const { return made_; }
  void visit(const std::function<void(const MapCloud&)>& take) {
    spool_.visit([&](const std::vector<CloudPoint>& slab) { take(*map_.cloudOf(origin_, slab)); });
  }

 private:
  const SessionMap& map_;
  PointSpool spool_;
  Eigen::Vector3f origin_;
  ExportedMap made_;
};

ExportedMap writePcdOf(const SessionMap& map, const fs::path& out) {
  SlabMap slabs(map, out, {});
  map.requirePoints(slabs.made().points);
  writeAtomically(out, byStream([&](std::ostream& stream) {
                    writePcdHeader(stream, slabs.made().points, slabs.origin());
                    slabs.visit([&](const MapCloud& slab) { writePcdPoints(stream, slab); });
                  }));
  return slabs.made();
}

/// Returns how the map is made: the run of the first session, with the options of [map] in use.
Json runIn(const SessionMap& map) {
  Json run = map.sessions().front()->run();
  const Json options = runOf(map.options()).at("given");
  run["options"]["map"] = options.at("map");
  run["options"]["depth"]["min_probability"] = options.at("depth").at("min_probability");
  for (const auto& session : map.sessions()) {
    run["exported_from"].push_back(session->path().filename().string());
  }
  return run;
}

/// Returns the report of a page or a session.
Json reportOf(const SessionMap& map, const ExportedMap& made) {
  Json report = {{"version", EFM_VERSION},
                 {"keyframes", map.trajectory().size()},
                 {"points", made.points},
                 {"map_hash", made.hash}};
  const SessionFile& first = *map.sessions().front();
  const Json before = Json::parse(first.report(), nullptr, false);
  const bool is_same = map.sessions().size() == 1 && map.what().sets.empty() &&
                       map.what().poses.empty() && first.keyframes() == map.trajectory().size();
  if (is_same && before.is_object() && before.contains("quality")) {
    report["quality"] = before["quality"];
  }
  return report;
}

MapSnapshot writePage(const SessionMap& map, const fs::path& out) {
  std::optional<KeyframePictures> pictures;
  std::optional<ReferenceView> view;
  MapSnapshot made = map.snapshot(false, [&](std::size_t, const KeyframeDepthMap& keyframe) {
    if (!pictures) pictures.emplace(keyframe.planes);
    if (!view) view = keyframe.view;
    pictures->add(keyframe.map.depth, keyframe.view_events);
  });
  const Json run = runIn(map);
  Json report = reportOf(map, {made.points->size(), mapHash(*made.points)});
  for (const char* key : {"chosen", "options"}) {
    if (run.contains(key)) report[key] = run[key];
  }
  const MapPage page = {out.stem().string(),
                        *made.points,
                        map.options().cloud.voxel_size_m,
                        made.trajectory,
                        *pictures,
                        view,
                        report.dump(-1, ' ', false, Json::error_handler_t::replace)};
  writeAtomically(out, byStream([&](std::ostream& stream) { writeMapPage(stream, page); }));
  return made;
}

ExportedMap writeSession(const SessionMap& map, const fs::path& out) {
  AtomicFile file(out);
  SessionWriter session(file.temporary(), runIn(map));
  const ExportedMap made = SlabMap(map, out, [&](std::size_t, const KeyframeDepthMap& keyframe) {
                             session.add(keyframe);
                           }).made();
  session.addPoses(map.trajectory());
  session.finish(reportOf(map, made).dump(2, ' ', false, Json::error_handler_t::replace));
  file.replace();
  return made;
}

MapSnapshot writeColmap(const SessionMap& map, const fs::path& out) {
  NewFolder folder(out.has_filename() ? out : out.parent_path());
  ColmapModel model(folder.temporary());
  std::set<std::size_t> left_out;
  MapSnapshot made = map.snapshot(
      false,
      [&](std::size_t, const KeyframeDepthMap& keyframe) {
        model.add(keyframe, map.pointsOf(keyframe));
      },
      &left_out);
  model.finish(*made.points, map.options().cloud.voxel_size_m, left_out);
  folder.finish();
  return made;
}

MapSnapshot writeInMemory(const SessionMap& map, const fs::path& out, MapFile kind) {
  if (kind == MapFile::kPage) return writePage(map, out);
  if (kind == MapFile::kColmap) return writeColmap(map, out);
  MapSnapshot made = map.snapshot(kind == MapFile::kSimpleMap);
  if (kind == MapFile::kPly) {
    writePly(out, *made.points, made.trajectory, upwardOf(made.trajectory));
  } else {
    writeAtomically(out, [&](const fs::path& file) { writeSimpleMap(file, made.keyframes); });
  }
  return made;
}

}  // namespace

bool isMapFile(const fs::path& out) { return kindOf(out).has_value(); }

void requireMapFile(const fs::path& out, const SessionExport& what) {
  const auto kind = kindOf(out);
  if (!kind) {
    throw std::invalid_argument("--out " + out.string() + ": expected a name that ends with " +
                                kMapFiles);
  }
  if (what.box && (kind == MapFile::kSimpleMap || kind == MapFile::kSession)) {
    throw std::invalid_argument("--box with " + out.extension().string() +
                                ", which has whole keyframes: expected another ending of --out");
  }
}

ExportedMap exportSession(const SessionMap& map, const fs::path& out) {
  for (const auto& session : map.sessions()) {
    std::error_code error;
    if (fs::equivalent(session->path(), out, error)) {
      throw std::runtime_error(out.string() + ": the session itself: expected another name");
    }
  }
  if (map.trajectory().empty()) map.requirePoints(0);
  const auto kind = kindOf(out);
  if (kind == MapFile::kPcd) return writePcdOf(map, out);
  if (kind == MapFile::kSession) return writeSession(map, out);
  const MapSnapshot made = writeInMemory(map, out, kind.value());
  return {made.points->size(), mapHash(*made.points)};
}

}  // namespace efm
