#include "tools/common/bag.hpp"

#include <rosbag/exceptions.h>
#include <rosbag/view.h>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/algorithm/string/join.hpp>
#include <csignal>
#include <cstdio>
#include <exception>
#include <fstream>
#include <set>

#include "pf_resampling_core/error.hpp"
#include "tools/common/files.hpp"

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

/// Opens a bag and reads it to its end; what goes wrong is said on the stream.
int read_all_of(const std::string& path, rosbag::Bag* bag) {
  try {
    bag->open(path, rosbag::bagmode::Read);
    rosbag::View everything(*bag);
    std::vector<std::uint8_t> bytes;
    for (const rosbag::MessageInstance& message : everything) {
      bytes.resize(message.size());
      ros::serialization::OStream stream(bytes.data(), message.size());
      message.write(stream);
    }
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}

/// What is wrong with a bag; nothing if it can be read to its end. rosbag takes lengths and places
/// as the file has them, and where these are wrong it says lines of its own or ends the process: a
/// child reads the bag first. `closed`: looks for plugins in all packages when it is made, and only
/// then.
std::string fault_in(const std::string& path, rosbag::Bag* closed) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw Error(path + ": cannot be read: no pipe is left");
  const pid_t child = fork();
  if (child == 0) {
    dup2(ends[1], STDOUT_FILENO);
    dup2(ends[1], STDERR_FILENO);
    for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE}) std::signal(signal, SIG_DFL);
    _exit(read_all_of(path, closed));
  }
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    throw Error(path + ": cannot be read: the system starts no more processes");
  }
  std::string said;
  std::array<char, 4096> block{};
  for (ssize_t size = 0; (size = read(ends[0], block.data(), block.size())) > 0;) {
    if (said.size() < block.size()) said.append(block.data(), static_cast<std::size_t>(size));
  }
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFSIGNALED(status))
    return "reading it ends rosbag by signal " + std::to_string(WTERMSIG(status));
  return said.substr(0, said.find('\n'));
}

bool begins_like_a_bag(const std::string& path) {
  static const std::string kMagic = "#ROSBAG V";
  std::array<char, 9> begin{};
  std::ifstream stream(path, std::ios::binary);
  stream.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return std::equal(begin.begin(), begin.end(), kMagic.begin(), kMagic.end());
}

}  // namespace

rosbag::Bag open_bag(const std::string& path) {
  require_regular_file(path, "bag");
  if (!begins_like_a_bag(path)) throw Error(path + ": is not a bag (it does not begin like one)");
  rosbag::Bag bag;
  const std::string fault = fault_in(path, &bag);
  if (!fault.empty()) {
    throw Error(path + ": is truncated or damaged (" + fault + "); try: rosbag reindex " + path);
  }
  bag.open(path, rosbag::bagmode::Read);
  return bag;
}

std::string topics_in_words(const rosbag::Bag& bag) {
  rosbag::View everything(bag);
  std::set<std::string> topics;
  for (const rosbag::ConnectionInfo* connection : everything.getConnections()) {
    topics.insert(connection->topic + " (" + connection->datatype + ")");
  }
  return topics.empty() ? "nothing" : boost::algorithm::join(topics, ", ");
}

void for_each_in_order(const std::vector<const rosbag::Bag*>& bags, const std::string& path,
                       const std::vector<std::string>& order,
                       const std::function<void(const rosbag::MessageInstance&)>& take) {
  try {
    rosbag::View view;
    for (const rosbag::Bag* bag : bags) view.addQuery(*bag);
    for_each_in_order(&view, order, take);
  } catch (const rosbag::BagException& error) {
    throw Error(path + ": cannot be read to its end (" + error.what() + "); try: rosbag reindex " +
                path);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {  // for instance no memory for what it holds
    throw Error(path + ": cannot be read to its end (" + error.what() + ")");
  }
}

}  // namespace pf_resampling
