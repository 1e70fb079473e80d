# Installs the library of BUILD into WORK; runs the crate's tests and examples against it, without a network and
# with warnings as errors; and checks what the build script says if there is no library.
set(prefix "${WORK}/installed")
file(REMOVE_RECURSE "${prefix}")
foreach(component core development)
  execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix} --component ${component} --config ${CONFIG}
                  OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
endforeach()

set(ENV{THRONG_DIR} "${prefix}")
set(ENV{CARGO_TARGET_DIR} "${WORK}/target")
set(ENV{CARGO_PROFILE_DEV_DEBUG} 0)
set(ENV{RUSTFLAGS} "-D warnings")
set(ENV{RUSTDOCFLAGS} "-D warnings")
# A shared library is not copied into programs.
set(ENV{LD_LIBRARY_PATH} "${prefix}/${LIBDIR}:$ENV{LD_LIBRARY_PATH}")
# throng.pc does not name the folder of the CUDA runtime.
if(CUDA_FOLDER)
  set(ENV{LIBRARY_PATH} "${CUDA_FOLDER}:$ENV{LIBRARY_PATH}")
endif()
set(offline --offline --locked --manifest-path ${CRATE}/Cargo.toml)
execute_process(COMMAND ${CARGO} test ${offline} COMMAND_ERROR_IS_FATAL ANY)

function(expect_output example expected)
  execute_process(COMMAND ${CARGO} run --quiet ${offline} --example ${example} OUTPUT_VARIABLE output COMMAND_ERROR_IS_FATAL ANY)
  if(NOT output MATCHES "${expected}")
    message(FATAL_ERROR "the example ${example} printed:\n${output}")
  endif()
endfunction()
expect_output(first_steps "^(0 touches 1\n1 touches 2|1 touches 2\n0 touches 1)\n$")
expect_output(frames "^frame 0: Started\\(Entity\\(7001\\), Entity\\(42\\)\\)
frame 2: Started\\(Entity\\(7002\\), Entity\\(42\\)\\)
frame 5: Stopped\\(Entity\\(7001\\), Entity\\(42\\)\\)
frame 5: Stopped\\(Entity\\(7002\\), Entity\\(42\\)\\)
the ray hits Entity\\(7002\\) at a distance of 2.5
$")

# Found by pkg-config.
unset(ENV{THRONG_DIR})
find_program(pkg_config pkg-config)
if(pkg_config)
  set(ENV{PKG_CONFIG_PATH} "${prefix}/${LIBDIR}/pkgconfig:$ENV{PKG_CONFIG_PATH}")
  expect_output(first_steps "1 touches 2")
endif()

# expect_refused(expected arguments...): the build fails with this text and what to do.
function(expect_refused expected)
  execute_process(COMMAND ${CARGO} check --offline ${ARGN} RESULT_VARIABLE failed OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT failed OR NOT output MATCHES "${expected}" OR NOT output MATCHES "Do one of these")
    message(FATAL_ERROR "expected '${expected}', found:\n${output}")
  endif()
endfunction()
set(ENV{THRONG_DIR} "${WORK}/nothing")
expect_refused("THRONG_DIR is .*nothing: it has no lib/pkgconfig/throng.pc" --manifest-path ${CRATE}/Cargo.toml)
# The crate alone.
unset(ENV{THRONG_DIR})
set(ENV{PKG_CONFIG} "${WORK}/no-pkg-config")
file(REMOVE_RECURSE "${WORK}/alone")
file(COPY "${CRATE}/" DESTINATION "${WORK}/alone/rust")
expect_refused("there is no .*alone.*CMakeLists.txt" --manifest-path ${WORK}/alone/rust/Cargo.toml)
message(STATUS "the crate's tests passed, two examples ran, two missing libraries were named")
