# What every target of ours is compiled with. Warnings are errors here, and only here.
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Release, Debug, RelWithDebInfo" FORCE)
endif()

# Older compilers than those we build with warn of things that are none (g++ 9 of a null dereference in
# the standard library, for one): they shall not keep anybody from building.
set(KNOWN_COMPILER OFF)
if((CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CMAKE_CXX_COMPILER_VERSION VERSION_LESS 11) OR
   (CMAKE_CXX_COMPILER_ID STREQUAL "Clang" AND NOT CMAKE_CXX_COMPILER_VERSION VERSION_LESS 14))
  set(KNOWN_COMPILER ON)
endif()
option(PF_RESAMPLING_WARNINGS_AS_ERRORS "Warnings of our targets are errors" ${KNOWN_COMPILER})
set(PF_RESAMPLING_SANITIZE "" CACHE STRING "Sanitizers for our targets, for instance address,undefined")

# From nothing, what includes much compiles in half of the time when neighbours share a translation unit; so names in
# unnamed namespaces are of a room, not of a file. CMake has this since 3.16.
option(PF_RESAMPLING_UNITY "Compile neighbouring files of a room in one go" ON)
function(pf_resampling_unity TARGET FILES)
  set_target_properties(${TARGET} PROPERTIES UNITY_BUILD ${PF_RESAMPLING_UNITY} UNITY_BUILD_BATCH_SIZE ${FILES})
endfunction()

# pf_resampling_compiler_options(TARGET [-O1|-O2]): -O3, in a Release, is for what takes time when it runs.
function(pf_resampling_compiler_options TARGET)
  set(OPTIMIZATION -O3)
  if(ARGC GREATER 1)
    set(OPTIMIZATION ${ARGV1})
  endif()
  get_target_property(TYPE ${TARGET} TYPE)
  if(TYPE STREQUAL "SHARED_LIBRARY")
    # Programs that were built with 0.2 do not load 0.3.
    set_target_properties(${TARGET} PROPERTIES
      VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  endif()
  target_compile_features(${TARGET} PUBLIC cxx_std_17)
  set_target_properties(${TARGET} PROPERTIES CXX_EXTENSIONS OFF)
  target_compile_options(${TARGET} PRIVATE
    -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wold-style-cast -Wcast-qual
    -Wnon-virtual-dtor -Woverloaded-virtual -Wnull-dereference -Wdouble-promotion -Wformat=2)
  if(OPTIMIZATION STREQUAL "-O1")
    # With so little inlined, g++ sees pointers that are null where none can be.
    target_compile_options(${TARGET} PRIVATE -Wno-null-dereference)
  endif()
  if(PF_RESAMPLING_WARNINGS_AS_ERRORS)
    target_compile_options(${TARGET} PRIVATE -Werror)
  endif()
  if(CMAKE_BUILD_TYPE STREQUAL "Release")
    target_compile_options(${TARGET} PRIVATE ${OPTIMIZATION})
  endif()
  if(PF_RESAMPLING_SANITIZE)
    # Vector clones are chosen before a sanitizer's run-time is up: they are left out then.
    target_compile_options(${TARGET} PRIVATE
      -fsanitize=${PF_RESAMPLING_SANITIZE} -fno-omit-frame-pointer)
    target_compile_definitions(${TARGET} PRIVATE PF_RESAMPLING_NO_CLONES)
    # Not target_link_libraries, of which gtest targets have the other signature.
    set_property(TARGET ${TARGET} APPEND_STRING PROPERTY
      LINK_FLAGS " -fsanitize=${PF_RESAMPLING_SANITIZE}")
  endif()
endfunction()
