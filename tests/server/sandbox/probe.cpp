// A job of the service that is taken over as soon as it opens its raster. The job is the real one (job_main, as `cordillera job`
// runs it); this program stands between it and three things: GDAL, the kernel's answer about Landlock, and whether there is a
// GPU.
//   probe job FOLDER --parent PID    as the service starts it
//   probe free FOLDER                the same tries without a sandbox: what they say then
#include <dlfcn.h>
#include <gdal.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdarg>
#include <cstdlib>
#include <cstring>

#include "probe.h"
#include "server/jobs/child.h"

namespace cordillera::probe {
namespace {

std::filesystem::path g_folder;
Orders g_orders;

void read_orders(const std::filesystem::path& folder) {
  g_folder = folder;
  std::ifstream file(folder / kOrders);
  std::string other, grids, egm96;
  file >> g_orders.landlock_abi >> g_orders.gpu >> other >> grids >> egm96;
  g_orders.other = other, g_orders.grids = grids, g_orders.egm96 = egm96;
}

void try_all() {
  Findings findings(g_folder / kFindings);
  try_work(g_orders, g_folder, findings);
  try_files(g_orders, g_folder, findings);
  try_secrets(findings);
  try_processes(findings);
  try_machine(findings);
  try_calls(findings);
  findings.end();
}

}  // namespace
}  // namespace cordillera::probe

using namespace cordillera;

/// The job's call; GDAL's own calls of it stay in its library.
extern "C" GDALDatasetH GDALOpenEx(const char*, unsigned, const char* const*, const char* const*, const char* const*) {
  probe::try_all();
  return nullptr;
}

extern "C" long syscall(long number, ...) noexcept {
  static const auto real = reinterpret_cast<long (*)(long, ...)>(dlsym(RTLD_NEXT, "syscall"));
  std::va_list rest;
  va_start(rest, number);
  long arguments[6];
  for (long& argument : arguments) argument = va_arg(rest, long);
  va_end(rest);
  const bool asks_abi = number == SYS_landlock_create_ruleset && arguments[0] == 0;
  if (asks_abi && probe::g_orders.landlock_abi != 0) return probe::g_orders.landlock_abi;
  return real(number, arguments[0], arguments[1], arguments[2], arguments[3], arguments[4], arguments[5]);
}

/// In place of may_use_cuda (the linker's --wrap).
bool has_gpu(const proto::BuildOptions&) asm("__wrap_" CORDILLERA_MAY_USE_CUDA);
bool has_gpu(const proto::BuildOptions&) { return probe::g_orders.gpu; }

int main(int count, char** words) {
  if (count < 3) return 2;
  probe::read_orders(words[2]);
  if (strcmp(words[1], "free") == 0) {
    probe::Findings findings(probe::g_folder / probe::kFindings);
    probe::try_files(probe::g_orders, probe::g_folder, findings);
    probe::try_secrets(findings);
    findings.end();
    return 0;
  }
  return server::job_main(words[2], count > 4 ? std::atoi(words[4]) : 0);
}
