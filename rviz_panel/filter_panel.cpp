#include "rviz_panel/filter_panel.hpp"

#include <OgreCamera.h>
#include <OgreViewport.h>
#include <rviz/properties/property.h>
#include <rviz/view_controller.h>
#include <rviz/view_manager.h>
#include <rviz/visualization_manager.h>
#include <pluginlib/class_list_macros.hpp>

#include <QGridLayout>
#include <QInputDialog>
#include <QLabel>
#include <QLineEdit>
#include <QMessageBox>
#include <QPushButton>
#include <QScrollArea>
#include <QSignalBlocker>
#include <QTimer>
#include <QVBoxLayout>
#include <cstdlib>

#include "src/messages/conversions.hpp"
#include "src/node/reconfigure_server.hpp"

namespace pf_resampling {
namespace {

constexpr int kRefreshPeriod = 100;     // ms
constexpr double kSilence = 3.0;        // s of wall time without a status that are mentioned
constexpr int kMostRejects = 3;         // lines of them; the tool tip has all
constexpr double kSmallestScene = 4.0;  // m
// Parts of the window that the scene fills: in a new view, and in one that is too wide after a
// reset.
constexpr double kFill = 0.7;
constexpr double kPoorFill = 0.3;

QString to_qt(const std::string& text) {
  return QString::fromStdString(text);
}

QLabel* add_label(QVBoxLayout* layout) {
  auto* label = new QLabel;
  label->setWordWrap(true);
  label->setTextFormat(Qt::PlainText);
  label->setTextInteractionFlags(Qt::TextSelectableByMouse);
  label->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Minimum);
  layout->addWidget(label);
  return label;
}

// White on the colour of the level.
QString style_of(FilterHealth::Level level) {
  const char* colour = "#707070";
  if (level == FilterHealth::Level::good) colour = "#2a7d2e";
  if (level == FilterHealth::Level::warning) colour = "#b35900";
  if (level == FilterHealth::Level::bad) colour = "#b3221c";
  return QString("background: %1; color: white; padding: 3px; font-weight: bold;").arg(colour);
}

void extend(const visualization_msgs::MarkerArray& markers, Eigen::AlignedBox2d* scene) {
  for (const visualization_msgs::Marker& marker : markers.markers) {
    if (marker.ns != "landmarks" && marker.ns != "beacons" && marker.ns != "pose_heading") continue;
    if (marker.action == visualization_msgs::Marker::DELETE) {  // after a reset
      scene->setEmpty();
    } else if (marker.points.empty()) {
      scene->extend(Eigen::Vector2d(marker.pose.position.x, marker.pose.position.y));
    }
    for (const auto& point : marker.points) scene->extend(Eigen::Vector2d(point.x, point.y));
  }
}

}  // namespace

FilterPanel::FilterPanel(QWidget* parent) : rviz::Panel(parent) {
  auto* outer = new QVBoxLayout(this);
  outer->setContentsMargins(0, 0, 0, 0);
  auto* scroll = new QScrollArea;
  scroll->setWidgetResizable(true);
  scroll->setFrameShape(QFrame::NoFrame);
  scroll->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  outer->addWidget(scroll);
  auto* content = new QWidget;
  scroll->setWidget(content);
  auto* layout = new QVBoxLayout(content);
  layout->setContentsMargins(6, 4, 6, 4);
  layout->setSpacing(4);
  node_ = new QLineEdit;
  node_->setToolTip("The node of the filter");
  layout->addWidget(node_);
  connect(node_, &QLineEdit::editingFinished, this, [this] { take_name(); });
  add_health(layout);
  add_buttons(layout);
  parameters_ = new BasicTable([this](const auto& values) { connection_->set(values); }, content);
  layout->addWidget(parameters_, 1);
  setMinimumWidth(240);
}

void FilterPanel::add_health(QVBoxLayout* layout) {
  verdict_ = add_label(layout);
  findings_ = add_label(layout);
  findings_->setStyleSheet("color: #b35900;");
  strategy_ = add_label(layout);
  counts_ = add_label(layout);
  sample_size_strip_ = new StripWidget(
      "Effective particles (N_eff)",
      "N_eff before each renewal, as a share of the particles.\n"
      "Dashed: below this line the population is renewed (grey: the schedule does not use it).\n"
      "Ticks: renewals.",
      this);
  layout->addWidget(sample_size_strip_);
  refused_ = add_label(layout);
  refused_->setStyleSheet("color: #b3221c;");
  rejects_ = add_label(layout);
}

void FilterPanel::add_buttons(QVBoxLayout* layout) {
  auto* grid = new QGridLayout;
  grid->setSpacing(4);
  const auto add = [&](const char* text, int row, int column) {
    auto* button = new QPushButton(text);
    grid->addWidget(button, row, column);
    return button;
  };
  global_localization_button_ = add("Global localization", 0, 0);
  reset_button_ = add("Reset", 0, 1);
  load_map_button_ = add("Load map…", 1, 0);
  save_map_button_ = add("Save map…", 1, 1);
  layout->addLayout(grid);
  result_ = add_label(layout);
  connect(global_localization_button_, &QPushButton::clicked, this,
          [this] { connection_->call("global_localization", "Searching everywhere"); });
  connect(reset_button_, &QPushButton::clicked, this, [this] { ask_reset(); });
  connect(save_map_button_, &QPushButton::clicked, this, [this] { ask_save_map(); });
  connect(load_map_button_, &QPushButton::clicked, this, [this] { ask_load_map(); });
}

void FilterPanel::onInitialize() {
  connect_to_filter();
  auto* timer = new QTimer(this);
  connect(timer, &QTimer::timeout, this, [this] { refresh(); });
  timer->start(kRefreshPeriod);
}

void FilterPanel::load(const rviz::Config& config) {
  rviz::Panel::load(config);
  QString node;
  if (config.mapGetString("Node", &node)) filter_ = node.toStdString();
  config.mapGetBool("Fit View", &fits_view_);
  if (connection_) connect_to_filter();
}

void FilterPanel::save(rviz::Config config) const {
  rviz::Panel::save(config);
  config.mapSetValue("Node", to_qt(filter_));
  config.mapSetValue("Fit View", fits_view_);
}

void FilterPanel::take_name() {
  const std::string name = node_->text().trimmed().toStdString();
  if (name == filter_) return;
  filter_ = name;
  connect_to_filter();
  Q_EMIT configChanged();
}

void FilterPanel::connect_to_filter() {
  node_->setText(to_qt(filter_));
  values_.clear();
  parameters_->show_controls({});
  health_.clear();
  last_status_ = ros::WallTime();
  scene_.setEmpty();
  show_result(true, "");
  connection_ = std::make_unique<FilterConnection>(filter_);
  show_offer({});
  show_health();
}

// ---- what is shown ----------------------------------------------------------------------------

void FilterPanel::refresh() {
  const FilterNews news = connection_->take_news();
  show_offer(news);
  if (news.description) {
    values_.clear();
    parameters_->show_controls(basic_controls(*news.description));
  }
  if (news.values) {
    values_ = values_of(*news.values);
    parameters_->show_values(values_);
    show_threshold();
  }
  for (const FilterStatus& status : news.statuses) health_.add(status);
  if (!news.statuses.empty()) {
    last_status_ = ros::WallTime::now();
    show_health();
  }
  show_verdict(news);
  for (const auto& markers : news.markers) extend(markers, &scene_);
  fit_view();
  for (const CallResult& result : news.results) show_result(result.success, to_qt(result.text));
  if (news.is_calling) show_result(true, "Waiting for the node …");
  if (was_calling_ && !news.is_calling && news.results.empty()) show_result(true, "");
  was_calling_ = news.is_calling;
}

void FilterPanel::show_offer(const FilterNews& news) {
  const auto enable = [&](QPushButton* button, const char* service, const char* help) {
    const bool exists = news.services.count(service) > 0;
    button->setEnabled(exists);
    button->setToolTip(exists ? help : "The filter does not offer this");
  };
  enable(global_localization_button_, "global_localization",
         "Forget the pose and search the whole map");
  enable(reset_button_, "reset", "Reset the filter");
  enable(save_map_button_, "save_map", "Write the map to a file");
  enable(load_map_button_, "load_map", "Replace the map by that of a file");
  parameters_->setEnabled(news.node);
}

void FilterPanel::show_health() {
  sample_size_strip_->show_values(health_.sample_sizes(), to_qt(health_.sample_size_text()));
  show_threshold();
  show_rejects();
  counts_->setText(to_qt(health_.counts_text()));
  findings_->setText(to_qt(health_.findings_text()));
  findings_->setVisible(!findings_->text().isEmpty());
  const auto& status = health_.latest();
  strategy_->setText(status ? to_qt(status->strategy) : "");
  refused_->setText(status && !status->refused.empty() ? "Refused: " + to_qt(status->refused) : "");
  refused_->setVisible(!refused_->text().isEmpty());
}

void FilterPanel::show_verdict(const FilterNews& news) {
  FilterHealth::Verdict verdict = health_.verdict();
  const double silence =
      last_status_.isZero() ? 0.0 : (ros::WallTime::now() - last_status_).toSec();
  if (!news.master) {
    verdict = {FilterHealth::Level::unknown, "No ROS master"};
  } else if (!news.node) {
    verdict = {FilterHealth::Level::unknown, "No node " + filter_};
  } else if (silence > kSilence) {
    verdict = {FilterHealth::Level::unknown,
               "No status for " + std::to_string(static_cast<int>(silence)) + " s"};
  }
  verdict_->setText(to_qt(verdict.text));
  verdict_->setStyleSheet(style_of(verdict.level));
}

// Drawn in while the parameters have it, as the nodes of this package call it.
void FilterPanel::show_threshold() {
  const auto threshold = values_.find("population/threshold");
  const auto schedule = values_.find("population/schedule");
  if (threshold == values_.end()) return sample_size_strip_->show_threshold(std::nullopt, false);
  sample_size_strip_->show_threshold(
      std::strtod(threshold->second.c_str(), nullptr),
      schedule == values_.end() || schedule->second == "effective_sample_size");
}

void FilterPanel::show_rejects() {
  QStringList lines;
  for (const std::string& line : health_.rejects()) lines << to_qt(line);
  rejects_->setToolTip(lines.join('\n'));
  rejects_->setText(lines.isEmpty() ? "Nothing rejected"
                                    : "Rejected\n" + lines.mid(0, kMostRejects).join('\n'));
}

void FilterPanel::show_result(bool success, const QString& text) {
  result_->setText(text);
  result_->setVisible(!text.isEmpty());
  result_->setStyleSheet(success ? "" : "color: #b3221c;");
}

void FilterPanel::fit_view() {
  rviz::ViewManager* views = vis_manager_->getViewManager();
  rviz::ViewController* view = views->getCurrent();
  if (!fits_view_ || scene_.isEmpty() || view->getClassId() != "rviz/TopDownOrtho") return;
  const auto number_of = [&](const char* name) {
    return view->subProp(name)->getValue().toDouble();
  };
  const auto present = [&] {
    return Eigen::Array3d(number_of("X"), number_of("Y"), number_of("Scale"));
  };
  fits_view_ = number_of("Angle") == 0.0 && (!view_ || (present() == *view_).all());
  if (!fits_view_) return;
  const Ogre::Viewport* window = view->getCamera()->getViewport();
  const Eigen::Vector2d pixels(window->getActualWidth(), window->getActualHeight());
  const Eigen::Vector2d sizes = scene_.sizes().cwiseMax(kSmallestScene);
  if (view_) {
    const Eigen::Vector2d middle = view_->head<2>(), half = pixels / (2.0 * view_->z());
    const bool is_filled = sizes.cwiseQuotient(2.0 * half).maxCoeff() > kPoorFill;
    if (is_filled && Eigen::AlignedBox2d(middle - half, middle + half).contains(scene_)) return;
  }
  // Nothing that rviz should ask about saving when it is closed.
  const QSignalBlocker quiet(views);
  view->subProp("X")->setValue(static_cast<float>(scene_.center().x()));
  view->subProp("Y")->setValue(static_cast<float>(scene_.center().y()));
  view->subProp("Scale")->setValue(
      static_cast<float>(kFill * pixels.cwiseQuotient(sizes).minCoeff()));
  view_ = present();
}

// ---- buttons ----------------------------------------------------------------------------------

void FilterPanel::ask_reset() {
  auto* box = new QMessageBox(QMessageBox::Question, "Reset",
                              "Reset the filter? Pose and map will be lost.",
                              QMessageBox::Ok | QMessageBox::Cancel, this);
  box->setAttribute(Qt::WA_DeleteOnClose);
  connect(box, &QMessageBox::accepted, this,
          [this] { connection_->call("reset", "Started from nothing"); });
  box->open();
}

void FilterPanel::ask_save_map() {
  ask_file("Save the map", [this](const std::string& file) { connection_->save_map(file); });
}

void FilterPanel::ask_load_map() {
  ask_file("Load a map", [this](const std::string& file) {
    auto* box = new QMessageBox(QMessageBox::Question, "Load a map",
                                "Freeze this map and only localize in it, or continue mapping?",
                                QMessageBox::Cancel, this);
    box->setAttribute(Qt::WA_DeleteOnClose);
    auto* keep = box->addButton("Only localize", QMessageBox::AcceptRole);
    auto* map_on = box->addButton("Map on", QMessageBox::AcceptRole);
    connect(keep, &QPushButton::clicked, this, [this, file] { connection_->load_map(file, true); });
    connect(map_on, &QPushButton::clicked, this,
            [this, file] { connection_->load_map(file, false); });
    box->open();
  });
}

void FilterPanel::ask_file(const QString& title,
                           const std::function<void(const std::string&)>& take) {
  // The node decides about the folder, and may be on another machine.
  auto* dialog = new QInputDialog(this);
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setWindowTitle(title);
  dialog->setLabelText("Name of the file, in the node's folder map_file/directory:");
  dialog->setTextValue("my.map");
  connect(dialog, &QInputDialog::textValueSelected, this,
          [take](const QString& file) { take(file.toStdString()); });
  dialog->open();
}

}  // namespace pf_resampling

PLUGINLIB_EXPORT_CLASS(pf_resampling::FilterPanel, rviz::Panel)
