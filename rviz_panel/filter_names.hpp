#pragma once

#include <algorithm>
#include <iterator>
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
  std::string load_map;
  std::string checkpoint;
  std::string path;
  std::string markers;
};

/// A topic or service of a filter: where its name is kept, the name that it usually has, and what
/// the panel and rviz' configuration call it.
struct NameRow {
  std::string FilterNames::*name;
  const char* usual;
  const char* label;
  const char* key;
};
inline constexpr NameRow kFilterNames[] = {
    {&FilterNames::status, "status", "Status", "Status Topic"},
    {&FilterNames::global_localization, "global_localization", "Global localization",
     "Global Localization Service"},
    {&FilterNames::reset, "reset", "Reset", "Reset Service"},
    {&FilterNames::save_map, "save_map", "Save map", "Save Map Service"},
    {&FilterNames::load_map, "load_map", "Load map", "Load Map Service"},
    {&FilterNames::checkpoint, "checkpoint", "Checkpoint", "Checkpoint Service"},
    {&FilterNames::path, "path", "Path", "Path Topic"},
    {&FilterNames::markers, "markers", "Markers", "Markers Topic"}};

inline bool operator==(const FilterNames& a, const FilterNames& b) {
  return a.node == b.node &&
         std::all_of(std::begin(kFilterNames), std::end(kFilterNames),
                     [&](const NameRow& row) { return a.*row.name == b.*row.name; });
}

/// The same with all names given. `resolve` makes names absolute (ros::names::resolve).
template <typename Resolve>
FilterNames completed(const FilterNames& names, const Resolve& resolve) {
  FilterNames complete;
  complete.node = resolve(names.node);
  const std::string space = complete.node.substr(0, complete.node.rfind('/') + 1);
  for (const NameRow& row : kFilterNames) {
    const std::string& name = names.*row.name;
    complete.*row.name = name.empty() ? space + row.usual : resolve(name);
  }
  return complete;
}

}  // namespace pf_resampling
