// The driver's library as far as the service asks it, for machines without a GPU: one card with 1000 MiB, 250 of them taken.
#include <cstring>

extern "C" {
struct nvmlMemory {
  unsigned long long total, free, used;
};
int nvmlInit_v2() { return 0; }
int nvmlDeviceGetCount_v2(unsigned int* count) { return *count = 1, 0; }
int nvmlDeviceGetHandleByIndex_v2(unsigned int index, void** handle) { return *handle = handle, index == 0 ? 0 : 2; }
int nvmlDeviceGetMemoryInfo(void*, nvmlMemory* memory) { return *memory = {1000ull << 20, 750ull << 20, 250ull << 20}, 0; }
int nvmlDeviceGetName(void*, char* name, unsigned int length) { return std::strncpy(name, "Played GPU", length), 0; }
int nvmlSystemGetDriverVersion(char* version, unsigned int length) { return std::strncpy(version, "1.2.3", length), 0; }
}
