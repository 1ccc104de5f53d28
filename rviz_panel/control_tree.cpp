#include "rviz_panel/control_tree.hpp"

#include <QCheckBox>
#include <QHeaderView>
#include <QLineEdit>
#include <QSignalBlocker>
#include <QTreeWidget>
#include <QVBoxLayout>
#include <cstdlib>

#include "pf_resampling_core/error.hpp"
#include "rviz_panel/value_editors.hpp"
#include "src/node/reconfigure_server.hpp"

namespace pf_resampling {
namespace {

constexpr int kGroupName = Qt::UserRole;
// Widths of the columns, in pixels.
constexpr int kSmallestName = 90;
constexpr int kSmallestValue = 130;

// What is shown and what is written need not be the same digits.
bool same_value(const Control& control, const std::string& a, const std::string& b) {
  if (control.kind != Control::Kind::real) return a == b;
  return std::strtod(a.c_str(), nullptr) == std::strtod(b.c_str(), nullptr);
}

}  // namespace

ControlTree::ControlTree(std::function<void(const dynamic_reconfigure::Config&)> set,
                         std::function<void()> groups_changed, QWidget* parent)
    : QWidget(parent),
      set_(std::move(set)),
      groups_changed_(std::move(groups_changed)),
      search_(new QLineEdit(this)),
      tree_(new QTreeWidget(this)) {
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(2);
  layout->addWidget(search_);
  layout->addWidget(tree_);
  search_->setPlaceholderText("Find a parameter");
  search_->setClearButtonEnabled(true);
  tree_->setColumnCount(2);
  tree_->setHeaderHidden(true);
  tree_->setIndentation(12);
  tree_->setSelectionMode(QAbstractItemView::NoSelection);
  tree_->setFocusPolicy(Qt::NoFocus);
  tree_->setVerticalScrollMode(QAbstractItemView::ScrollPerPixel);
  tree_->header()->setStretchLastSection(true);
  tree_->header()->setMinimumSectionSize(kSmallestName);
  connect(search_, &QLineEdit::textChanged, this, [this](const QString& words) { filter(words); });
  connect(tree_, &QTreeWidget::itemExpanded, this, [this] { take_open_groups(); });
  connect(tree_, &QTreeWidget::itemCollapsed, this, [this] { take_open_groups(); });
}

void ControlTree::show_controls(const std::vector<ControlGroup>& groups) {
  is_filling_ = true;
  rows_.clear();
  groups_.clear();
  values_.clear();
  tree_->clear();
  for (const ControlGroup& group : groups) {
    QTreeWidgetItem* parent = nullptr;
    if (!group.name.empty()) {
      parent = new QTreeWidgetItem({QString::fromStdString(group.label)});
      parent->setData(0, kGroupName, QString::fromStdString(group.name));
      parent->setFirstColumnSpanned(true);
      parent->setFlags(Qt::ItemIsEnabled);
      if (group.parent < 0) {
        tree_->addTopLevelItem(parent);
      } else {
        groups_[static_cast<std::size_t>(group.parent)]->addChild(parent);
      }
      parent->setFirstColumnSpanned(true);
    }
    groups_.push_back(parent);
    for (const Control& control : group.controls) {
      auto* item = new QTreeWidgetItem({QString::fromStdString(control.label)});
      item->setFlags(Qt::ItemIsEnabled);
      const QString tooltip = QString::fromStdString(tooltip_of(control));
      item->setToolTip(0, tooltip);
      if (parent == nullptr) {
        tree_->addTopLevelItem(item);
      } else {
        parent->addChild(item);
      }
      Row row{control, item, nullptr};
      QWidget* editor = make_editor(control, &row.show);
      editor->setToolTip(tooltip);
      tree_->setItemWidget(item, 1, editor);
      rows_.push_back(row);
    }
  }
  is_filling_ = false;
  set_open_groups(open_);
  filter(search_->text());
}

// Names as wide as those that are seen need, while the values keep room.
void ControlTree::fit_columns() {
  tree_->resizeColumnToContents(0);
  const int most = std::max(kSmallestName, tree_->viewport()->width() - kSmallestValue);
  if (tree_->columnWidth(0) > most) tree_->setColumnWidth(0, most);
}

void ControlTree::resizeEvent(QResizeEvent* event) {
  QWidget::resizeEvent(event);
  fit_columns();
}

QWidget* ControlTree::make_editor(const Control& control,
                                  std::function<void(const std::string&)>* show) {
  switch (control.kind) {
    case Control::Kind::boolean: {
      auto* editor = new QCheckBox(tree_);
      *show = [editor](const std::string& value) { editor->setChecked(value == "true"); };
      connect(editor, &QCheckBox::clicked, this,
              [this, control](bool checked) { set(control, checked ? "true" : "false"); });
      return editor;
    }
    case Control::Kind::integer: {
      auto* editor = new IntegerEditor(tree_);
      editor->setRange(static_cast<int>(control.minimum), static_cast<int>(control.maximum));
      editor->setStepType(QAbstractSpinBox::AdaptiveDecimalStepType);
      editor->setKeyboardTracking(false);
      *show = [editor](const std::string& value) {
        const QSignalBlocker quiet(editor);
        editor->setValue(std::atoi(value.c_str()));
      };
      connect(editor, QOverload<int>::of(&QSpinBox::valueChanged), this,
              [this, control](int value) { set(control, std::to_string(value)); });
      return editor;
    }
    case Control::Kind::real: {
      auto* editor = new RealEditor(tree_);
      editor->setRange(control.minimum, control.maximum);
      *show = [editor](const std::string& value) {
        const QSignalBlocker quiet(editor);
        editor->setValue(std::strtod(value.c_str(), nullptr));
      };
      connect(editor, QOverload<double>::of(&QDoubleSpinBox::valueChanged), this,
              [this, control](double value) {
                set(control, QString::number(value, 'g', 12).toStdString());
              });
      return editor;
    }
    case Control::Kind::choice: {
      auto* editor = new ChoiceEditor(tree_);
      editor->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
      editor->setMinimumContentsLength(8);
      for (const Control::Choice& choice : control.choices) {
        editor->addItem(QString::fromStdString(choice.name), QString::fromStdString(choice.value));
      }
      *show = [editor](const std::string& value) {
        editor->setCurrentIndex(editor->findData(QString::fromStdString(value)));
      };
      connect(editor, QOverload<int>::of(&QComboBox::activated), this,
              [this, control, editor](int) {
                set(control, editor->currentData().toString().toStdString());
              });
      return editor;
    }
    case Control::Kind::text:
      break;
  }
  auto* editor = new QLineEdit(tree_);
  *show = [editor](const std::string& value) { editor->setText(QString::fromStdString(value)); };
  connect(editor, &QLineEdit::editingFinished, this, [this, control, editor] {
    const auto value = editor->text().toStdString();
    if (value != values_[control.name]) set(control, value);
  });
  return editor;
}

void ControlTree::set(const Control& control, const std::string& value) {
  try {
    set_(request_of(control, value));
  } catch (const Error&) {
    show_values(std::map<std::string, std::string>(values_));
  }
}

void ControlTree::show_values(const std::map<std::string, std::string>& values) {
  values_ = values;
  for (const Row& row : rows_) {
    const auto value = values.find(row.control.name);
    if (value == values.end()) continue;
    // What is being typed is not typed over.
    QWidget* editor = tree_->itemWidget(row.item, 1);
    const auto* line = qobject_cast<QLineEdit*>(editor);
    if (line == nullptr) line = editor->findChild<QLineEdit*>();
    if (line == nullptr || !line->hasFocus() || !line->isModified()) row.show(value->second);
    QFont font = tree_->font();
    font.setBold(!same_value(row.control, value->second, row.control.initial));
    row.item->setFont(0, font);
  }
}

void ControlTree::set_open_groups(const QStringList& names) {
  open_ = names;
  is_filling_ = true;
  for (QTreeWidgetItem* group : groups_) {
    if (group != nullptr) group->setExpanded(names.contains(group->data(0, kGroupName).toString()));
  }
  is_filling_ = false;
  fit_columns();
}

void ControlTree::take_open_groups() {
  if (!is_filling_) fit_columns();
  if (is_filling_ || !search_->text().isEmpty()) return;
  QStringList open;
  for (const QTreeWidgetItem* group : groups_) {
    if (group != nullptr && group->isExpanded()) open << group->data(0, kGroupName).toString();
  }
  if (open == open_) return;
  open_ = open;
  groups_changed_();
}

void ControlTree::filter(const QString& words) {
  const QString wanted = words.trimmed();
  for (QTreeWidgetItem* group : groups_) {
    if (group != nullptr) group->setHidden(!wanted.isEmpty());
  }
  is_filling_ = true;
  for (const Row& row : rows_) {
    const QString text =
        QString::fromStdString(row.control.name + " " + row.control.label + " " + row.control.help);
    const bool is_wanted = text.contains(wanted, Qt::CaseInsensitive);
    row.item->setHidden(!is_wanted);
    for (QTreeWidgetItem* group = row.item->parent(); is_wanted && group != nullptr;
         group = group->parent()) {
      group->setHidden(false);
      if (!wanted.isEmpty()) group->setExpanded(true);
    }
  }
  is_filling_ = false;
  if (wanted.isEmpty()) set_open_groups(open_);
  fit_columns();
}

}  // namespace pf_resampling
