# Compiles, links and runs user programs with only the flags of pkg-config: C++17, C++20, and C99 where a C compiler is
# given. STATIC: --static for a static library, nothing for a shared one.
# CUDA_FOLDER: where the CUDA runtime is, if the library needs it.
set(ENV{PKG_CONFIG_PATH} "${PREFIX}/${LIBDIR}/pkgconfig:$ENV{PKG_CONFIG_PATH}")
execute_process(COMMAND ${PKG_CONFIG} ${STATIC} --cflags --libs throng
                OUTPUT_VARIABLE said OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
separate_arguments(said UNIX_COMMAND "${said}")
separate_arguments(FLAGS UNIX_COMMAND "${FLAGS}")
set(strict -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Werror)
if(CUDA_FOLDER)
  set(ENV{LIBRARY_PATH} "${CUDA_FOLDER}:$ENV{LIBRARY_PATH}")
endif()
# The loader does not search this prefix for a shared library.
set(ENV{LD_LIBRARY_PATH} "${PREFIX}/${LIBDIR}:$ENV{LD_LIBRARY_PATH}")
function(compile_and_run name)
  execute_process(COMMAND ${ARGN} ${strict} -o ${OUTPUT}_${name} ${said} COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND ${OUTPUT}_${name} COMMAND_ERROR_IS_FATAL ANY)
endfunction()
compile_and_run(cpp17 ${CXX} ${FLAGS} -std=c++17 -fno-exceptions -fno-rtti ${SOURCES}/cpp17/main.cpp)
compile_and_run(cpp20 ${CXX} ${FLAGS} -std=c++20 ${SOURCES}/cpp20/main.cpp)
if(C)
  compile_and_run(c99 ${C} -std=c99 ${EXAMPLE})
endif()
