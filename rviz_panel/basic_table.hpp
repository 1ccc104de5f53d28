#pragma once

#include <dynamic_reconfigure/Config.h>

#include <QTableWidget>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "rviz_panel/controls.hpp"

namespace pf_resampling {

/// The basic parameters of a filter and their values, a row each. What is changed is sent; of a
/// value that it refuses, the node says what holds in its place.
class BasicTable : public QTableWidget {
 public:
  BasicTable(std::function<void(const dynamic_reconfigure::Config&)> set, QWidget* parent);

  void show_controls(const std::vector<Control>& controls);
  void show_values(const std::map<std::string, std::string>& values);

 private:
  void set(int row, const QString& value);

  std::function<void(const dynamic_reconfigure::Config&)> set_;
  std::vector<Control> controls_;
};

}  // namespace pf_resampling
