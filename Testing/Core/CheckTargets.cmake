# Fails where code that was compiled for one instruction set could be linked into code that runs
# everywhere: weak symbols, which inline functions become where they are not inlined. Templates of a
# vector type are that instruction set's own.
#   cmake -DNM=<nm> -DOBJECTS=<object files> -P CheckTargets.cmake
set(count 0)
foreach (object IN LISTS OBJECTS)
  if (NOT object MATCHES "Target(AVX2|AVX512)")
    continue ()
  endif ()
  math(EXPR count "${count} + 1")
  execute_process(COMMAND "${NM}" -C --defined-only "${object}"
    OUTPUT_VARIABLE symbols RESULT_VARIABLE result)
  if (NOT result EQUAL 0)
    message(FATAL_ERROR "${NM} cannot read ${object}: ${result}")
  endif ()
  string(REGEX MATCHALL "[^\n]* [WVu] [^\n]*" weak "${symbols}")
  foreach (symbol IN LISTS weak)
    if (NOT symbol MATCHES "__vector")
      message(SEND_ERROR "${object}: ${symbol}: mark it SURFELSPLATTING_INLINE (Core/Simd/Inline.h)")
    endif ()
  endforeach ()
endforeach ()
if (count EQUAL 0)
  message(FATAL_ERROR "No objects of targets among: ${OBJECTS}")
endif ()
message(STATUS "${count} targets share no code")
