#pragma once

#include <ros/time.h>
#include <rviz/panel.h>

#include <Eigen/Geometry>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "rviz_panel/basic_table.hpp"
#include "rviz_panel/filter_connection.hpp"
#include "rviz_panel/filter_health.hpp"
#include "rviz_panel/strip_widget.hpp"

class QLabel;
class QLineEdit;
class QPushButton;
class QVBoxLayout;

namespace pf_resampling {

/// The rviz panel "pf_resampling/Filter Panel": how a filter of this package is, and what it can be
/// set to.
class FilterPanel : public rviz::Panel {
 public:
  explicit FilterPanel(QWidget* parent = nullptr);

  void onInitialize() override;
  void load(const rviz::Config& config) override;
  void save(rviz::Config config) const override;

 private:
  void add_health(QVBoxLayout* layout);
  void add_buttons(QVBoxLayout* layout);

  void connect_to_filter();
  void take_name();
  void refresh();
  void show_offer(const FilterNews& news);
  void show_health();
  void show_verdict(const FilterNews& news);
  void show_rejects();
  void show_threshold();
  /// The view from above shows the whole scene until somebody moves it.
  void fit_view();
  void show_result(bool success, const QString& text);
  void ask_reset();
  void ask_save_map();
  void ask_load_map();
  /// Asks for the name of a file of the node's, and hands it to `take`.
  void ask_file(const QString& title, const std::function<void(const std::string&)>& take);

  std::string filter_ = "beacon_mcl";  // its node
  std::unique_ptr<FilterConnection> connection_;
  FilterHealth health_;
  std::map<std::string, std::string> values_;
  ros::WallTime last_status_;
  bool was_calling_ = false;
  bool fits_view_ = false;
  Eigen::AlignedBox2d scene_;           // what landmarks, beacons and the robot have spanned, m
  std::optional<Eigen::Array3d> view_;  // x and y, m, and pixels per metre, as they were set last

  QLineEdit* node_ = nullptr;
  QLabel *strategy_ = nullptr, *verdict_ = nullptr, *findings_ = nullptr, *counts_ = nullptr,
         *refused_ = nullptr, *rejects_ = nullptr, *result_ = nullptr;
  StripWidget* sample_size_strip_ = nullptr;
  QPushButton *global_localization_button_ = nullptr, *reset_button_ = nullptr,
              *save_map_button_ = nullptr, *load_map_button_ = nullptr;
  BasicTable* parameters_ = nullptr;
};

}  // namespace pf_resampling
