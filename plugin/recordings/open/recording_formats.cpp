// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/recording_formats.h"

#include <stdexcept>

#include "plugin/recordings/bags/bag_recording.h"
#include "plugin/recordings/columns/event_arrays.h"
#include "plugin/recordings/columns/evimo2.h"
#include "plugin/recordings/columns/hdf5_files.h"
#include "plugin/recordings/columns/hdf5_recording.h"
#include "plugin/recordings/sensors/aedat4.h"
#include "plugin/recordings/sensors/prophesee_raw.h"
#include "plugin/recordings/streams/source_files.h"
#include "plugin/recordings/text/dataset_folder.h"
#include "plugin/recordings/text/event_text.h"
#include "plugin/recordings/text/uzh_text.h"

namespace efm {

bool looksLikeAedat4(const std::filesystem::path& file) { return beginsWith(file, kAedat4Magic); }

#ifndef EFM_WITH_HDF5
RecordingParts openHdf5(const std::vector<std::filesystem::path>& sources, const ReaderOptions&) {
  throw std::runtime_error(sources.front().string() +
                           ": this build does not read HDF5 (EFM_READ_HDF5)");
}
#endif

#ifndef EFM_WITH_AEDAT4
RecordingParts openAedat4(const std::vector<std::filesystem::path>& files, const ReaderOptions&) {
  throw std::runtime_error(files.front().string() +
                           ": this build does not read AEDAT4 (EFM_READ_AEDAT4)");
}
#endif

const std::vector<RecordingFormat>& readerFormats() {
  // A folder of HDF5 files may have a camchain.yaml, too: HDF5 comes before the dataset folder.
  static const std::vector<RecordingFormat> all = {
      {"hdf5", "an HDF5 file, or a folder of them (DSEC, TUM-VIE, VECtor, M3ED, MVSEC, Metavision)",
       looksLikeHdf5, openHdf5, truthOfFolder},
      {"folder", "a dataset folder (camchain.yaml, cam0/events.txt, poses.txt)",
       looksLikeDatasetFolder, openDatasetFolder, truthOfFolder},
      {"uzh", "a folder in the UZH layout (events.txt, groundtruth.txt, calib.txt)",
       looksLikeUzhFolder, openUzhFolder},
      {"rosbag", "a ROS 1 bag (.bag)", looksLikeRosbag, openBags},
      {"rosbag2", "a ROS 2 bag (.mcap, .db3 or the folder with metadata.yaml)", looksLikeRosbag2,
       openBags},
      {"raw", "a RAW file of a Prophesee camera (EVT 2.0, 2.1 or 3.0)", looksLikePropheseeRaw,
       openPropheseeRaw},
      {"aedat4", "an AEDAT4 file", looksLikeAedat4, openAedat4},
      {"evimo2", "a folder of EVIMO2 (dataset_events_t.npy and others)", looksLikeEvimo2,
       openEvimo2},
      {"numpy", "events in NumPy arrays (.npy, .npz)", looksLikeNumpy, openEventArrays},
      {"text", "a text file with a line t x y p per event, also compressed", looksLikeEventText,
       openEventText},
  };
  return all;
}

const RecordingFormat* detectFormat(const std::filesystem::path& source) {
  for (const RecordingFormat& format : readerFormats()) {
    if (format.matches(source)) return &format;
  }
  return nullptr;
}

}  // namespace efm
