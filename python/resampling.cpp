// Schemes, compensation and excitation as functions of arrays.
#include <ctime>

#include "python/bindings.hpp"

namespace pf_resampling {
namespace {

struct Resampled {
  Eigen::ArrayXi ancestors;
  Eigen::ArrayXi counts;
  Eigen::ArrayXd log_weights;
};

}  // namespace

void add_resampling(py::module* module) {
  py::class_<RandomStream>(*module, "RandomStream",
                           "Random numbers that depend on seed and step alone. Each has an index "
                           "and can be drawn in any order.")
      .def(py::init([](std::uint64_t seed, std::uint32_t step) {
             return RandomStream(seed, RandomPurpose::resampling, step);
           }),
           "seed"_a, "step"_a = 0)
      .def(
          "uniform",
          [](const RandomStream& self, std::uint32_t count, std::uint64_t first) {
            Eigen::ArrayXd numbers(count);
            self.fill_uniform(first, count, numbers.data());
            return numbers;
          },
          "count"_a, "first"_a = 0, "Uniform in (0, 1).")
      .def(
          "normal",
          [](const RandomStream& self, std::uint32_t count, std::uint64_t first) {
            Eigen::ArrayXd numbers(count);
            self.fill_normal(first, count, numbers.data());
            return numbers;
          },
          "count"_a, "first"_a = 0, "Standard normal.");

  py::class_<Resampled>(*module, "Resampled", "What a resampling has drawn.")
      .def_readonly("ancestors", &Resampled::ancestors,
                    "Of each slot, the particle that it copies; survivors keep their own slots.")
      .def_readonly("counts", &Resampled::counts, "Of each particle, how often it was taken.")
      .def_readonly("log_weights", &Resampled::log_weights, "Of each slot, normalised.");
  py::class_<Resampler>(
      *module, "Resampler",
      "A resampling scheme. Keywords are the parameters below population/resampling/: "
      "Resampler(scheme='partial', partial_high=2.0). Or with a scheme in Python, a function "
      "(weights, size, stream) that returns how often each particle is taken: "
      "Resampler(own_scheme=function).")
      .def(py::init([](const py::object& own_scheme, const py::kwargs& given) {
             auto options = options_from<ResamplingOptions>(given, "population/resampling/");
             if (!own_scheme.is_none()) options.own_scheme = scheme_of(own_scheme);
             return Resampler(options);
           }),
           "own_scheme"_a = py::none())
      .def(
          "resample",
          [](Resampler& self, ConstArray weights, const RandomStream& stream,
             std::optional<int> size) {
            const ResamplingResult drawn =
                self.resample(weights, size.value_or(static_cast<int>(weights.size())), stream);
            return Resampled{drawn.ancestors, drawn.counts, drawn.log_weights};
          },
          "weights"_a, "stream"_a, "size"_a = py::none(),
          "Draws `size` ancestors, as many as there are weights unless it is given. The weights "
          "need not add up to 1.");
  module->def(
      "resampling_seconds",
      [](const std::string& scheme, ConstArray weights, std::uint32_t repetitions,
         std::uint32_t first) {
        ResamplingOptions options;
        options.scheme = from_string<ResamplingScheme>(scheme);
        Resampler resampler(options);
        const std::clock_t begin = std::clock();
        for (std::uint32_t i = 0; i < repetitions; ++i) {
          resampler.resample(weights, static_cast<int>(weights.size()),
                             RandomStream(1, RandomPurpose::resampling, first + i));
        }
        return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC / repetitions;
      },
      "scheme"_a, "weights"_a, "repetitions"_a, "first"_a = 0,
      "Processor time of one resampling, without what a call from Python takes.");
  module->def(
      "resampling_schemes",
      [] {
        std::vector<std::string> names;
        for (const auto scheme : all_values<ResamplingScheme>()) names.push_back(to_string(scheme));
        return names;
      },
      "The names of all schemes.");
  module->def(
      "normalize",
      [](InPlace log_weights) {
        Eigen::ArrayXd weights(log_weights.size());
        normalize(log_weights, weights);
        return weights;
      },
      "log_weights"_a, "Normalises the log-weights in place and returns the linear weights.");
  module->def(
      "effective_sample_size", [](ConstArray weights) { return effective_sample_size(weights); },
      "weights"_a, "Of normalised linear weights: 1 / sum of squares.");

  py::class_<CompensationResult>(*module, "Compensation", "Which particles are to be blended.")
      .def_readonly("log_weights", &CompensationResult::log_weights, "Afterwards, normalised.")
      .def_property_readonly(
          "pairs",
          [](const CompensationResult& self) {
            return rows_of<3>(self.pairs.size(), [&](std::size_t k) {
              const BlendPair& pair = self.pairs[k];
              return Eigen::Array3d(pair.low, pair.high, pair.share);
            });
          },
          "A row for each weak particle: it, its strong one, and its own share of the blend.")
      .def(
          "blend_poses",
          [](const CompensationResult& self, InPlace x, InPlace y, InPlace heading) {
            check_sizes("poses", self.log_weights.size(), {x.size(), y.size(), heading.size()});
            blend_poses(self.pairs, x, y, heading);
          },
          "x"_a, "y"_a, "heading"_a, "Blends poses in place.");
  module->def(
      "compensate",
      [](ConstArray weights, const RandomStream& stream, const py::kwargs& given) {
        return compensate(options_from<CompensationOptions>(given, "population/compensation/"),
                          weights, stream);
      },
      "weights"_a, "stream"_a,
      "Compensation in place of resampling. Keywords are the parameters below "
      "population/compensation/.");
  module->def(
      "excite",
      [](ConstArray weights, const RandomStream& stream, InPlace x, InPlace y, InPlace heading,
         const py::kwargs& given) {
        check_sizes("weights and poses", weights.size(), {x.size(), y.size(), heading.size()});
        ExcitationWorkspace workspace;
        excite(options_from<ExcitationOptions>(given, "excitation/"), weights, stream,
               {x, y, heading}, &workspace);
      },
      "weights"_a, "stream"_a, "x"_a, "y"_a, "heading"_a,
      "Adds noise to the poses, in place. Keywords are the parameters below excitation/.");
}

}  // namespace pf_resampling
