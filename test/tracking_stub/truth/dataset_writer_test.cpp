// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <opencv2/imgcodecs.hpp>

#include <cstring>
#include <set>
#include <stdexcept>

#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/trajectory.h"
#include "test/plugin/temporary_folder.h"
#include "test/tracking_stub/scenes/edge_scene.h"
#include "tracking_stub/rendering/frame_renderer.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {
namespace {

TEST(SurfaceCells, ReturnTheCentresOfTheCellsWithTheMinCount) {
  Scene scene;
  scene.addRectangle({{1, 2, 3}, {1, 0, 0}, {0, 1, 0}, 0.10, 0.05}, test::evenPaint(0));
  SurfaceCells cells(scene, 0.01);
  cells.add({0, 0.001F, 0.001F});
  cells.add({0, 0.009F, 0.009F});
  cells.add({0, 0.10F, 0.05F});  // the far corner belongs to the last cell
  cells.add({});                 // no surface
  EXPECT_EQ(cells.centers(1).size(), 2U);
  const auto twice = cells.centers(2);
  ASSERT_EQ(twice.size(), 1U);
  EXPECT_LT((twice[0] - Eigen::Vector3f(1.005F, 2.005F, 3)).norm(), 1e-6F);
  EXPECT_TRUE(cells.centers(3).empty());
}

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::set<std::string> namesIn(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename());
  return names;
}

class DatasetFolder : public TemporaryFolder {
 protected:
  DatasetFolder() {
    simulation.scene.addRectangle(test::facingWall(1, 4, 4), test::edgePaint(2.0, 1.0F, 0.01));
    simulation.rig.cameras.assign(2, test::smallCamera());
    simulation.rig.cameras[1].T_rig_cam.translation = {0.1, 0, 0};
    simulation.motion = std::make_shared<test::StraightMotion>(Eigen::Vector3d(0.3, 0.02, 0.1));
    simulation.start_ns = 1'000'000'000;
    simulation.duration_ns = 100'000'000;
    // The edge is in view at t = 1 s.
    simulation.scene.addRectangle({{0.3, 1, 0.9}, {1, 0, 0}, {0, -1, 0}, 0.1, 2},
                                  test::evenPaint(2));
  }

  Simulation simulation;
};

TEST_F(DatasetFolder, WritesAllFilesAndNothingElse) {
  const auto recordings = simulateEvents(simulation);
  const fs::path desk = folder() / "desk";
  fs::create_directory(desk);
  writeDataset(desk, simulation, recordings);
  EXPECT_THAT(namesIn(desk), ElementsAre("cam0", "cam1", "camchain.yaml", "depth", "gt_cloud.ply",
                                         "gt_edges.ply", "poses.txt"));
  EXPECT_THAT(namesIn(desk / "depth"), ElementsAre("cam0_1.000000000.tiff", "cam0_1.050000000.tiff",
                                                   "cam0_1.100000000.tiff", "index.txt"));
  EXPECT_EQ(readText(desk / "depth/index.txt"),
            "1.000000000 cam0_1.000000000.tiff\n1.050000000 cam0_1.050000000.tiff\n"
            "1.100000000 cam0_1.100000000.tiff\n");

  std::istringstream lines(readText(desk / "poses.txt"));
  std::vector<std::string> poses;
  for (std::string line; std::getline(lines, line);) poses.push_back(line);
  ASSERT_EQ(poses.size(), 102U);  // and the header
  std::istringstream last(poses.back());
  std::string time;
  Eigen::Vector3d position;
  last >> time >> position.x() >> position.y() >> position.z();
  EXPECT_EQ(position, simulation.motion->poseAt(simulation.endNs()).translation);

  const cv::Mat depth =
      cv::imread((desk / "depth/cam0_1.050000000.tiff").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(depth.type(), CV_32FC1);
  const cv::Mat1f truth = renderDepth(simulation.scene, simulation.motion->poseAt(1'050'000'000),
                                      ReferenceView::of(simulation.rig.cameras[0].model));
  EXPECT_EQ(cv::norm(depth, truth, cv::NORM_INF), 0);
}

TEST_F(DatasetFolder, TruthCloudsLieOnSurfacesAndOnEdgesWithEvents) {
  const auto recordings = simulateEvents(simulation);
  ASSERT_GT(recordings[0].events.size(), 100U);
  writeDataset(folder(), simulation, recordings);
  std::map<std::string, std::vector<Eigen::Vector3f>> clouds;
  for (const std::string name : {"gt_cloud.ply", "gt_edges.ply"}) {
    const std::string content = readText(folder() / name);
    const std::size_t begin = content.find("end_header\n") + 11;
    EXPECT_THAT(content, HasSubstr("format binary_little_endian 1.0"));
    clouds[name].resize((content.size() - begin) / 12);
    EXPECT_THAT(content, HasSubstr("element vertex " + std::to_string(clouds[name].size()) + "\n"));
    ASSERT_FALSE(clouds[name].empty());
    std::memcpy(clouds[name].front().data(), content.data() + begin, clouds[name].size() * 12);
  }
  EXPECT_GT(clouds["gt_cloud.ply"].size(), 5000U);
  EXPECT_GT(clouds["gt_edges.ply"].size(), 50U);
  EXPECT_LT(clouds["gt_edges.ply"].size(), 0.2 * clouds["gt_cloud.ply"].size());
  for (const Eigen::Vector3f& p : clouds["gt_cloud.ply"]) {
    EXPECT_TRUE(p.z() == 1.0F || p.z() == 0.9F) << p.transpose();
  }
  for (const Eigen::Vector3f& p : clouds["gt_edges.ply"]) {
    const float off = std::min({std::abs(p.x()), std::abs(p.x() - 0.3F), std::abs(p.x() - 0.4F)});
    EXPECT_LT(off, 0.045F) << p.transpose();
  }
}

TEST_F(DatasetFolder, RejectsARigWhoseFrameIsNotCameraZero) {
  simulation.rig.cameras[0].T_rig_cam.translation = {0, 0.1, 0};
  EXPECT_THROW(writeDataset(folder(), simulation, std::vector<CameraRecording>(2)),
               std::invalid_argument);
}

TEST_F(DatasetFolder, EventsHaveNineDecimals) {
  writeEvents(folder() / "events.txt",
              {{1'000'004'000, 3, 65535, true}, {1'700'000'000'000'000'000, 0, 0, false}});
  EXPECT_EQ(readText(folder() / "events.txt"),
            "1.000004000 3 65535 1\n1700000000.000000000 0 0 0\n");
}

TEST_F(DatasetFolder, TheCamchainHasKalibrsFormat) {
  Rig rig = simulation.rig;
  rig.cameras[1].model.distortion = DistortionModel::kRadtan;
  rig.cameras[1].model.coefficients = {-0.25, 0.5, 0, 0.125};
  EXPECT_EQ(formatCamchain(rig),
            "cam0:\n"
            "  camera_model: pinhole\n"
            "  distortion_coeffs: []\n"
            "  distortion_model: none\n"
            "  intrinsics: [50, 50, 31.5, 23.5]\n"
            "  resolution: [64, 48]\n"
            "cam1:\n"
            "  T_cn_cnm1:\n"
            "  - [1, 0, 0, -0.10000000000000001]\n"
            "  - [0, 1, 0, 0]\n"
            "  - [0, 0, 1, 0]\n"
            "  - [0, 0, 0, 1]\n"
            "  camera_model: pinhole\n"
            "  distortion_coeffs: [-0.25, 0.5, 0, 0.125]\n"
            "  distortion_model: radtan\n"
            "  intrinsics: [50, 50, 31.5, 23.5]\n"
            "  resolution: [64, 48]\n");
}

}  // namespace

}  // namespace efm
