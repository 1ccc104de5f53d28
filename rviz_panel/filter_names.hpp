#pragma once

#include <string>

namespace pf_resampling {

/// Where a filter is found. What is empty follows from the node: its topics and services are in the
/// node's namespace unless they were remapped.
struct FilterNames {
  std::string node = "beacon_mcl";  ///< "/robot1/fastslam"; relative names are in rviz' namespace
  std::string status;
  std::string global_localization;
  std::string reset;
  std::string save_map;

  bool operator==(const FilterNames& other) const {
    return node == other.node && status == other.status &&
           global_localization == other.global_localization && reset == other.reset &&
           save_map == other.save_map;
  }
};

/// The same with all names given. `resolve` makes names absolute (ros::names::resolve).
template <typename Resolve>
FilterNames completed(const FilterNames& names, const Resolve& resolve) {
  FilterNames complete;
  complete.node = resolve(names.node);
  const std::string space = complete.node.substr(0, complete.node.rfind('/') + 1);
  const auto complete_one = [&](const std::string& name, const char* usual) {
    return name.empty() ? space + usual : resolve(name);
  };
  complete.status = complete_one(names.status, "status");
  complete.global_localization = complete_one(names.global_localization, "global_localization");
  complete.reset = complete_one(names.reset, "reset");
  complete.save_map = complete_one(names.save_map, "save_map");
  return complete;
}

}  // namespace pf_resampling
