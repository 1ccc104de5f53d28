# For find_package(pf_resampling_core): the target pf_resampling_core::pf_resampling_core.
include(CMakeFindDependencyMacro)
find_dependency(Eigen3 3.3)
find_dependency(Threads)
include(${CMAKE_CURRENT_LIST_DIR}/pf_resampling_core-targets.cmake)
