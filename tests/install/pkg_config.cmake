# Compiles and runs one source with only the flags of pkg-config.
set(ENV{PKG_CONFIG_PATH} "${PREFIX}/${LIBDIR}/pkgconfig:$ENV{PKG_CONFIG_PATH}")
execute_process(COMMAND ${PKG_CONFIG} --static --cflags --libs throng
                OUTPUT_VARIABLE said OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
separate_arguments(said UNIX_COMMAND "${said}")
separate_arguments(FLAGS UNIX_COMMAND "${FLAGS}")
execute_process(COMMAND ${CXX} ${FLAGS} -std=c++17 -fno-exceptions -fno-rtti ${SOURCE} -o ${OUTPUT}
                        ${said} COMMAND_ERROR_IS_FATAL ANY)
# The loader does not search this prefix for a shared library.
set(ENV{LD_LIBRARY_PATH} "${PREFIX}/${LIBDIR}:$ENV{LD_LIBRARY_PATH}")
execute_process(COMMAND ${OUTPUT} COMMAND_ERROR_IS_FATAL ANY)
