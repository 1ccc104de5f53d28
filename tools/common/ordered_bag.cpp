#include "tools/common/ordered_bag.hpp"

#include <rosbag/exceptions.h>
#include <rosbag/view.h>

#include <algorithm>

#include "pf_resampling_core/error.hpp"

namespace pf_resampling {
namespace {

std::ptrdiff_t rank_of(const std::string& topic, const std::vector<std::string>& order) {
  return std::find(order.begin(), order.end(), topic) - order.begin();
}

void for_each_in_order(rosbag::View* view, const std::vector<std::string>& order,
                       const std::function<void(const rosbag::MessageInstance&)>& take) {
  // Instances can be copied, but not assigned: their order is that of pointers.
  std::vector<rosbag::MessageInstance> same_time;
  const auto before = [&](const rosbag::MessageInstance* a, const rosbag::MessageInstance* b) {
    const auto rank_a = rank_of(a->getTopic(), order);
    const auto rank_b = rank_of(b->getTopic(), order);
    return rank_a != rank_b ? rank_a < rank_b : a->getTopic() < b->getTopic();
  };
  const auto flush = [&] {
    std::vector<const rosbag::MessageInstance*> sorted;
    for (const rosbag::MessageInstance& message : same_time) sorted.push_back(&message);
    std::stable_sort(sorted.begin(), sorted.end(), before);
    for (const rosbag::MessageInstance* message : sorted) take(*message);
    same_time.clear();
  };
  for (const rosbag::MessageInstance& message : *view) {
    if (!same_time.empty() && same_time.back().getTime() != message.getTime()) flush();
    same_time.push_back(message);
  }
  flush();
}

}  // namespace

void for_each_in_order(const rosbag::Bag& bag, const std::string& path,
                       const std::vector<std::string>& order,
                       const std::function<void(const rosbag::MessageInstance&)>& take) {
  try {
    rosbag::View view(bag);
    for_each_in_order(&view, order, take);
  } catch (const rosbag::BagException& error) {
    throw Error(path + ": cannot be read to its end (" + error.what() + "); try: rosbag reindex " +
                path);
  }
}

}  // namespace pf_resampling
