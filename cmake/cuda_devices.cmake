# For which GPUs kernels are compiled, where CMAKE_CUDA_ARCHITECTURES does not say it: each takes as long again.
set(CORDILLERA_CUDA_DEVICES "here" CACHE STRING "here: those of this machine, or the most common ones where it has none, others by their driver; all: any, for packages")
set_property(CACHE CORDILLERA_CUDA_DEVICES PROPERTY STRINGS here all)

# The compute capabilities of this machine's GPUs that nvcc knows, as machine code, in FOUND.
function(cordillera_gpus_here found)
  set(known_here "")
  find_program(CORDILLERA_NVIDIA_SMI nvidia-smi)
  find_program(CORDILLERA_NVCC nvcc HINTS "$ENV{CUDA_PATH}/bin" PATHS /usr/local/cuda/bin)
  if(CORDILLERA_NVIDIA_SMI AND CORDILLERA_NVCC)
    execute_process(COMMAND ${CORDILLERA_NVIDIA_SMI} --query-gpu=compute_cap --format=csv,noheader
                    OUTPUT_VARIABLE here RESULT_VARIABLE status ERROR_QUIET TIMEOUT 60)
    execute_process(COMMAND ${CORDILLERA_NVCC} --list-gpu-arch OUTPUT_VARIABLE known ERROR_QUIET)
    string(REGEX MATCHALL "[^\r\n]+" lines "${here}")
    foreach(line IN LISTS lines)
      string(STRIP "${line}" line)
      if(status EQUAL 0 AND line MATCHES "^([0-9]+)\\.([0-9])$")
        set(capability ${CMAKE_MATCH_1}${CMAKE_MATCH_2})
        if(capability GREATER_EQUAL 75 AND known MATCHES "compute_${capability}\n")
          list(APPEND known_here ${capability}-real)
        endif()
      endif()
    endforeach()
    list(REMOVE_DUPLICATES known_here)
  endif()
  set(${found} "${known_here}" PARENT_SCOPE)
endfunction()

# In ARCHITECTURES, as CMake has them. What was found stays the same for a build folder: else all kernels would be compiled again whenever
# nvidia-smi fails.
function(cordillera_cuda_architectures architectures)
  if(CORDILLERA_CUDA_DEVICES STREQUAL "all")
    # The last one as PTX, too, for what comes later.
    set(${architectures} 75-real 80-real 86-real 89-real 90 PARENT_SCOPE)
  elseif(CORDILLERA_CUDA_DEVICES STREQUAL "here")
    if(NOT DEFINED CORDILLERA_GPUS_HERE)
      cordillera_gpus_here(found)
      set(CORDILLERA_GPUS_HERE "${found}" CACHE INTERNAL "compute capabilities of the GPUs here")
    endif()
    # PTX of the oldest: any other GPU's driver makes machine code of it, which takes eleven seconds (H100), of every job again. Where there is no GPU
    # the program is for another machine: code of data centres' and of consumers' GPUs since 2020 (80 runs on 86 and 89, too).
    set(known ${CORDILLERA_GPUS_HERE})
    if(NOT known)
      set(known 80-real 90-real)
    endif()
    set(${architectures} ${known} 75-virtual PARENT_SCOPE)
  else()
    message(FATAL_ERROR "Cordillera: CORDILLERA_CUDA_DEVICES is '${CORDILLERA_CUDA_DEVICES}'; here or all is wanted")
  endif()
endfunction()
