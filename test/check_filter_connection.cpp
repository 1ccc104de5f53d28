// The panel's connection to a filter: beside a FastSLAM node in a namespace, and filters that are
// missing, come back or do not answer. Private parameter: folder (in which the node saves maps).
#include <dynamic_reconfigure/Reconfigure.h>
#include <gtest/gtest.h>
#include <ros/ros.h>

#include <atomic>
#include <filesystem>
#include <memory>

#include "pf_resampling_core/parameters/parameters.hpp"
#include "pf_resampling_core/test/says.hpp"
#include "rviz_panel/controls.hpp"
#include "rviz_panel/filter_connection.hpp"
#include "src/node/reconfigure_server.hpp"

namespace pf_resampling {
namespace {

constexpr double kPatience = 10.0;  // s, for a busy machine

// Everything that came until `done` says so.
template <typename Done>
FilterNews wait_for(FilterConnection* connection, const Done& done) {
  FilterNews all;
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kPatience);
  while (ros::WallTime::now() < end) {
    FilterNews news = connection->take_news();
    all.master = news.master;
    all.node = news.node;
    all.services = news.services;
    all.is_calling = news.is_calling;
    if (news.description) all.description = news.description;
    if (news.values) all.values = news.values;
    all.statuses.insert(all.statuses.end(), news.statuses.begin(), news.statuses.end());
    all.results.insert(all.results.end(), news.results.begin(), news.results.end());
    if (done(all)) return all;
    ros::WallDuration(0.02).sleep();
  }
  ADD_FAILURE() << "did not come within " << kPatience << " s";
  return all;
}

std::string value_of(const FilterNews& news, const std::string& name) {
  if (!news.values) return "";
  return values_of(*news.values)[name];
}

bool is_complete(const FilterNews& news) {
  return news.description && news.values;
}

TEST(FilterConnection, SetsAndSeesWhatOthersSet) {
  FilterConnection connection("/robot1/fastslam");
  wait_for(&connection, is_complete);
  connection.set(request_of("population/threshold", "0.25"));
  wait_for(&connection, [](const auto& news) {
    return std::strtod(value_of(news, "population/threshold").c_str(), nullptr) == 0.25;
  });
  dynamic_reconfigure::Reconfigure elsewhere;
  elsewhere.request.config = request_of("particles", "321");
  ASSERT_TRUE(ros::service::call("/robot1/fastslam/set_parameters", elsewhere));
  wait_for(&connection, [](const auto& news) { return value_of(news, "particles") == "321"; });
}

TEST(FilterConnection, RefusedValuesStayAndAreShown) {
  FilterConnection connection("/robot1/fastslam");
  const FilterNews start = wait_for(&connection, is_complete);
  const std::string before = value_of(start, "population/threshold");
  connection.set(request_of("population/threshold", "7"));
  const FilterNews after =
      wait_for(&connection, [](const auto& news) { return news.values && !news.results.empty(); });
  ASSERT_FALSE(after.results.empty());
  EXPECT_EQ(after.results[0].text, "/robot1/fastslam/set_parameters: refused, or broken off");
  EXPECT_EQ(value_of(after, "population/threshold"), before);
}

TEST(FilterConnection, KnowsWhatIsOffered) {
  FilterConnection connection("/robot1/fastslam");
  const FilterNews news =
      wait_for(&connection, [](const auto& all) { return all.services.size() == 4; });
  EXPECT_TRUE(news.master);
  EXPECT_TRUE(news.node);
}

TEST(FilterConnection, ButtonsSayWhatCameOfThem) {
  const std::string folder = ros::NodeHandle("~").param<std::string>("folder", "");
  FilterConnection connection("/robot1/fastslam");
  connection.call("reset", "Started from nothing");
  FilterNews news = wait_for(&connection, [](const auto& all) { return !all.results.empty(); });
  EXPECT_TRUE(news.results[0].success) << news.results[0].text;
  const std::string file = folder + "/saved.map";
  connection.save_map("saved.map");
  news = wait_for(&connection, [](const auto& all) { return !all.results.empty(); });
  EXPECT_EQ(news.results[0].success, std::filesystem::exists(file)) << news.results[0].text;
  connection.load_map("nothing.map", true);
  news = wait_for(&connection, [](const auto& all) { return !all.results.empty(); });
  EXPECT_FALSE(news.results[0].success);
  EXPECT_TRUE(says(news.results[0].text, "nothing.map"));
  connection.save_map("/not/in/the/folder/of/the/node/saved.map");
  news = wait_for(&connection, [](const auto& all) { return !all.results.empty(); });
  EXPECT_FALSE(news.results[0].success);
  EXPECT_NE(news.results[0].text, "");
  std::filesystem::remove_all(folder);
}

TEST(FilterConnection, NobodyThereIsSaidAndNotWaitedFor) {
  const ros::WallTime start = ros::WallTime::now();
  FilterConnection connection("/nobody");
  connection.set(dynamic_reconfigure::Config());
  connection.call("global_localization", "");
  EXPECT_LT((ros::WallTime::now() - start).toSec(), 0.05);
  const FilterNews news =
      wait_for(&connection, [](const auto& all) { return all.results.size() == 2; });
  EXPECT_EQ(news.results[0].text, "/nobody/set_parameters: nobody offers this service");
  EXPECT_FALSE(news.node);
}

TEST(FilterConnection, NamesThatAreNoneDoNoHarm) {
  for (const char* name : {"", "/", "not a name", "~private", "//x//"}) {
    FilterConnection connection(name);
    connection.call("reset", "");
    ros::WallDuration(0.3).sleep();
    connection.take_news();
  }
}

// A filter in this process: what it describes can be changed, and it can be slow.
class SmallFilter {
 public:
  explicit SmallFilter(double threshold) : threshold_(threshold), spinner_(1, &queue_) {
    ros::NodeHandle node("/small");
    node.setCallbackQueue(&queue_);
    server_ = std::make_unique<ReconfigureServer>(
        node,
        [this] {
          return ParameterList{
              basic(real_parameter("threshold", &threshold_, 0.0, 1.0, "", "A threshold"))};
        },
        [this](const auto& values) {
          ros::WallDuration(delay_).sleep();
          threshold_ = std::strtod(values.at("threshold").c_str(), nullptr);
        });
    spinner_.start();
  }
  void be_slow(double seconds) { delay_ = seconds; }

 private:
  double threshold_;
  std::atomic<double> delay_{0.0};
  ros::CallbackQueue queue_;
  std::unique_ptr<ReconfigureServer> server_;
  ros::AsyncSpinner spinner_;
};

TEST(FilterConnection, AFilterThatComesBackIsFoundAgain) {
  FilterConnection connection("/small");
  {
    SmallFilter filter(0.25);
    const FilterNews first = wait_for(&connection, is_complete);
    EXPECT_EQ(value_of(first, "threshold"), "0.25");
    wait_for(&connection, [](const auto& news) { return news.node; });
  }
  wait_for(&connection, [](const auto& news) { return !news.node; });
  SmallFilter filter(0.75);
  const FilterNews second = wait_for(&connection, is_complete);
  EXPECT_EQ(value_of(second, "threshold"), "0.75");
}

TEST(FilterConnection, IsClosedWhileACallIsUnderWay) {
  SmallFilter filter(0.25);
  filter.be_slow(3.0);
  ros::WallTime closed;
  {
    FilterConnection connection("/small");
    const FilterNews start = wait_for(&connection, is_complete);
    connection.set(request_of("threshold", "0.5"));
    wait_for(&connection, [](const auto& news) { return news.is_calling; });
    ros::WallDuration(0.2).sleep();
    closed = ros::WallTime::now();
  }
  EXPECT_LT((ros::WallTime::now() - closed).toSec(), 1.0);
}

}  // namespace
}  // namespace pf_resampling

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "check_filter_connection");
  ros::NodeHandle node;
  return RUN_ALL_TESTS();
}
