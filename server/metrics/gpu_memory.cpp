#include "server/metrics/gpu_memory.h"

#include <dlfcn.h>

namespace cordillera::server::metrics {
namespace {

// Of NVML's interface, which its library keeps stable; its header comes with CUDA alone. https://docs.nvidia.com/deploy/nvml-api/
struct Memory {
  unsigned long long total = 0, free = 0, used = 0;
};
using Handle = void*;

class Nvml {
 public:
  Nvml() {
    library_ = dlopen("libnvidia-ml.so.1", RTLD_NOW | RTLD_LOCAL);
    if (library_ == nullptr) return;
    const bool all = find("nvmlInit_v2", init_) && find("nvmlDeviceGetCount_v2", count_) &&
                     find("nvmlDeviceGetHandleByIndex_v2", handle_) && find("nvmlDeviceGetMemoryInfo", memory_) &&
                     find("nvmlDeviceGetName", name_) && find("nvmlSystemGetDriverVersion", driver_);
    works_ = all && init_() == 0;
  }

  std::vector<Gpu> gpus() const {
    unsigned int count = 0;
    if (!works_ || count_(&count) != 0) return {};
    char driver[96] = {};
    driver_(driver, sizeof driver - 1);
    std::vector<Gpu> found;
    for (unsigned int i = 0; i < count; ++i) {
      Handle handle = nullptr;
      Memory memory;
      char name[96] = {};
      if (handle_(i, &handle) != 0 || memory_(handle, &memory) != 0) continue;
      name_(handle, name, sizeof name - 1);
      found.push_back({name, driver, memory.total, memory.used});
    }
    return found;
  }

 private:
  template <class Function>
  bool find(const char* name, Function& function) {
    function = reinterpret_cast<Function>(dlsym(library_, name));
    return function != nullptr;
  }

  void* library_ = nullptr;
  bool works_ = false;
  int (*init_)() = nullptr;
  int (*count_)(unsigned int*) = nullptr;
  int (*handle_)(unsigned int, Handle*) = nullptr;
  int (*memory_)(Handle, Memory*) = nullptr;
  int (*name_)(Handle, char*, unsigned int) = nullptr;
  int (*driver_)(char*, unsigned int) = nullptr;
};

}  // namespace

std::vector<Gpu> gpus() {
  static const Nvml library;
  return library.gpus();
}

}  // namespace cordillera::server::metrics
