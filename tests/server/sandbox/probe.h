#pragma once
// What a job that was taken over tries, from inside. It writes a line a try into its folder: "attack NAME refused|done (errno)",
// "work NAME yes|no", "call NUMBER allowed|EPERM|ENOSYS", and "end" when it has come through.
#include <cerrno>
#include <filesystem>
#include <fstream>

namespace cordillera::probe {

/// In a job's folder: what is to be tried, and what came of it.
inline constexpr const char *kOrders = "orders", *kFindings = "findings";

struct Orders {
  int landlock_abi = 0;         ///< what the kernel is made to say; 0: its own answer
  bool gpu = false;             ///< as if the machine had a GPU
  std::filesystem::path other;  ///< a folder of another dataset, with a file "victim"
  std::filesystem::path grids;  ///< a folder that jobs may read, with a file "grid"
  std::filesystem::path egm96;  ///< the grid of every job
};

class Findings {
 public:
  explicit Findings(const std::filesystem::path& file) : file_(file, std::ios::app) {}

  /// result: of the call, with its errno.
  void attack(const char* name, long result) {
    const int error = result < 0 ? errno : 0;
    const bool refused = error == EPERM || error == EACCES || error == ENOSYS || error == EXDEV;
    file_ << "attack " << name << (refused ? " refused" : " done") << " (" << error << ")" << std::endl;
  }
  void work(const char* name, bool works) { file_ << "work " << name << (works ? " yes" : " no") << std::endl; }
  void call(int number, long result) {
    const char* answer = result >= 0 ? "allowed" : errno == EPERM ? "EPERM" : errno == ENOSYS ? "ENOSYS" : "allowed";
    file_ << "call " << number << ' ' << answer << std::endl;
  }
  void end() { file_ << "end" << std::endl; }

 private:
  std::ofstream file_;
};

void try_files(const Orders& orders, const std::filesystem::path& folder, Findings& findings);
void try_secrets(Findings& findings);
void try_processes(Findings& findings);
void try_machine(Findings& findings);
/// Each call by its number, with arguments that make a permitted one fail, or do nothing.
void try_calls(Findings& findings);
/// What a job needs.
void try_work(const Orders& orders, const std::filesystem::path& folder, Findings& findings);

}  // namespace cordillera::probe
