// The library as a Python module. Errors of the library are pf_resampling_core.Error, a ValueError.
#include "python/bindings.hpp"

namespace pf_resampling {

PYBIND11_MODULE(pf_resampling_core, module) {
  module.doc() =
      "Particle filters for localization and SLAM, with every resampling scheme. Metres, radians, "
      "seconds.";
  py::register_exception<Error>(module, "Error", PyExc_ValueError);
  add_resampling(&module);
  add_simulation(&module);
  add_filters(&module);
}

}  // namespace pf_resampling
