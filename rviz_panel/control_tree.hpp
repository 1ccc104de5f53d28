#pragma once

#include <QStringList>
#include <QWidget>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "rviz_panel/controls.hpp"

class QLineEdit;
class QTreeWidget;
class QTreeWidgetItem;

namespace pf_resampling {

/// All parameters of a filter in the groups that it describes, each with what it is set with.
class ControlTree : public QWidget {
 public:
  /// `set`: asked for when a value was changed by hand. `groups_changed`: groups were opened or
  /// closed.
  ControlTree(std::function<void(const dynamic_reconfigure::Config&)> set,
              std::function<void()> groups_changed, QWidget* parent);

  /// Makes the controls anew.
  void show_controls(const std::vector<ControlGroup>& groups);
  /// What holds; also ends what was changed by hand and refused.
  void show_values(const std::map<std::string, std::string>& values);

  /// The names of the groups that are open.
  QStringList open_groups() const { return open_; }
  void set_open_groups(const QStringList& names);

  /// Takes what room is left; scrolls.
  QSize sizeHint() const override { return {280, 120}; }

 protected:
  void resizeEvent(QResizeEvent* event) override;

 private:
  struct Row {
    Control control;
    QTreeWidgetItem* item;
    std::function<void(const std::string&)> show;
  };

  QWidget* make_editor(const Control& control, std::function<void(const std::string&)>* show);
  void set(const Control& control, const std::string& value);
  void filter(const QString& words);
  void take_open_groups();
  void fit_columns();

  std::function<void(const dynamic_reconfigure::Config&)> set_;
  std::function<void()> groups_changed_;
  QLineEdit* search_;
  QTreeWidget* tree_;
  std::vector<Row> rows_;
  std::vector<QTreeWidgetItem*> groups_;
  std::map<std::string, std::string> values_;
  QStringList open_;
  bool is_filling_ = false;
};

}  // namespace pf_resampling
