// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <mrpt/config/CConfigFile.h>
#include <mrpt/img/TStereoCamera.h>
#include <mrpt/poses/CPose3D.h>
#include <mrpt/poses/CPose3DQuat.h>
#include <opencv2/core.hpp>

#include <filesystem>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "mapping/base/number_bytes.h"
#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/calibration/calibration_formats.h"
#include "test/paths.h"
#include "test/plugin/recordings/columns/zip_file.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;

constexpr const char* kCamchain =
    "%YAML:1.0\n---\n"
    "cam0: {camera_model: pinhole, intrinsics: [200, 201, 120, 90], distortion_model: none,\n"
    "  resolution: [240, 180]}\n"
    "cam1: {camera_model: pinhole, intrinsics: [300, 301, 120, 90], distortion_model: none,\n"
    "  resolution: [240, 180],\n"
    "  T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}\n";

class CalibrationFile : public TemporaryFolder {
 protected:
  Calibration read(const std::string& text) const {
    writeFile(folder() / "given.txt", text);
    return readCalibration(folder() / "given.txt");
  }
  std::string errorOfText(const std::string& text) const {
    return errorOf([&] { read(text); });
  }
};

TEST_F(CalibrationFile, MayBeNineNumbersWhereTheRecordingKnowsTheSize) {
  const Calibration calibration = read("#fx fy\n200 201 120 90 0.1 0 0 0 0\n");
  CameraModel expected{240, 180, 200, 201, 120, 90, DistortionModel::kRadtan, {}};
  expected.coefficients = {0.1, 0, 0, 0, 0};
  EXPECT_EQ(calibration.camera(0, CameraSize{240, 180}).model, expected);
  expected.coefficients[0] = 0;
  EXPECT_EQ(read("200 201 120 90 0 0 0 0 0").camera(0, CameraSize{240, 180}).model, expected);
  EXPECT_THAT(messageOf([&] { calibration.camera(0, std::nullopt); }),
              HasSubstr("given.txt: no size of the sensor"));
}

TEST_F(CalibrationFile, MayBeginWithAByteOrderMark) {
  const std::string mark = "\xEF\xBB\xBF";
  EXPECT_EQ(read(mark + "200 201 120 90 0.1 0 0 0 0\n").rig.cameras.at(0).model.fx, 200);
  EXPECT_EQ(read(mark + (kCamchain + 14)).rig.cameras.at(1).model.fx, 300);
  CameraModel expected{640, 480, 300, 301, 320, 240, DistortionModel::kRadtan, {}};
  expected.coefficients = {1, 0, 0, 0, 0};
  EXPECT_EQ(read(mark + "; a\n# b\n// c\n% d\n[CAMERA] ; e\nresolution = [640 480] # f\nfx = 300\n"
                        "fy = 301 // g\ncx = 320\ncy = 240 % h\ndist = [1 0 0 0 0 0 0]")
                .rig.cameras.at(0)
                .model,
            expected);
}

TEST_F(CalibrationFile, AnErrorOfOtherCamerasNamesTheFileAndBothCounts) {
  const Calibration calibration = read(kCamchain);
  Rig recorded = calibration.rig;
  EXPECT_NO_THROW(calibration.requireLike(recorded));
  for (const auto& [width, height] : {std::pair(640, 180), std::pair(240, 480)}) {
    recorded.cameras[1].model.width = width;
    recorded.cameras[1].model.height = height;
    const std::string size = std::to_string(width) + "x" + std::to_string(height);
    EXPECT_THAT(messageOf([&] { calibration.requireLike(recorded); }),
                EndsWith("given.txt: camera 1 has 240x180 pixels: expected " + size +
                         " pixels, as the recording has"));
  }
  recorded.cameras[1].model.width = recorded.cameras[1].model.height = 65'535;  // unknown size
  EXPECT_NO_THROW(calibration.requireLike(recorded));
  recorded.cameras.pop_back();
  EXPECT_THAT(messageOf([&] { calibration.requireLike(recorded); }),
              AllOf(HasSubstr("given.txt: 2 cameras: expected 1, as the recording has; `map "),
                    EndsWith("--set rig.cameras=1` (Python: cameras=[1]) takes the camera 1 (or "
                             "others of 0 to 1)")));
  EXPECT_THAT(messageOf([&] { calibration.camera(2, std::nullopt); }),
              HasSubstr("given.txt: 2 cameras, but the recording has camera 2: expected one"));
}

constexpr const char* kCameraInfo =
    "image_width: 346\nimage_height: 260\ncamera_name: left\n"
    "camera_matrix: {rows: 3, cols: 3, data: [226, 0, 173, 0, 227, 133, 0, 0, 1]}\n"
    "distortion_model: plumb_bob\n"
    "distortion_coefficients: {rows: 1, cols: 5, data: [0.1, 0.2, 0.3, 0.4, 0.5]}\n";

TEST_F(CalibrationFile, MayBeTheCameraInfoOfRos) {
  const Rig rig = read(kCameraInfo).rig;
  ASSERT_EQ(rig.cameras.size(), 1U);
  CameraModel expected{346, 260, 226, 227, 173, 133, DistortionModel::kRadtan, {}};
  expected.coefficients = {0.1, 0.2, 0.3, 0.4, 0.5};
  EXPECT_EQ(rig.cameras[0].model, expected);

  std::string fisheye = replaced(kCameraInfo, "plumb_bob", "equidistant");
  fisheye = replaced(fisheye, ", 0.5]", "]");
  EXPECT_EQ(read(fisheye).rig.cameras[0].model.distortion, DistortionModel::kEquidistant);
  EXPECT_EQ(read(replaced(fisheye, "equidistant", "fisheye")).rig.cameras[0].model,
            read(fisheye).rig.cameras[0].model);
}

TEST_F(CalibrationFile, MayBeOfAnotherProgram) {
  CameraModel expected{320, 180, 217.24, 217.34, 163.3, 82.8, DistortionModel::kRadtan, {}};
  expected.coefficients = {-0.0675, 0.021, 0.0034, 0.0016, 0.0974};
  const std::string body =
      "image_width: 320\nimage_height: 180\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: "
      "3\n"
      "   dt: d\n   data: [ 217.24, 0., 163.3, 0., 217.34, 82.8, 0., 0., 1. ]\n"
      "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n"
      "   data: [ -0.0675, 0.021, 0.0034, 0.0016, 0.0974 ]\n";
  const std::string dv_camera =
      R"({"name": "DV", "resolution": ["320", "180"], "principalPoint": ["163.3", "82.8"],
          "focalLength": ["217.24", "217.34"], "distortionModel": "radialTangential",
          "distortionCoefficients": ["-0.0675", "0.021", "0.0034", "0.0016", "0.0974"],
          "transformationToC0": ["1", "0", "0", "X", "0", "1", "0", "0", "0", "0", "1", "0",
                                 "0", "0", "0", "1"]})";
  const std::string dv = R"({"version": "2.0", "cameras": [)" + replaced(dv_camera, "X", "0") +
                         ", " + replaced(dv_camera, "X", "0.1") + "]}";
  for (const std::string& text :
       {"%YAML:1.0\n---\n" + body, "camera_model: plumb_bob\n" + body, dv,
        std::string(R"({"type": "PINHOLE", "img_size": [320, 180],
                        "K": [217.24, 0, 163.3, 0, 217.34, 82.8, 0, 0, 1],
                        "D": [-0.0675, 0.021, 0.0034, 0.0016, 0.0974]})"),
        std::string("217.24 217.34 163.3 82.8 -0.0675 0.021 0.0034 0.0016 0.0974\n320 180\n")}) {
    EXPECT_EQ(read(text).rig.cameras.at(0).model, expected) << text;
  }
  // Four coefficients, and a fifth one of 0.
  expected.coefficients = {-0.0675, 0.021, 0.0034, 0.0016};
  const std::string size = "width: 320\nheight: 180\n";
  const std::string projection = "image_width: 320\nimage_height: 180\nmodel_type: ";
  const std::string vins =
      projection +
      "PINHOLE\nprojection_parameters: {fx: 217.24, fy: 217.34, cx: 163.3, cy: "
      "82.8}\ndistortion_parameters: {k1: -0.0675, k2: 0.021, p1: 0.0034, p2: "
      "0.0016}\n";
  const std::string k = ": [217.24, 0, 163.3, 0, 217.34, 82.8, 0, 0, 1]\n";
  const std::string d = ": [-0.0675, 0.021, 0.0034, 0.0016]\ndistortion_model: plumb_bob\n";
  for (const std::string& text : {vins, size + "K" + k + "D" + d, size + "k" + k + "d" + d}) {
    EXPECT_EQ(read(text).rig.cameras.at(0).model, expected) << text;
  }
  expected.distortion = DistortionModel::kEquidistant;
  EXPECT_EQ(read(projection +
                 "KANNALA_BRANDT\nprojection_parameters: {k2: -0.0675, k3: 0.021, k4: 0.0034, k5: "
                 "0.0016, mu: 217.24, mv: 217.34, u0: 163.3, v0: 82.8}\n")
                .rig.cameras.at(0)
                .model,
            expected);
  EXPECT_THAT(errorOfText(replaced(dv, R"(["217.24", "217.34"])", "217")),
              HasSubstr("cameras[0]: focalLength principalPoint: 3 numbers: expected 4, fx fy"));
  EXPECT_EQ(read(dv).rig.cameras.at(1).T_rig_cam.translation, Eigen::Vector3d(0.1, 0, 0));
  EXPECT_THAT(errorOfText(replaced(dv, "radialTangential", "fov")),
              HasSubstr("distortionModel = 'fov': expected radtan (plumb_bob, radialTangential, "
                        "PINHOLE), equidistant (fisheye, kannala_brandt, kb4) or none"));
}

TEST_F(CalibrationFile, MayBeXmlOfOpencv) {
  const std::filesystem::path file = folder() / "opencv.xml";
  CameraModel expected{320, 180, 217.24, 217.34, 163.3, 82.8, DistortionModel::kRadtan, {}};
  expected.coefficients = {-0.0675, 0.021, 0.0034, 0.0016, 0.0974};
  {
    cv::FileStorage storage(file.string(), cv::FileStorage::WRITE);
    storage << "image_width" << 320 << "image_height" << 180 << "camera_matrix"
            << cv::Mat(cv::Matx33d(217.24, 0, 163.3, 0, 217.34, 82.8, 0, 0, 1))
            << "distortion_coefficients" << cv::Mat(expected.coefficients);
  }
  EXPECT_EQ(readCalibration(file).rig.cameras.at(0).model, expected);
  EXPECT_THAT(errorOfText("<?xml version=\"1.0\"?>\n<opencv_storage><a>"),
              HasSubstr("given.txt: not XML of OpenCV"));
}

TEST_F(CalibrationFile, OfMoreCamerasGivesTheNamedOnes) {
  const Calibration chain = read(kCamchain);
  const Rig one = chain.of(1, {1}).rig;
  ASSERT_EQ(one.cameras.size(), 1U);
  EXPECT_EQ(one.cameras[0].model, chain.rig.cameras[1].model);
  EXPECT_EQ(one.cameras[0].T_rig_cam.translation, Eigen::Vector3d(0.1, 0, 0)) << "on camera 0";
  for (const std::vector<int>& wrong : {std::vector<int>{}, {2}, {-1}, {0, 1}}) {
    EXPECT_EQ(chain.of(1, wrong).rig.cameras.size(), 2U);
  }
  EXPECT_EQ(chain.of(2, {1}).rig.cameras.size(), 2U) << "the recording has all";
}

TEST_F(CalibrationFile, MayBeAnIniFileOfMrptsCameraCalibration) {
  mrpt::img::TStereoCamera stereo;
  stereo.leftCamera.ncols = 640;
  stereo.leftCamera.nrows = 480;
  stereo.leftCamera.setIntrinsicParamsFromValues(500, 501, 320, 240);
  stereo.leftCamera.setDistortionPlumbBob(0.1, 0.2, 0.3, 0.4, 0.5);
  stereo.rightCamera = stereo.leftCamera;
  stereo.rightCamera.setDistortionKannalaBrandt(0.1, 0.2, 0.3, 0.4);
  stereo.rightCameraPose = {0.1, 0.01, 0.02, 0.8, 0.6, 0, 0};
  {
    mrpt::config::CConfigFile file((folder() / "stereo.ini").string());
    stereo.saveToConfigFile("CAMERA_PARAMS", file);
    mrpt::config::CConfigFile one((folder() / "one.ini").string());
    stereo.leftCamera.saveToConfigFile("ANY_NAME", one);
  }
  const Rig rig = readCalibration(folder() / "stereo.ini").rig;
  ASSERT_EQ(rig.cameras.size(), 2U);
  CameraModel left{640, 480, 500, 501, 320, 240, DistortionModel::kRadtan, {}};
  left.coefficients = {0.1, 0.2, 0.3, 0.4, 0.5};
  EXPECT_EQ(rig.cameras[0].model, left);
  CameraModel right = left;
  right.distortion = DistortionModel::kEquidistant;
  right.coefficients = {0.1, 0.2, 0.3, 0.4};
  EXPECT_EQ(rig.cameras[1].model, right);
  // MRPT's own pose of the right camera maps its point to the left camera.
  const Eigen::Vector3d p_rig = rig.cameras[1].T_rig_cam * Eigen::Vector3d(1, 2, 3);
  Eigen::Vector3d expected;
  mrpt::poses::CPose3D(mrpt::poses::CPose3DQuat(stereo.rightCameraPose))
      .composePoint(1, 2, 3, expected.x(), expected.y(), expected.z());
  EXPECT_LT((p_rig - expected).norm(), 1e-5);

  const Rig one = readCalibration(folder() / "one.ini").rig;
  ASSERT_EQ(one.cameras.size(), 1U);
  EXPECT_EQ(one.cameras[0].model, left);
}

TEST_F(CalibrationFile, LensAndAreaTravelWithTheFile) {
  // OpenCV's fisheye lens, below the camera's name as DV writes it, and with fisheye_model.
  const std::string opencv =
      replaced(replaced(kCameraInfo, ", 0.5]", "]"), "distortion_model: plumb_bob\n", "");
  EXPECT_EQ(read(opencv).rig.cameras[0].model.distortion, DistortionModel::kRadtan);
  for (const char* lens : {"fisheye_model: 1\n", "use_fisheye_model: 1\n", "fisheye_model: true\n",
                           "distortion_model: Equidistant\nuse_fisheye_model: 0\n"}) {
    EXPECT_EQ(read(lens + opencv).rig.cameras[0].model.distortion, DistortionModel::kEquidistant)
        << lens;
  }
  const auto xml = [](const std::string& name, const char* fisheye) {
    return "<?xml version=\"1.0\"?>\n<opencv_storage>\n<" + name +
           ">\n<camera_matrix "
           "type_id=\"opencv-matrix\">\n<rows>3</rows>\n<cols>3</cols>\n<dt>d</dt>\n"
           "<data>226. 0. 173. 0. 227. 133. 0. 0. 1.</data></camera_matrix>\n"
           "<distortion_coefficients type_id=\"opencv-matrix\">\n<rows>1</rows>\n<cols>4</cols>\n"
           "<dt>d</dt>\n<data>0.1 0.2 0.3 0.4</data></distortion_coefficients>\n"
           "<image_width>346</image_width>\n<image_height>260</image_height>\n</" +
           name + ">\n<use_fisheye_model>" + fisheye +
           "</use_fisheye_model>\n<type>camera</type>\n</opencv_storage>\n";
  };
  const CameraModel plain = read(opencv).rig.cameras[0].model;
  EXPECT_EQ(read(xml("DVXplorer_DXA00093", "0")).rig.cameras[0].model, plain);
  EXPECT_EQ(read(xml("DVXplorer_DXA00093", "1")).rig.cameras[0].model.distortion,
            DistortionModel::kEquidistant);
  std::string nested = "<?xml version=\"1.0\"?>\n<opencv_storage>\n";
  for (int i = 0; i < 300'000; ++i) nested += "<a>";
  EXPECT_THAT(errorOfText(nested), HasSubstr("given.txt: XML of over 100 nested elements"));
  // Half of the sensor's resolution, and a part of it.
  std::string info =
      "width: 346\nheight: 260\nK: [226, 0, 173, 0, 227, 133, 0, 0, 1]\nD: [0.1, 0.2, 0.3, 0.4]\n"
      "distortion_model: plumb_bob\nbinning_x: 2\nbinning_y: 2\n"
      "roi: {x_offset: 20, y_offset: 10, height: 200, width: 300, do_rectify: false}\n";
  CameraModel cut = plain;
  cut.width = 150;
  cut.height = 100;
  cut.fx /= 2;
  cut.fy /= 2;
  cut.cx = (173 - 20 - 0.5) / 2;
  cut.cy = (133 - 10 - 0.5) / 2;
  EXPECT_EQ(read(info).rig.cameras[0].model, cut);
  // A pixel of the part is the mean of the sensor's pixels in it.
  const Eigen::Vector3d p_cam(0.3, -0.2, 1.5);
  EXPECT_LT((plain.project(p_cam) - (2 * cut.project(p_cam) + Eigen::Vector2d(20.5, 10.5))).norm(),
            1e-9);
  EXPECT_THAT(
      errorOfText(replaced(info, "x_offset: 20", "x_offset: 50")),
      HasSubstr("given.txt:1: roi, binning: 300 pixels from 50 on, 2 in one: expected an area in"));
  info = replaced(replaced(info, "binning_x: 2", "binning_x: 0"), "binning_y: 2", "binning_y: 0");
  info = replaced(info, "{x_offset: 20, y_offset: 10, height: 200, width: 300, do_rectify: false}",
                  "{x_offset: 0, y_offset: 0, height: 0, width: 0}");
  EXPECT_EQ(read(info).rig.cameras[0].model, plain);
}

TEST_F(CalibrationFile, MayBeOfBasaltOpenVinsOrNerfstudio) {
  const std::string camera =
      R"({"camera_type": "kb4", "intrinsics": {"fx": 50, "fy": 51, "cx": 32, "cy": 24,
          "k1": 0.1, "k2": 0.02, "k3": 0.003, "k4": 0.0004}})";
  std::string poses, sizes, cameras;
  for (int count = 1; count <= 4; ++count) {
    const std::string comma = count == 1 ? "" : ", ";
    poses += comma + R"({"px": )" + std::to_string(count) +
             R"(, "py": 0, "pz": 0, "qx": 0, "qy": 0, "qz": 0, "qw": 1})";
    sizes += comma + "[64, 48]";
    cameras += comma + camera;
    const Rig rig = read(R"({"value0": {"T_imu_cam": [)" + poses + R"(], "intrinsics": [)" +
                         cameras + R"(], "resolution": [)" + sizes + "]}}")
                        .rig;
    ASSERT_EQ(rig.cameras.size(), static_cast<std::size_t>(count));
    EXPECT_EQ(rig.cameras.back().model.distortion, DistortionModel::kEquidistant);
    EXPECT_EQ(rig.cameras.back().T_rig_cam.translation.x(), count - 1);
  }
  const std::string chain =
      replaced(kCamchain, "T_cn_cnm1: [[1, 0, 0, -0.1]", "T_imu_cam: [[1, 0, 0, 0.3]");
  const Rig rig = read(replaced(chain, "240, 180]}",
                                "240, 180],\n  T_imu_cam: [[1, 0, 0, 0.2], [0, 1, 0, 0], [0, 0, 1, "
                                "0], [0, 0, 0, 1]]}"))
                      .rig;
  EXPECT_NEAR(rig.cameras.at(1).T_rig_cam.translation.x(), 0.1, 1e-12);
  const std::string metashape =
      R"({"w": 346, "h": 260, "fl_x": 226, "fl_y": 227, "cx": 173, "cy": 133, "k1": 0.1, "k2": 0.2,
          "k3": 0.5, "k4": 0, "p1": 0.3, "p2": 0.4, "camera_model": "OPENCV"})";
  EXPECT_EQ(read(metashape).rig.cameras[0].model, read(kCameraInfo).rig.cameras[0].model);
  EXPECT_THAT(errorOfText(replaced(metashape, "\"k4\": 0", "\"k4\": 0.1")),
              HasSubstr("number of distortion coefficients = 6: must be 4 or 5"));
  const std::string transforms =
      R"({"w": 346, "h": 260, "fl_x": 226, "fl_y": 227, "cx": 173, "cy": 133, "k1": 0.1, "k2": 0.2,
          "p1": 0.3, "p2": 0.4, "camera_model": "OPENCV", "frames": []})";
  EXPECT_EQ(read(transforms).rig.cameras[0].model.distortion, DistortionModel::kRadtan);
  std::string fisheye = replaced(replaced(transforms, "p1", "k3"), "p2", "k4");
  EXPECT_EQ(read(replaced(fisheye, "OPENCV", "OPENCV_FISHEYE")).rig.cameras[0].model.coefficients,
            read(transforms).rig.cameras[0].model.coefficients);
}

TEST_F(CalibrationFile, MayBeTheArraysOfOpenCvOrItsMatrixAlone) {
  const std::vector<double> matrix = {226, 0, 173, 0, 227, 133, 0, 0, 1};
  const std::vector<double> lens = {0.1, 0.2, 0.3, 0.4, 0.5};
  const CameraModel expected = read(kCameraInfo).rig.cameras[0].model;
  for (const auto& [k, d] : {std::pair("mtx.npy", "dist.npy"),
                             {"K.npy", "D.npy"},
                             {"camera_matrix.npy", "dist_coeffs.npy"}}) {
    writeZip(folder() / "c.npz", {{k, npyArray("<f8", "(3, 3)", matrix)},
                                  {d, npyArray("<f8", "(1, 5)", lens)},
                                  {"rvecs.npy", npyArray("|O", "(1,)", std::vector<double>{0})}});
    EXPECT_EQ(readCalibration(folder() / "c.npz").camera(0, CameraSize{346, 260}).model, expected)
        << k;
  }
  writeZip(folder() / "c.npz", {{"mtx.npy", npyArray("<f8", "(3, 3)", matrix)},
                                {"dist.npy", npyArray("<f8", "(4, 1)", std::vector<double>(4))}});
  EXPECT_THAT(errorOf([&] { readCalibration(folder() / "c.npz"); }),
              HasSubstr("four coefficients"));
  writeZip(folder() / "c.npz", {{"a.npy", npyArray("<f8", "(3, 3)", matrix)}});
  EXPECT_THAT(errorOf([&] { readCalibration(folder() / "c.npz"); }),
              HasSubstr("c.npz: expected arrays mtx"));
  const CameraModel bare =
      read("226 0 173\n0 227 133\n0 0 1\n").camera(0, CameraSize{346, 260}).model;
  EXPECT_EQ(bare.coefficients, std::vector<double>(5));
  EXPECT_EQ(bare.fy, 227);
}

/// TUM-VIE's calibration, without the values of the two frame cameras.
constexpr const char* kTumVie = R"({"value0": {
"resolution": [[1, 2], [3, 4], [64, 48], [65, 49]],
"intrinsics": [{}, {},
{"camera_type": "kb4", "intrinsics": {"fx": 50, "fy": 51, "cx": 32, "cy": 24,
"k1": 1, "k2": 2, "k3": 3, "k4": 4}},
{"camera_type": "kb5", "intrinsics": {}}],
"T_imu_cam": [{}, {}, {"px": 1, "py": 2, "pz": 3, "qx": 0, "qy": 0, "qz": 1.011, "qw": 0}]}})";

TEST_F(CalibrationFile, AnErrorNamesTheFileThePlaceAndTheExpectedValue) {
  const std::string ini =
      "; stereo\n[A_LEFT]\nresolution = [64 48]\nfx = 50\nfy = 50\ncx = 32\ncy = 24\n"
      "distortion = none\n";
  const struct {
    std::string text;
    const char* error;
  } cases[] = {
      {"", "given.txt: not a calibration: expected a Kalibr camera chain, DSEC's"},
      {"[1, 2]\n", "given.txt: not a calibration: expected a Kalibr camera chain"},
      {"left: {fx: 3}\n", "given.txt: not a calibration: expected a Kalibr camera chain"},
      {std::string("\x89HDF\r\n\x1a\n\0\0", 10), "given.txt"},
      {"200 200 120 90 0 0 0 0\n", "given.txt: 8 numbers: expected 9, fx fy cx cy k1 k2 p1 p2 k3"},
      {"200 200 120 90 0 0 0 0 0 0\n", "given.txt: 10 numbers: expected 9"},
      {"200 201\n120 \x1b[2J\n", "given.txt:2: '\\x1b[2J': expected a finite number"},
      {"0 201 120 90 0 0 0 0 0\n", "given.txt: fx = 0: must be finite and above 0"},
      {R"({"value0": {"T_imu_marker": {"px": 1}}})", "given.txt:1: value0: resolution is missing"},
      {R"({"value0": {"resolution": [[1, 2]]}})", "value0: intrinsics is missing"},
      {kTumVie, "value0: T_imu_cam[2]: qx qy qz qw of length 1.011: expected a rotation"},
      {replaced(kTumVie, "1.011", "1.009"), "value0: intrinsics[3]: camera_type = 'kb5': expected"},
      {replaced(replaced(kTumVie, "1.011", "1"), "kb5", "kb4"), "intrinsics[3]: intrinsics: fx is"},
      {replaced(replaced(kTumVie, "1.011", "1"),
                ",\n{\"camera_type\": \"kb5\", \"intrinsics\": {}}", ""),
       "value0: intrinsics = a list: expected a list of at least 4 items"},
      {replaced(kTumVie, "[64, 48]", "[64, 65536]"),
       ":2: value0: resolution = 65536: expected whole"},
      {replaced(replaced(kTumVie, "kb4", "ds"), "1.011", "1"),
       "camera_type = 'ds': expected radtan"},
      {"mtx: [1, 0, 2, 0, 1, 2, 0, 0, 1]\ndist: [0, 0, 0]\n",
       "number of distortion coefficients = 3"},
      {replaced(kTumVie, "\"k4\": 4", "\"k4\": \"a\""), "intrinsics: k4 = 'a': expected a finite"},
      {"intrinsics: {cam0: 3}\nextrinsics: {}\n", "intrinsics: cam0: expected keys and values"},
      {"intrinsics: {}\nextrinsics: {}\n", "intrinsics: cam0 is missing"},
      {replaced(kCameraInfo, "plumb_bob", "rational_polynomial"),
       "given.txt:5: distortion_model = 'rational_polynomial': expected radtan"},
      {replaced(kCameraInfo, "133, 0, 0, 1]", "133, 0, 0]"),
       ":4: camera_matrix: 8 numbers: expected 9, fx 0 cx"},
      {replaced(kCameraInfo, "260", "260.5"), "image_height = 260.5: expected whole numbers"},
      {replaced(kCameraInfo, ", 0.4, 0.5]", "]"),
       "number of distortion coefficients = 3: must be 4 or 5"},
      {replaced(ini, "fx = 50", "fx = a"), "[A_LEFT]: fx = 'a': expected a finite number"},
      {replaced(ini, "fx = 50", "fx 50"), "given.txt:4: 'fx 50': expected [section] or key"},
      {replaced(ini, "fx = 50\n", ""), "given.txt: 0 sections with fx: expected one camera"},
      {replaced(ini, "cx = 32\n", ""), "[A_LEFT]: cx is missing"},
      {replaced(ini, "[64 48]", "[]"), "[A_LEFT]: resolution: 0 numbers: expected 2, width height"},
      {replaced(ini, "none", "fov"), "[A_LEFT]: distortion = 'fov': expected radtan"},
      {ini + replaced(ini, "A_LEFT", "B_RIGHT"), "2 sections with fx: expected one camera, or"},
      {ini + replaced(ini, "A_LEFT", "A_RIGHT"), "given.txt: [A_LEFT2RIGHT_POSE] is missing"},
      {ini + replaced(ini, "A_LEFT", "A_RIGHT") +
           "[A_LEFT2RIGHT_POSE]\npose_quaternion = [1 0 0 0 0 1.011 0]\n",
       "[A_LEFT2RIGHT_POSE]: qx qy qz qw of length 1.011: expected a rotation"},
      {replaced(ini, "none", "plumb_bob\ndist = [1 0 0 0 0 0 0 2]"),
       "number of distortion coefficients = 8: must be 4 or 5"},
  };
  for (const auto& row : cases) EXPECT_THAT(errorOfText(row.text), HasSubstr(row.error));
  for (const char* matrix :
       {"226, 1, 173, 0, 227, 133, 0, 0, 1", "226, 0, 173, 1, 227, 133, 0, 0, 1",
        "226, 0, 173, 0, 227, 133, 1, 0, 1", "226, 0, 173, 0, 227, 133, 0, 1, 1",
        "226, 0, 173, 0, 227, 133, 0, 0, 2"}) {
    EXPECT_THAT(errorOfText(replaced(kCameraInfo, "226, 0, 173, 0, 227, 133, 0, 0, 1", matrix)),
                HasSubstr(":4: camera_matrix = a matrix with skew"));
  }
  EXPECT_EQ(read(ini).rig.cameras[0].model.distortion, DistortionModel::kNone);
  const std::string numbers = "200 201 120 90 0.1 0 0 0 0\n";
  EXPECT_NO_THROW(read(numbers + std::string(10'000'000 - numbers.size(), ' ')));
  EXPECT_THAT(errorOfText(numbers + std::string(10'000'001 - numbers.size(), ' ')),
              HasSubstr("given.txt: larger than 10 MB"));
  EXPECT_THAT(errorOf([&] { readCalibration(folder() / "nowhere"); }),
              EndsWith("nowhere: cannot be opened for reading"));
  EXPECT_THAT(errorOf([&] { readCalibration(folder()); }),
              EndsWith("cannot be opened for reading"));
}

}  // namespace

// Calibration files of real data sets, and the files for them in config/.

namespace {

namespace fs = std::filesystem;

const fs::path kFiles = EFM_SHARED_DATA "/calibration";
const fs::path kConfig = EFM_SOURCE_DIR "/config/calibration";
const fs::path kDsec = kFiles / "dsec/zurich_city_04_a_calibration";

class DatasetCalibration : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kFiles)) GTEST_SKIP() << kFiles << " is not there";
  }
};

void expectNear(const Rigid3& T_a_b, const Rigid3& expected, double tolerance) {
  const Rigid3 difference = T_a_b.inverse() * expected;
  EXPECT_LT(difference.translation.norm(), tolerance);
  EXPECT_LT(difference.rotation.vec().norm(), tolerance);
}

TEST_F(DatasetCalibration, OfConfigIsThatOfTheDataSet) {
  const std::pair<const char*, const char*> pairs[] = {
      {"mvsec.yaml", "mvsec/calib_in_flying/camchain-imucam-indoor_flying.yaml"},
      {"dsec.yaml", "dsec/camchain.yaml"},
      {"tumvie_a.yaml", "tum-vie/camchainA.yaml"},
      {"tumvie_b.yaml", "tum-vie/camchainB.yaml"}};
  const auto files = std::distance(fs::directory_iterator(kConfig), fs::directory_iterator());
  EXPECT_EQ(files, std::distance(std::begin(pairs), std::end(pairs)));
  for (const auto& [ours, original] : pairs) {
    const Rig rig = readCamchain(kConfig / ours);
    const Rig expected = readCamchain(kFiles / original);
    ASSERT_EQ(rig.cameras.size(), 2U) << ours;
    for (std::size_t c = 0; c < 2; ++c) {
      EXPECT_EQ(rig.cameras[c].model, expected.cameras.at(c).model) << ours << c;
      EXPECT_TRUE(isSame(rig.cameras[c].T_rig_cam, expected.cameras[c].T_rig_cam)) << ours << c;
    }
  }
}

TEST_F(DatasetCalibration, EqualsTheCameraChainBesideIt) {
  const struct {
    fs::path original;
    fs::path camchain;
    double baseline_m;
  } rows[] = {
      {kDsec / "cam_to_cam.yaml", kFiles / "dsec/camchain.yaml", 0.5990},
      {kFiles / "tum-vie/camera-calibrationA.json", kFiles / "tum-vie/camchainA.yaml", 0.1185},
      {kFiles / "tum-vie/camera-calibrationB.json", kFiles / "tum-vie/camchainB.yaml", 0.1188},
      {kFiles / "mvsec/calib_in_flying/camchain-imucam-indoor_flying.yaml",
       kFiles / "mvsec/camchain.yaml", 0.0999},
  };
  for (const auto& row : rows) {
    const Rig rig = readCalibration(row.original).rig;
    const Rig expected = readCamchain(row.camchain);
    ASSERT_EQ(rig.cameras.size(), 2U) << row.original;
    for (std::size_t c = 0; c < 2; ++c) {
      EXPECT_EQ(rig.cameras[c].model, expected.cameras[c].model) << row.original << c;
      expectNear(rig.cameras[c].T_rig_cam, expected.cameras[c].T_rig_cam, 1e-8);
    }
    EXPECT_NEAR(rig.cameras[1].T_rig_cam.translation.norm(), row.baseline_m, 1e-4) << row.original;
  }
}

TEST_F(DatasetCalibration, DsecsHandEyeTransformTurnsLidarPosesIntoPosesOfTheLeftEventCamera) {
  const Calibration calibration = readCalibration(kDsec / "cam_to_cam.yaml");
  const Rigid3 T_lidar_rig = readHandEye(kDsec / "cam_to_lidar.yaml", &calibration);
  // The 101st message of the LiDAR's odometry, and the same pose of the left event camera from the
  // paper's authors.
  const Rigid3 T_world_lidar = {Eigen::Quaterniond(0.9166968464851379, -0.021439503878355026,
                                                   0.016320353373885155, -0.39867401123046875)
                                    .normalized(),
                                {17.737157821655273, -38.65839385986328, -1.0624276399612427}};
  const Rigid3 T_world_cam0 = {
      Eigen::Quaterniond(0.246629, -0.266376, 0.662237, -0.655485).normalized(),
      {18.240932, -38.778219, -1.297551}};
  expectNear(T_world_lidar * T_lidar_rig, T_world_cam0, 5e-6);  // the files have six decimals
}

TEST_F(DatasetCalibration, TumViesHandEyeTransformIsThatOfTheMarkerAndTheImu) {
  const Calibration calibration = readCalibration(kFiles / "tum-vie/camera-calibrationA.json");
  ASSERT_TRUE(calibration.T_imu_rig);
  EXPECT_EQ(calibration.T_imu_rig->translation,
            Eigen::Vector3d(-0.034803406191293906, 0.05971773350374604, -0.03694727254557562));
  const Rigid3 T_marker_rig =
      readHandEye(kFiles / "tum-vie/mocap-imu-calibrationA.json", &calibration);
  const Rigid3 T_imu_marker = {Eigen::Quaterniond(0.4621412967462215, 0.4825868335932214,
                                                  0.3181655742164699, 0.6725370155372069)
                                   .normalized(),
                               {0.0682395566125301, 0.05484102693333699, 0.06451606289598333}};
  expectNear(T_imu_marker * T_marker_rig, *calibration.T_imu_rig, 1e-12);
}

class HandEyeFile : public TemporaryFolder {
 protected:
  Rigid3 read(const std::string& text) const {
    writeFile(folder() / "hand_eye.yaml", text);
    return readHandEye(folder() / "hand_eye.yaml");
  }
  std::string errorOfText(const std::string& text) const {
    return errorOf([&] { read(text); });
  }
};

TEST_F(HandEyeFile, GivesTheTransformFromTheRigToTheBody) {
  // The rig looks along the body's x axis: the rig's z axis is the body's x axis.
  const Rigid3 T_body_rig = read(
      "# a car\nT_body_rig:\n- [0, 0, 1, 0.4]\n- [-1, 0, 0, 0.2]\n- [0, -1, 0, -0.1]\n"
      "- [0, 0, 0, 1]\nnote: other keys do not matter\n");
  EXPECT_LT((T_body_rig * Eigen::Vector3d(0, 0, 2) - Eigen::Vector3d(2.4, 0.2, -0.1)).norm(),
            1e-12);
}

TEST_F(HandEyeFile, MayBeANumpyArrayOrTextOfTheMatrix) {
  const Eigen::Vector3d expected(2.4, 0.2, -0.1);
  for (const char* text :
       {"0 0 1 0.4\n-1 0 0 0.2\n0 -1 0 -0.1\n0 0 0 1\n",
        "[[ 0.  0.  1.  0.4]\n [-1.  0.  0.  0.2]\n [ 0. -1.  0. -0.1]\n [ 0.  0.  0.  1. ]]\n",
        "# np.savetxt\n0e0,0,1e+00,4e-01\n-1,0,0,0.2\n0,-1,0,-0.1\n0,0,0,1\n"}) {
    EXPECT_LT((read(text) * Eigen::Vector3d(0, 0, 2) - expected).norm(), 1e-12) << text;
  }
  std::string npy("\x93NUMPY\1\0", 8);
  std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': (4, 4), }";
  header.resize(117, ' ');
  appendLittleEndian(npy, std::uint16_t{118});
  npy += header + "\n";
  const std::string begin = npy;
  for (const double value : {0., 0., 1., .4, -1., 0., 0., .2, 0., -1., 0., -.1, 0., 0., 0., 1.}) {
    appendLittleEndian(npy, value);
  }
  EXPECT_LT((read(npy) * Eigen::Vector3d(0, 0, 2) - expected).norm(), 1e-12);
  EXPECT_THAT(errorOfText(begin), HasSubstr("T_body_rig is missing"));
  EXPECT_THAT(errorOfText(replaced(npy, "False", "True ")), HasSubstr("hand_eye.yaml: "));
  EXPECT_THAT(errorOfText("0 0 1 0.4\n-1 0 0 0.2\n0 -1 0 -0.1\n0 0 0 2\n"),
              HasSubstr("a 4x4 matrix: expected a rotation and a last row 0 0 0 1"));
}

TEST_F(HandEyeFile, AnErrorNamesTheFileTheLineAndTheKey) {
  for (const char* text : {"", "T_rig_body: 1\n"}) {
    EXPECT_THAT(errorOfText(text),
                AllOf(HasSubstr("hand_eye.yaml: T_body_rig is missing: expected YAML"),
                      HasSubstr("4 rows of 4 numbers")))
        << text;
  }
  EXPECT_THAT(
      errorOfText("0 0 0 0 0 1\n"),
      HasSubstr("hand_eye.yaml: 6 numbers: expected 7, a position and a quaternion, or 16"));
  for (const char* text : {"# x y z qw qx qy qz\n1 2 3 1 0 0 0\n",
                           "# x[cm] y[cm] z[cm] qx qy qz qw\n1 2 3 0 0 0 1\n"}) {
    EXPECT_THAT(errorOfText(text),
                HasSubstr("hand_eye.yaml: expected x y z qx qy qz qw, in metres"));
  }
  EXPECT_THAT(errorOfText("\nT_body_rig: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]\n"),
              HasSubstr("hand_eye.yaml:2: T_body_rig: 12 numbers: expected 4 rows of 4 numbers"));
  EXPECT_THAT(errorOf([&] { readHandEye(folder() / "nowhere"); }),
              HasSubstr("nowhere: cannot be opened"));
  EXPECT_THAT(errorOfText("cam0: {camera_model: pinhole}\n"),
              HasSubstr("hand_eye.yaml:1: cam0: T_cam_imu is missing"));
  EXPECT_THAT(errorOfText("cam0: {}\ncam2: {}\n"), HasSubstr("hand_eye.yaml: cam2 without cam1"));
}

TEST_F(HandEyeFile, OfEasyHandEyeIsThatOfACameraOnTheHand) {
  const char* const text =
      "parameters: {eye_on_hand: true}\n"
      "transformation: {qw: 0, qx: 0, qy: 0, qz: 1, x: 0.05, y: 0.1, z: 0.2}\n";
  EXPECT_LT((read(text) * Eigen::Vector3d(1, 2, 3) - Eigen::Vector3d(-0.95, -1.9, 3.2)).norm(),
            1e-12);
  EXPECT_THAT(errorOfText(replaced(text, "true", "false")),
              HasSubstr("parameters: eye_on_hand = 'false': expected true: a camera on the"));
  // easy_handeye2
  const char* const second =
      "parameters: {name: a, calibration_type: eye_in_hand}\ntransform:\n"
      "  translation: {x: 0.05, y: 0.1, z: 0.2}\n  rotation: {x: 0, y: 0, z: 1, w: 0}\n";
  EXPECT_TRUE(isSame(read(second), read(text)));
  EXPECT_THAT(errorOfText(replaced(second, "eye_in_hand", "eye_on_base")),
              HasSubstr("calibration_type = 'eye_on_base': expected eye_in_hand: a camera on the"));
}

TEST_F(HandEyeFile, MayBeOfVinsOpenVinsOrSevenNumbers) {
  const Rigid3 expected =
      read("T_body_rig: [[0, 0, 1, 0.4], [-1, 0, 0, 0.2], [0, -1, 0, -0.1], [0, 0, 0, 1]]\n");
  for (const char* text :
       {"%YAML:1.0\nbody_T_cam0: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n"
        "   data: [0, 0, 1, 0.4, -1, 0, 0, 0.2, 0, -1, 0, -0.1, 0, 0, 0, 1]\n",
        "cam0:\n  T_imu_cam:\n  - [0, 0, 1, 0.4]\n  - [-1, 0, 0, 0.2]\n  - [0, -1, 0, -0.1]\n"
        "  - [0, 0, 0, 1]\n",
        "extrinsicRotation: {data: [0, 0, 1, -1, 0, 0, 0, -1, 0]}\n"
        "extrinsicTranslation: {data: [0.4, 0.2, -0.1]}\n",
        "0.4 0.2 -0.1 -0.5 0.5 -0.5 0.5\n",
        "# x y z qx qy qz qw\n0.4,0.2,-0.1,0.5,-0.5,0.5,-0.5\n"}) {
    expectNear(read(text), expected, 1e-12);
  }
  EXPECT_THAT(errorOfText("1 2 3 0 0 0 2\n"),
              HasSubstr("hand_eye.yaml: qx qy qz qw of length 2: exp"));
}

TEST_F(HandEyeFile, OfTheImuIsThatOfTheCameraChain) {
  // T_cam_imu maps the IMU's point (5, 6, 7) to (-6, 5, 7) + (1, 2, 3).
  const Rigid3 T_imu_rig =
      read("cam0: {T_cam_imu: [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]}\n");
  EXPECT_LT((T_imu_rig * Eigen::Vector3d(-5, 7, 10) - Eigen::Vector3d(5, 6, 7)).norm(), 1e-12);
}

TEST_F(HandEyeFile, OfADataSetNeedsItsCalibration) {
  const char* const lidar =
      "T_lidar_camRect1: [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]\n";
  EXPECT_THAT(errorOfText(lidar), AllOf(HasSubstr("hand_eye.yaml"), HasSubstr("cam_to_cam.yaml")));
  const char* const marker =
      R"({"value0": {"T_imu_marker": {"px": 0, "py": 0, "pz": 0, "qx": 0, "qy": 0, "qz": 0, "qw": 1}}})";
  EXPECT_THAT(errorOfText(marker), HasSubstr("camera-calibration*.json"));
  EXPECT_THAT(errorOfText(R"({"value0": {"T_imu_marker": {"px": 0}}})"),
              HasSubstr("value0: T_imu_marker: py is missing"));
  EXPECT_THAT(errorOfText(replaced(marker, R"("qx": 0)", R"("qx": 0.145)")),  // norm 1.0105
              HasSubstr("T_imu_marker: qx qy qz qw of length 1.01046: expected a rotation"));
}

}  // namespace

}  // namespace efm
