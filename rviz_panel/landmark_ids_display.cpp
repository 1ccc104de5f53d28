#include "rviz_panel/landmark_ids_display.hpp"

#include <OgreCamera.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreViewport.h>
#include <ros/message_traits.h>
#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/properties/color_property.h>
#include <rviz/properties/int_property.h>
#include <rviz/properties/ros_topic_property.h>
#include <rviz/view_controller.h>
#include <rviz/view_manager.h>
#include <pluginlib/class_list_macros.hpp>

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "rviz_panel/label_layout.hpp"

namespace pf_resampling {
namespace {

// Of the font, as a part of its height.
constexpr double kDigitWidth = 0.6;
// Between a landmark and its id, in pixels.
constexpr double kGap = 4.0;
constexpr double kSmallestChange = 0.01;  // of the height: each change makes the letters anew

}  // namespace

LandmarkIdsDisplay::LandmarkIdsDisplay()
    : topic_(new rviz::RosTopicProperty(
          "Topic", "landmark_map",
          QString::fromStdString(ros::message_traits::datatype<LandmarkMap>()),
          "The map, pf_resampling/LandmarkMap", this)),
      size_(new rviz::IntProperty("Size (Pixels)", 14, "Height of the ids on the screen", this)),
      color_(new rviz::ColorProperty("Color", QColor(230, 230, 230), "Of the ids", this)) {
  size_->setMin(4);
  size_->setMax(100);
  connect(topic_, &rviz::Property::changed, this, [this] {
    clear();
    subscribe();
  });
  connect(color_, &rviz::Property::changed, this, [this] {
    for (auto& [id, label] : labels_) label.text->setColor(color_->getOgreColor());
  });
}

LandmarkIdsDisplay::~LandmarkIdsDisplay() {
  subscriber_.shutdown();
  if (initialized()) clear();
}

void LandmarkIdsDisplay::setTopic(const QString& topic, const QString& /*datatype*/) {
  topic_->setString(topic);
}

void LandmarkIdsDisplay::onDisable() {
  subscriber_.shutdown();
  clear();
}

void LandmarkIdsDisplay::reset() {
  rviz::Display::reset();
  clear();
  subscribe();
}

void LandmarkIdsDisplay::subscribe() {
  subscriber_.shutdown();
  if (!isEnabled() || topic_->getTopicStd().empty()) return;
  try {
    subscriber_ = update_nh_.subscribe<LandmarkMap>(
        topic_->getTopicStd(), 2, [this](const LandmarkMap::ConstPtr& map) { take(*map); });
    setStatus(rviz::StatusProperty::Ok, "Topic", "OK");
  } catch (const ros::Exception& error) {
    setStatus(rviz::StatusProperty::Error, "Topic", error.what());
  }
}

void LandmarkIdsDisplay::take(const LandmarkMap& map) {
  frame_ = map.header.frame_id;
  std::set<std::int64_t> present;
  for (const Landmark& landmark : map.landmarks) {
    if (!std::isfinite(landmark.position.x) || !std::isfinite(landmark.position.y)) continue;
    present.insert(landmark.id);
    Label& label = labels_[landmark.id];
    label.x = landmark.position.x;
    label.y = landmark.position.y;
    if (label.text) continue;
    label.text = std::make_unique<rviz::MovableText>(std::to_string(landmark.id));
    label.text->setColor(color_->getOgreColor());
    label.text->setTextAlignment(rviz::MovableText::H_LEFT, rviz::MovableText::V_ABOVE);
    label.node = scene_node_->createChildSceneNode();
    label.node->attachObject(label.text.get());
    label.node->setVisible(false);
  }
  for (auto label = labels_.begin(); label != labels_.end();) {
    if (present.count(label->first) > 0) {
      ++label;
      continue;
    }
    remove(label->second);
    label = labels_.erase(label);
  }
}

void LandmarkIdsDisplay::update(float /*wall_dt*/, float /*ros_dt*/) {
  rviz::ViewController* view = context_->getViewManager()->getCurrent();
  Ogre::Vector3 origin;
  Ogre::Quaternion turn;
  if (labels_.empty() || view == nullptr || view->getCamera()->getViewport() == nullptr) return;
  if (!context_->getFrameManager()->getTransform(frame_, ros::Time(), origin, turn)) {
    setStatusStd(rviz::StatusProperty::Error, "Frame", "no transform from " + frame_);
    return;
  }
  setStatus(rviz::StatusProperty::Ok, "Frame", "OK");
  const Ogre::Camera* camera = view->getCamera();
  const double width = camera->getViewport()->getActualWidth();
  const double height = camera->getViewport()->getActualHeight();
  const Ogre::Matrix4 to_view = camera->getViewMatrix();
  const Ogre::Matrix4 to_screen = camera->getProjectionMatrix();
  const double zoom = std::abs(static_cast<double>(to_screen[1][1]));
  const double size = size_->getInt();

  std::vector<Label*> seen;
  std::vector<Ogre::Vector3> positions;
  std::vector<double> metres_per_pixel;
  std::vector<LabelPlace> places;
  for (auto& [id, label] : labels_) {
    const Ogre::Vector3 position =
        origin + turn * Ogre::Vector3(static_cast<Ogre::Real>(label.x),
                                      static_cast<Ogre::Real>(label.y), 0.0F);
    const Ogre::Vector4 in_view = to_view * Ogre::Vector4(position);
    const Ogre::Vector4 clip = to_screen * in_view;
    const double depth = static_cast<double>(clip.w);
    const double x = 0.5 * width * (1.0 + static_cast<double>(clip.x) / depth);
    const double y = 0.5 * height * (1.0 + static_cast<double>(clip.y) / depth);
    const bool is_seen = depth > 0.0 && x > -size && x < width && y > -size && y < height;
    label.node->setVisible(false);
    if (!is_seen) continue;
    seen.push_back(&label);
    positions.push_back(position);
    // What a metre across the line of sight is, at that depth.
    metres_per_pixel.push_back(2.0 * depth / (height * zoom));
    const double letters = static_cast<double>(label.text->getCaption().size());
    places.push_back({x + kGap, y + kGap, kDigitWidth * size * letters, size});
  }
  const std::vector<bool> readable = readable_labels(places);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!readable[i]) continue;
    Label& label = *seen[i];
    const double letter = size * metres_per_pixel[i];
    if (std::abs(letter - label.height) > kSmallestChange * letter) {
      label.height = letter;
      label.text->setCharacterHeight(static_cast<Ogre::Real>(letter));
    }
    const auto gap = static_cast<Ogre::Real>(kGap * metres_per_pixel[i]);
    label.node->setPosition(positions[i] +
                            gap * (camera->getDerivedRight() + camera->getDerivedUp()));
    label.node->setVisible(true);
  }
}

void LandmarkIdsDisplay::remove(const Label& label) {
  label.node->detachAllObjects();
  scene_manager_->destroySceneNode(label.node);
}

void LandmarkIdsDisplay::clear() {
  for (const auto& [id, label] : labels_) remove(label);
  labels_.clear();
}

}  // namespace pf_resampling

PLUGINLIB_EXPORT_CLASS(pf_resampling::LandmarkIdsDisplay, rviz::Display)
