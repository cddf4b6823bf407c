#pragma once
// Lines of words, as OFF, OBJ and ascii PLY are made of.
#include <string>
#include <string_view>

#include "proto/mesh_file/mesh_source.h"

namespace cordillera::proto {

class TextLines {
 public:
  /// comment: the sign from which on a line says nothing; continuation: the sign at whose place the next line goes on. 0: there
  /// is none. Borrows the source.
  TextLines(MeshSource& source, char comment, char continuation)
      : source_(source), comment_(comment), continuation_(continuation) {}

  /// Goes to the next line with a word on it, past what is left of this one; false at the end of the file.
  bool next();
  /// The next word of this line, empty where there is none left. Valid until the next call. A word longer than
  /// kLongestWord comes without its end and with a '?', so that it is no number.
  std::string_view word();
  /// The number of the line that next() came to.
  std::uint64_t line() const { return line_; }

  static constexpr std::size_t kLongestWord = 400;

 private:
  void pass_blanks();
  bool ends_word(int byte) const;

  MeshSource& source_;
  char comment_, continuation_;
  std::uint64_t line_ = 0;
  std::string word_;
};

/// What a message shows of a word that may be anything: printable and short.
std::string shown(std::string_view word);

}  // namespace cordillera::proto
