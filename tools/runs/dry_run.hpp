#pragma once

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "pf_resampling_core/error.hpp"
#include "tools/common/bag.hpp"
#include "tools/common/command_line.hpp"
#include "tools/runs/bag_inputs.hpp"

namespace pf_resampling {

/// Runs a filter over a bag, with few particles: what it takes does not depend on them. Prints how
/// many messages it used, why none, its warnings and what it rejected, and what it observed, which
/// the sinks note, as JSON for check_bag.
template <typename Pipeline, typename Options>
int dry_run(const CommandLine& line, Options options, typename Pipeline::Sinks sinks,
            const nlohmann::json& observed) {
  options.filter.particles = std::min(options.filter.particles, 100);
  options.filter.strategy.renewal = Renewal::resampling;
  std::vector<std::string> remarks;
  sinks.log = [&](LogLevel level, const std::string& text) {
    // What was rejected is counted; that a few particles get lost says nothing of the bag.
    const bool is_known =
        text.find(": rejected, ") != std::string::npos || text.rfind("lost", 0) == 0;
    if (level == LogLevel::warning && !is_known) remarks.push_back(text);
  };
  const rosbag::Bag bag = open_bag(line.text("in.bag"));
  nlohmann::json said = {{"used", 0}};
  std::optional<Pipeline> pipeline;
  try {
    pipeline.emplace(options, sinks);
  } catch (const Error& error) {
    said["why_none"] = error.what();
  }
  if (pipeline) {
    const auto inputs = bag_inputs(line, options.frames.base, &*pipeline);
    for_each_in_order({&bag}, bag.getFileName(), names_of(inputs),
                      [&](const auto& instance) { hand_over(instance, inputs, &*pipeline); });
    for (const std::string& text : lines_of(pipeline->rejects())) remarks.push_back(text);
    said = {{"used", pipeline->used()}, {"why_none", pipeline->why_none_used()}};
  }
  said["remarks"] = remarks;
  said["observed"] = observed;
  std::cout << said.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
  return 0;
}

}  // namespace pf_resampling
