#pragma once

#include <pf_resampling/LandmarkMap.h>
#include <ros/subscriber.h>
#include <rviz/display.h>
#include <rviz/ogre_helpers/movable_text.h>

#include <cstdint>
#include <map>
#include <memory>
#include <string>

namespace rviz {
class ColorProperty;
class IntProperty;
class RosTopicProperty;
}  // namespace rviz

namespace pf_resampling {

/// The rviz display "pf_resampling/Landmark Ids": the ids of the landmarks of a map, of the same
/// size on the screen however near or far one looks. Those that would cover others are left out.
class LandmarkIdsDisplay : public rviz::Display {
 public:
  LandmarkIdsDisplay();
  ~LandmarkIdsDisplay() override;

  void setTopic(const QString& topic, const QString& datatype) override;
  void update(float wall_dt, float ros_dt) override;
  void reset() override;

 protected:
  void onEnable() override { subscribe(); }
  void onDisable() override;

 private:
  struct Label {
    std::unique_ptr<rviz::MovableText> text;
    Ogre::SceneNode* node = nullptr;
    double x = 0.0, y = 0.0;
    double height = 0.0;  ///< as it was set last
  };

  void subscribe();
  void take(const LandmarkMap& map);
  void clear();
  void remove(const Label& label);

  rviz::RosTopicProperty* topic_;
  rviz::IntProperty* size_;
  rviz::ColorProperty* color_;
  ros::Subscriber subscriber_;
  std::string frame_;
  std::map<std::int64_t, Label> labels_;
};

}  // namespace pf_resampling
