# What is missing or does not fit is named in one message that says what to do. Each case configures the sources; nothing is built.
cmake_minimum_required(VERSION 3.25)
file(REMOVE_RECURSE "${WORK}")
set(library -DCMAKE_BUILD_TYPE=Release -DTHRONG_BUILD_CLI=OFF -DTHRONG_BUILD_TESTS=OFF -DTHRONG_BUILD_BENCH=OFF)

# configure(NAME SOURCE arguments...): sets failed, and said without line breaks.
function(configure name source)
  execute_process(COMMAND ${CMAKE_COMMAND} -S ${source} -B ${WORK}/${name} -G "${GENERATOR}" ${ARGN}
                  OUTPUT_VARIABLE said ERROR_VARIABLE said RESULT_VARIABLE failed)
  string(REGEX REPLACE "[ \n]+" " " said "${said}")
  set(said "${said}" PARENT_SCOPE)
  set(failed "${failed}" PARENT_SCOPE)
endfunction()
# refused(NAME SOURCE words... OPTIONS arguments...): the configuration fails with exactly one error, which has the words.
function(refused name source)
  cmake_parse_arguments(PARSE_ARGV 2 its "" "" "WORDS;OPTIONS")
  configure(${name} "${source}" ${its_OPTIONS})
  string(REGEX MATCHALL "CMake Error" errors "${said}")
  list(LENGTH errors count)
  if(NOT failed OR NOT count EQUAL 1)
    message(FATAL_ERROR "${name}: ${count} errors instead of one: ${said}")
  endif()
  foreach(word IN LISTS its_WORDS)
    string(FIND "${said}" "${word}" at)
    if(at EQUAL -1)
      message(FATAL_ERROR "${name}: no '${word}' in: ${said}")
    endif()
  endforeach()
  message(STATUS "refused: ${name}")
endfunction()

refused(no_tbb ${ROOT} WORDS "oneTBB was not found" "apt install libtbb-dev" "THRONG_THREADS=std"
        OPTIONS ${library} -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_DISABLE_FIND_PACKAGE_TBB=ON)
refused(no_cuda ${ROOT} WORDS "no CUDA compiler was found" "THRONG_CUDA=OFF"
        OPTIONS ${library} -DCMAKE_CXX_COMPILER=${CXX} -DTHRONG_CUDA=ON -DCMAKE_CUDA_COMPILER=NOTFOUND)
file(WRITE ${WORK}/nvcc "#!/bin/sh\necho 'Cuda compilation tools, release 11.8, V11.8.89'\n")
file(CHMOD ${WORK}/nvcc PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE)
refused(old_cuda ${ROOT} WORDS "belongs to CUDA 11.8" "12.8 or newer is needed" "THRONG_CUDA=OFF"
        OPTIONS ${library} -DCMAKE_CXX_COMPILER=${CXX} -DTHRONG_CUDA=ON -DCMAKE_CUDA_COMPILER=${WORK}/nvcc)

# Real targets: nothing is linked, so no libraries for them are needed.
cmake_host_system_information(RESULT machine QUERY OS_PLATFORM)
if(machine STREQUAL "x86_64")
  refused(bits_32 ${ROOT} WORDS "needs a 64-bit target" "Remove -m32"
          OPTIONS ${library} -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_CXX_FLAGS=-m32 -DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY)
else()
  message(STATUS "not tried: a 32-bit target")
endif()
find_program(clang clang++)
if(clang)
  refused(big_endian ${ROOT} WORDS "needs a little-endian target"
          OPTIONS ${library} -DCMAKE_CXX_COMPILER=${clang} -DCMAKE_CXX_COMPILER_TARGET=powerpc64-linux-gnu
                  -DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY)
else()
  message(STATUS "not tried: a big-endian target (needs clang++)")
endif()

# Without Highway the scalar kernels are built, with a warning unless the options choose them.
set(std ${library} -DCMAKE_CXX_COMPILER=${CXX} -DTHRONG_THREADS=std)
configure(no_highway ${ROOT} ${std} -DCMAKE_DISABLE_FIND_PACKAGE_hwy=ON)
if(failed OR NOT said MATCHES "CMake Warning .*5 to 14 times as long.*apt install libhwy-dev.*THRONG_HIGHWAY=OFF")
  message(FATAL_ERROR "no warning of Highway: ${said}")
endif()
configure(scalar ${ROOT} ${std} -DTHRONG_HIGHWAY=OFF)
if(failed OR said MATCHES "Warning|Highway")
  message(FATAL_ERROR "THRONG_HIGHWAY=OFF warns: ${said}")
endif()

# The installed package.
file(WRITE "${WORK}/user/CMakeLists.txt" "cmake_minimum_required(VERSION 3.25)
project(user LANGUAGES CXX)
find_package(throng REQUIRED)
")
set(user -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_PREFIX_PATH=${PREFIX})
if(STATIC_TBB)
  refused(user_without_tbb ${WORK}/user WORDS "apt install libtbb-dev" "BUILD_SHARED_LIBS=ON"
          OPTIONS ${user} -DCMAKE_DISABLE_FIND_PACKAGE_TBB=ON)
endif()
configure(user_without_others ${WORK}/user ${user} -DCMAKE_DISABLE_FIND_PACKAGE_hwy=ON
          -DCMAKE_DISABLE_FIND_PACKAGE_CUDAToolkit=ON -DCMAKE_DISABLE_FIND_PACKAGE_MPI=ON)
if(failed AND NOT CUDA)
  message(FATAL_ERROR "the installed package needs more than oneTBB: ${said}")
endif()
