#pragma once
// A file descriptor with an owner.
#include <unistd.h>

#include <cerrno>
#include <utility>

namespace cordillera::raster {

/// Closes what it owns when it goes, and leaves errno as it was: who failed can still say why.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() { let_go(); }
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    if (this == &other) return *this;
    let_go();
    number_ = std::exchange(other.number_, -1);
    return *this;
  }

  bool is_open() const { return number_ >= 0; }
  int number() const { return number_; }  ///< below 0: none
  /// False if there was none, or the system could not: errno says why.
  bool close() { return is_open() && ::close(std::exchange(number_, -1)) == 0; }

 private:
  void let_go() {
    const int why = errno;
    close();
    errno = why;
  }

  int number_ = -1;
};

/// Whether an errno says that none is left, to the process or to the system: it passes.
inline bool is_want_of_descriptors(int error) { return error == EMFILE || error == ENFILE; }

}  // namespace cordillera::raster
