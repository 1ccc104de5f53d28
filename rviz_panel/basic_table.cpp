#include "rviz_panel/basic_table.hpp"

#include <QComboBox>
#include <QHeaderView>
#include <QSignalBlocker>
#include <QWheelEvent>

namespace pf_resampling {
namespace {

// The wheel scrolls the panel and changes no value that it passes over.
class ChoiceEditor : public QComboBox {
  void wheelEvent(QWheelEvent* event) override { event->ignore(); }
};

}  // namespace

BasicTable::BasicTable(std::function<void(const dynamic_reconfigure::Config&)> set, QWidget* parent)
    : QTableWidget(0, 2, parent), set_(std::move(set)) {
  horizontalHeader()->hide();
  // Where both do not fit, the name is cut, not the value.
  horizontalHeader()->setSectionResizeMode(0, QHeaderView::Stretch);
  horizontalHeader()->setSectionResizeMode(1, QHeaderView::Fixed);
  horizontalHeader()->resizeSection(1, 110);
  setWordWrap(false);
  setTextElideMode(Qt::ElideMiddle);
  verticalHeader()->hide();
  setSelectionMode(QAbstractItemView::NoSelection);
  setSizeAdjustPolicy(QAbstractScrollArea::AdjustToContents);
  connect(this, &QTableWidget::cellChanged, this,
          [this](int row, int column) { this->set(row, item(row, column)->text()); });
}

void BasicTable::show_controls(const std::vector<Control>& controls) {
  const QSignalBlocker quiet(this);
  controls_ = controls;
  setRowCount(0);  // with the editors that are there
  setRowCount(static_cast<int>(controls.size()));
  for (int row = 0; row < rowCount(); ++row) {
    const Control& control = controls[static_cast<std::size_t>(row)];
    auto* name = new QTableWidgetItem(QString::fromStdString(control.name));
    name->setFlags(Qt::ItemIsEnabled);
    auto* value = new QTableWidgetItem;
    for (auto* cell : {name, value}) cell->setToolTip(QString::fromStdString(control.help));
    setItem(row, 0, name);
    setItem(row, 1, value);
    if (control.choices.empty()) continue;
    auto* editor = new ChoiceEditor;
    for (const std::string& choice : control.choices) {
      editor->addItem(QString::fromStdString(choice));
    }
    setCellWidget(row, 1, editor);
    connect(editor, &QComboBox::textActivated, this,
            [this, row](const QString& choice) { set(row, choice); });
  }
}

void BasicTable::show_values(const std::map<std::string, std::string>& values) {
  const QSignalBlocker quiet(this);
  for (int row = 0; row < rowCount(); ++row) {
    const auto value = values.find(controls_[static_cast<std::size_t>(row)].name);
    if (value == values.end()) continue;
    QString text = QString::fromStdString(value->second);
    bool is_number = false;  // 0.050000000000000003 is shown as 0.05
    const double number = text.toDouble(&is_number);
    if (is_number && text.contains('.')) text = QString::number(number, 'g', 6);
    if (auto* editor = qobject_cast<QComboBox*>(cellWidget(row, 1))) {
      editor->setCurrentText(text);
    } else {
      item(row, 1)->setText(text);
    }
  }
}

void BasicTable::set(int row, const QString& value) {
  set_(request_of(controls_[static_cast<std::size_t>(row)].name, value.toStdString()));
}

}  // namespace pf_resampling
