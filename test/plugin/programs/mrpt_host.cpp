// SPDX-License-Identifier: BSD-3-Clause
// A mapping program that uses MRPT only: it neither includes a header of this project nor links
// its libraries. It loads the plugin, creates all objects by name, plays a rawlog and saves the
// map.
//
//     mrpt_host PLUGIN.so CONFIG.ini PREFIX RECORDING.rawlog OUT
//
// writes OUT.simplemap and OUT.txt ("x y z intensity" of each point).

#include <mrpt/config/CConfigFile.h>
#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CRawlog.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/rtti/CObject.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/slam/CMetricMapBuilder.h>
#include <mrpt/system/os.h>

#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>

namespace {

template <typename Interface>
std::shared_ptr<Interface> madeByName(const std::string& name) {
  const auto object = std::dynamic_pointer_cast<Interface>(mrpt::rtti::classFactory(name));
  if (!object) throw std::runtime_error("the plugin does not make " + name);
  return object;
}

/// @return the number of entries.
std::size_t play(const std::string& file, mrpt::slam::CMetricMapBuilder& builder) {
  mrpt::io::CFileGZInputStream stream(file);
  auto archive = mrpt::serialization::archiveFrom(stream);
  mrpt::obs::CActionCollection::Ptr action;
  mrpt::obs::CSensoryFrame::Ptr frame;
  mrpt::obs::CObservation::Ptr observation;
  std::size_t entry = 0;
  while (mrpt::obs::CRawlog::getActionObservationPairOrObservation(archive, action, frame,
                                                                   observation, entry)) {
    mrpt::obs::CActionCollection no_action;
    mrpt::obs::CSensoryFrame one;
    if (observation) one.insert(observation);
    builder.processActionObservation(action ? *action : no_action, frame ? *frame : one);
  }
  auto end = mrpt::obs::CObservationComment::Create();
  end->text = "event_fusion: finish";
  mrpt::obs::CActionCollection no_action;
  mrpt::obs::CSensoryFrame last;
  last.insert(end);
  builder.processActionObservation(no_action, last);
  return entry;
}

void run(const std::string& plugin, const std::string& config, const std::string& prefix,
         const std::string& rawlog, const std::string& out) {
  std::string error;
  if (!mrpt::system::loadPluginModule(plugin, error)) throw std::runtime_error(error);
  madeByName<mrpt::obs::CObservation>("efm::CObservationEvents");
  madeByName<mrpt::maps::CMetricMap>("efm::CEventFusionMap");
  const auto builder = madeByName<mrpt::slam::CMetricMapBuilder>("efm::CEventFusionMapBuilder");

  auto& options = dynamic_cast<mrpt::config::CLoadableOptions&>(*builder);
  options.loadFromConfigFile(mrpt::config::CConfigFile(config), prefix);
  options.dumpToTextStream(std::cout);
  std::cout << play(rawlog, *builder) << " entries\n";

  const auto* maps = builder->getCurrentlyBuiltMetricMap();
  for (const auto& map : *maps) std::cout << "map: " << map->asString() << "\n";
  const auto points = maps->mapByClass<mrpt::maps::CPointsMapXYZI>();
  if (!points || points->empty()) throw std::runtime_error("there is no map");
  std::cout << points->size() << " points, " << builder->getCurrentlyBuiltMapSize()
            << " keyframes\n";
  if (!points->saveXYZI_to_text_file(out + ".txt")) throw std::runtime_error("cannot save");
  builder->saveCurrentMapToFile(out + ".simplemap");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6) {
    std::cerr << "usage: mrpt_host PLUGIN.so CONFIG.ini PREFIX RECORDING.rawlog OUT\n";
    return 2;
  }
  try {
    run(argv[1], argv[2], argv[3], argv[4], argv[5]);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "mrpt_host: " << error.what() << "\n";
    return 1;
  }
}
