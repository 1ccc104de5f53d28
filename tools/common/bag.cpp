#include "tools/common/bag.hpp"

#include <rosbag/exceptions.h>
#include <rosbag/view.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>

#include "pf_resampling_core/error.hpp"
#include "tools/common/bag_structure.hpp"
#include "tools/common/files.hpp"
#include "tools/common/table.hpp"

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

bool begins_like_a_bag(const std::string& path) {
  static const std::string kMagic = "#ROSBAG V";
  std::array<char, 9> begin{};
  std::ifstream stream(path, std::ios::binary);
  stream.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return std::equal(begin.begin(), begin.end(), kMagic.begin(), kMagic.end());
}

rosbag::Bag open_bag(const std::string& path) {
  require_regular_file(path, "bag");
  if (!begins_like_a_bag(path)) throw Error(path + ": is not a bag (it does not begin like one)");
  check_bag_structure(path);
  rosbag::Bag bag;
  try {
    bag.open(path, rosbag::bagmode::Read);
  } catch (const std::exception& error) {
    throw Error(path + ": is truncated or damaged (" + error.what() + "); try: rosbag reindex " +
                path);
  }
  return bag;
}

std::vector<BagTopic> topics_of(const rosbag::Bag& bag) {
  std::map<std::string, BagTopic> topics;
  rosbag::View everything(bag);
  for (const rosbag::ConnectionInfo* connection : everything.getConnections()) {
    BagTopic& topic = topics[connection->topic];
    topic.name = connection->topic;
    topic.type = connection->datatype;
    const auto latching = connection->header->find("latching");
    topic.latched = latching != connection->header->end() && latching->second == "1";
  }
  std::vector<BagTopic> list;
  for (auto& [name, topic] : topics) {
    topic.messages = rosbag::View(bag, rosbag::TopicQuery(name)).size();
    list.push_back(topic);
  }
  return list;
}

bool has_topic(const rosbag::Bag& bag, const std::string& name, const std::string& type) {
  const std::vector<BagTopic> topics = topics_of(bag);
  return std::any_of(topics.begin(), topics.end(), [&](const BagTopic& topic) {
    return topic.name == name && (type.empty() || topic.type == type);
  });
}

std::string list_of(const std::vector<BagTopic>& topics) {
  std::vector<std::string> words;
  for (const BagTopic& topic : topics) words.push_back(topic.name + " (" + topic.type + ")");
  return words.empty() ? "nothing" : joined(words, ", ");
}

void require_topics(const rosbag::Bag& bag, const std::string& path,
                    const std::vector<NeededTopic>& needed) {
  const std::vector<BagTopic> topics = topics_of(bag);
  for (const NeededTopic& need : needed) {
    const auto found = std::find_if(topics.begin(), topics.end(), [&](const BagTopic& topic) {
      return topic.name == need.name &&
             std::find(need.types.begin(), need.types.end(), topic.type) != need.types.end();
    });
    if (found != topics.end()) continue;
    throw Error(path + ": has no " + need.name + " of type " + joined(need.types, " or ") +
                "; it has " + list_of(topics) +
                (need.option.empty() ? "" : "; " + need.option + " names another topic"));
  }
}

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

BagWriter::BagWriter(const std::string& path)
    : new_file_(path, path + ":"), file_(new_file_.descriptor(), path) {}

void BagWriter::copy(const rosbag::MessageInstance& message) {
  const boost::shared_ptr<ros::M_string> header = message.getConnectionHeader();
  auto connection = copied_.find(header);
  if (connection == copied_.end()) {
    connection = copied_.emplace(header, file_.add_connection(message.getTopic(), *header)).first;
  }
  const std::uint32_t size = message.size();
  ros::serialization::OStream stream(file_.write(connection->second, message.getTime(), size),
                                     size);
  message.write(stream);
}

void BagWriter::finish() {
  file_.close();
  new_file_.finish();
}

}  // namespace pf_resampling
