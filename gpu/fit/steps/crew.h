#pragma once
// Threads of a host that wait for loops to share. A driver gives out thousands of short loops: who waits looks around for a while
// before it sleeps.
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace cordillera::gpu::fit {

class Crew {
 public:
  /// The calling thread is one of them; 0: one for each usable core.
  explicit Crew(unsigned threads);
  ~Crew();
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;

  unsigned threads() const { return static_cast<unsigned>(others_.size()) + 1; }

  /// work(chunk) for all chunks below a number, in any order, by all threads; returns when all is done.
  template <class Work>
  void share(std::size_t chunks, const Work& work) {
    if (others_.empty() || chunks < 2) {
      for (std::size_t chunk = 0; chunk < chunks; ++chunk) work(chunk);
      return;
    }
    run(
        chunks, [](const void* what, std::size_t chunk) { (*static_cast<const Work*>(what))(chunk); }, &work);
  }

 private:
  using Call = void (*)(const void*, std::size_t);

  void run(std::size_t chunks, Call call, const void* work);
  void take();
  void serve();

  std::vector<std::thread> others_;
  Call call_ = nullptr;
  const void* work_ = nullptr;
  std::size_t chunks_ = 0;
  std::atomic<std::size_t> next_ = 0;
  std::atomic<unsigned> turn_ = 0;  ///< counts loops
  std::atomic<unsigned> busy_ = 0;
  std::atomic<bool> over_ = false;
};

}  // namespace cordillera::gpu::fit
