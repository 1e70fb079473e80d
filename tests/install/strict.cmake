# throng_strict(TARGET): warnings that a user may treat as errors, in our headers, too: those of an installed package would
# otherwise count as system headers.
function(throng_strict target)
  set_target_properties(${target} PROPERTIES NO_SYSTEM_FROM_IMPORTED ON)
  if(NOT MSVC)
    target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Werror)
  endif()
endfunction()
