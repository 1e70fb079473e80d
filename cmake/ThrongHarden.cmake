# What packaged programs are compiled with, so that a fault that nobody knows of ends the program instead
# of serving whoever feeds it: the checks of the C library, guarded stacks, control flow that only
# goes where functions begin, tables that are read-only once loaded, code at a random place. Chosen
# as what the compiler at hand knows. scripts/check_hardening tells whether a file has them.
include(CheckCXXCompilerFlag)
include(CheckLinkerFlag)
include(CheckPIESupported)

option(THRONG_HARDEN "Compile with hardening flags, as packages do" OFF)

function(throng_harden target)
  if(MSVC)
    target_compile_options(${target} PRIVATE /guard:cf)
    target_link_options(${target} PRIVATE /guard:cf)
    return()
  endif()
  foreach(flag -fstack-protector-strong -fstack-clash-protection -fcf-protection=full)
    string(MAKE_C_IDENTIFIER "THRONG_KNOWS${flag}" known)
    check_cxx_compiler_flag(${flag} ${known})
    if(${known})
      target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:${flag}>)
    endif()
  endforeach()
  # Some distributions define it themselves. Without optimisation it does nothing but warn.
  target_compile_options(${target} PRIVATE
    "$<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CONFIG:Release,RelWithDebInfo,MinSizeRel>>:-U_FORTIFY_SOURCE;-D_FORTIFY_SOURCE=2>")
  foreach(flag -Wl,-z,relro -Wl,-z,now -Wl,-z,noexecstack)
    string(MAKE_C_IDENTIFIER "THRONG_LINKS${flag}" known)
    check_linker_flag(CXX ${flag} ${known})
    if(${known})
      target_link_options(${target} PRIVATE ${flag})
    endif()
  endforeach()
  # Without this CMake compiles for, but does not link, programs that can lie anywhere.
  check_pie_supported(LANGUAGES CXX)
endfunction()
