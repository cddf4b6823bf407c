# One INTERFACE target carries the language standard, the warnings and the floating-point rules for every target of the project.
#
# Same input, same bytes, on every device and at every optimisation level: no contraction of a*b+c (a host compiler may fuse it
# or not, nvcc fuses by default), no fast-math anywhere. CMake 3.25 knows no CUDA20 dialect, so the standard is passed by hand.
add_library(cordillera_flags INTERFACE)
target_compile_features(cordillera_flags INTERFACE cxx_std_20)
set_property(GLOBAL PROPERTY CXX_STANDARD_REQUIRED ON)
target_compile_options(cordillera_flags INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-ffp-contract=off -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion -Wno-array-bounds $<$<BOOL:${CORDILLERA_WERROR}>:-Werror>>
  $<$<COMPILE_LANGUAGE:CUDA>:-std=c++20 -fmad=false --expt-relaxed-constexpr -Xcompiler=-ffp-contract=off,-Wall,-Wextra>)
target_include_directories(cordillera_flags INTERFACE ${CMAKE_SOURCE_DIR})
if(CORDILLERA_SANITIZE)
  target_compile_options(cordillera_flags INTERFACE
    $<$<COMPILE_LANGUAGE:CXX>:-fsanitize=${CORDILLERA_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all -D_GLIBCXX_ASSERTIONS
      $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized;-Wno-tsan>>)  # g++ 12 says these of its own <regex> and of fences in Asio once a sanitizer is on
  target_link_options(cordillera_flags INTERFACE -fsanitize=${CORDILLERA_SANITIZE})
endif()

# Most sources are compiled in batches, with headers that are parsed once. OFF compiles each for itself: then a file that does not include what it uses is an
# error. Fuzzers are few and always apart.
option(CORDILLERA_BATCHES "Compile sources in batches, with precompiled headers" ON)
if(CORDILLERA_FUZZ)
  set(CORDILLERA_BATCHES OFF)
endif()

# So many sources after another are a batch; the first ones are batch 0.
function(cordillera_batches size)
  set(at 0)
  foreach(source IN LISTS ARGN)
    math(EXPR batch "${at} / ${size}")
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${batch})
    math(EXPR at "${at} + 1")
  endforeach()
endfunction()

# cordillera_unity(target [BATCH count] [SPREAD source...] [ALONE source...]): sources of a target are compiled twelve, or count, as one, so that their
# headers are parsed once for all of them. SPREAD are sources of one kind, whose anonymous namespaces hold the same names: there
# is one of them in a batch at most. ALONE are compiled each for itself.
function(cordillera_unity target)
  if(NOT CORDILLERA_BATCHES)
    return()
  endif()
  cmake_parse_arguments(U "" "BATCH" "SPREAD;ALONE" ${ARGN})
  if(NOT U_BATCH)
    set(U_BATCH 12)
  endif()
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources INCLUDE REGEX "\\.cpp$")
  foreach(source IN LISTS U_SPREAD U_ALONE)
    list(REMOVE_ITEM sources ${source})
  endforeach()
  if(U_ALONE)
    set_source_files_properties(${U_ALONE} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)  # in other targets of the folder, too
  endif()
  cordillera_batches(${U_BATCH} ${sources})
  cordillera_batches(1 ${U_SPREAD})
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP UNITY_BUILD_UNIQUE_ID CORDILLERA_FILE)
endfunction()

# cordillera_kernels(target source...): CUDA sources, where CUDA is built. Half of the time of each is CUB's headers, once for the host and once for
# every kind of GPU: those of a target are compiled as one, as CMake does from 3.31 on.
function(cordillera_kernels target)
  if(NOT CORDILLERA_HAS_CUDA)
    return()
  endif()
  set(kernels ${ARGN})
  if(CORDILLERA_BATCHES)
    file(RELATIVE_PATH folder ${CMAKE_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
    list(TRANSFORM kernels PREPEND "#include \"${folder}/" OUTPUT_VARIABLE lines)
    list(TRANSFORM lines APPEND "\"\n")
    string(JOIN "" lines ${lines})
    set(kernels ${CMAKE_CURRENT_BINARY_DIR}/kernels.cu)
    file(CONFIGURE OUTPUT ${kernels} CONTENT "${lines}" @ONLY)
  endif()
  target_sources(${target} PRIVATE ${kernels})
  target_compile_definitions(${target} PRIVATE CORDILLERA_HAS_CUDA=1)
  set_target_properties(${target} PROPERTIES CUDA_RUNTIME_LIBRARY Static CUDA_SEPARABLE_COMPILATION OFF)
endfunction()

# cordillera_precompile(target header...): headers that nearly every file of a target reads are parsed once. A fifth of the time of a first
# build.
function(cordillera_precompile target)
  if(CORDILLERA_BATCHES)
    target_precompile_headers(${target} PRIVATE <algorithm> <cmath> <filesystem> <functional> <map> <memory> <string> <vector> ${ARGN})
  endif()
endfunction()

# cordillera_precompile_test(target optimisation library...): gtest, gmock and what nearly every test of these libraries reads, parsed once for all test
# programs of the same kind. A third to a half of the time of a small one. All of a kind have one optimisation.
function(cordillera_precompile_test target optimisation)
  if(NOT CORDILLERA_BATCHES)
    return()
  endif()
  set(kind plain)
  set(headers <algorithm> <cmath> <filesystem> <functional> <map> <memory> <string> <vector> <gmock/gmock.h> <gtest/gtest.h>)
  if(cordillera_server IN_LIST ARGN)
    set(kind server)
    list(APPEND headers ${CMAKE_SOURCE_DIR}/server/api/api.h ${CMAKE_SOURCE_DIR}/server/http/json.h)
  elseif(cordillera_pipeline IN_LIST ARGN)
    set(kind pipeline)
    list(APPEND headers <nlohmann/json.hpp> ${CMAKE_SOURCE_DIR}/pipeline/store/store.h ${CMAKE_SOURCE_DIR}/pipeline/build/build.h)
  endif()
  set(precompiled cordillera_${kind}_test_headers)
  if(NOT TARGET ${precompiled})
    add_library(${precompiled} OBJECT ${CMAKE_SOURCE_DIR}/tests/precompiled.cpp)
    target_link_libraries(${precompiled} PRIVATE cordillera_flags GTest::gmock GTest::gtest_main)
    if(NOT kind STREQUAL plain)
      target_link_libraries(${precompiled} PRIVATE cordillera_${kind})
    endif()
    target_compile_options(${precompiled} PRIVATE $<$<CONFIG:Release>:${optimisation}>)
    target_precompile_headers(${precompiled} PRIVATE ${headers})
  endif()
  target_precompile_headers(${target} REUSE_FROM ${precompiled})
endfunction()

# A test program: cordillera_test(name SOURCES ... [ALONE source...] [BATCH count] LIBS ... [TIMEOUT seconds] [APART]). ALONE and BATCH as for cordillera_unity: thirteen
# sources of the server's tests take 25 seconds as one, and 110 apart. A program is one test of ctest: one a case would load a hundred libraries, and
# make the datasets that cases share, a thousand times. APART: those whose cases take long are tests of their own, and so run side by side. The limit
# is of one test, on a machine that is slow and busy; what a case waits for has its own patience of four minutes, so that it says what did not come.
# COST: what may take longest begins first, here and in the folders of scripts, so that a run does not end with one long test.
function(cordillera_test name)
  cmake_parse_arguments(T "APART" "TIMEOUT;BATCH" "SOURCES;ALONE;LIBS" ${ARGN})
  if(NOT T_TIMEOUT)
    set(T_TIMEOUT 300)
  endif()
  if(NOT CORDILLERA_TESTS OR CORDILLERA_GPU_ONLY)
    return()
  endif()
  find_package(GTest REQUIRED)
  add_executable(${name} ${T_SOURCES} ${T_ALONE})
  # Most of a test runs once: compiling it is what takes time. Those of the server compute nothing themselves.
  set(optimisation -O1)
  if(cordillera_server IN_LIST T_LIBS)
    set(optimisation -O0)
  endif()
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:${optimisation}>)
  cordillera_precompile_test(${name} ${optimisation} ${T_LIBS})
  cordillera_unity(${name} BATCH ${T_BATCH} ALONE ${T_ALONE})
  target_link_libraries(${name} PRIVATE cordillera_flags ${T_LIBS} GTest::gmock GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE CORDILLERA_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  if(CORDILLERA_SANITIZE OR NOT T_APART)
    if(CORDILLERA_SANITIZE)
      set(T_TIMEOUT 3600)
    elseif(T_TIMEOUT LESS 900)
      set(T_TIMEOUT 900)
    endif()
    add_test(NAME ${name} COMMAND ${name} --gtest_brief=1)
    set_tests_properties(${name} PROPERTIES TIMEOUT ${T_TIMEOUT} COST ${T_TIMEOUT})
    return()
  endif()
  include(GoogleTest)
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 120 PROPERTIES TIMEOUT ${T_TIMEOUT} COST ${T_TIMEOUT})
endfunction()
if(CORDILLERA_FUZZ)
  target_compile_options(cordillera_flags INTERFACE
    $<$<COMPILE_LANGUAGE:CXX>:-fsanitize=fuzzer-no-link,address,undefined -fno-omit-frame-pointer -fno-sanitize-recover=undefined
    -D_GLIBCXX_ASSERTIONS>)
  target_link_options(cordillera_flags INTERFACE -fsanitize=address,undefined)
endif()
