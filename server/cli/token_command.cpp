#include "server/cli/commands.h"

#include <fcntl.h>
#include <string.h>
#include <unistd.h>

#include <iostream>

#include "raster/disk/descriptor.h"
#include "raster/disk/write_all.h"
#include "server/access/tokens.h"

namespace cordillera::server {
namespace {

/// The line begins on a line of its own.
bool append(raster::Descriptor file, const std::string& line) {
  char last = '\n';
  const off_t size = lseek(file.number(), 0, SEEK_END);
  const bool looked = size <= 0 || pread(file.number(), &last, 1, size - 1) == 1;
  const std::string text = (last == '\n' ? "" : "\n") + line + "\n";
  const bool written = looked && raster::write_all(file.number(), text) && fsync(file.number()) == 0;
  return file.close() && written;
}

}  // namespace

int token_command(const TokenWords& words) {
  if (words.action != "new")
    return wrong_usage(
        {"usage", "unknown action '" + words.action + "'", "cordillera token new --name NAME --role ROLE", words.action});
  const access::Role role = access::role_named(words.role);
  if (role == access::Role::none)
    return wrong_usage({"usage", words.role.empty() ? "a token needs a role" : "no role is called '" + words.role + "'",
                        "--role read, write or admin", "--role"});
  if (!access::is_token_name(words.name)) {
    return wrong_usage({"usage", words.name.empty() ? "a token needs a name" : "'" + words.name + "' is no name for a token",
                        "--name with 1 to 64 letters, digits, dots, dashes and underscores", "--name"});
  }
  const access::NewToken made = access::make_token(words.name, role);
  const auto cannot_write = [&](const char* more) {
    return fail(
        {"output-failed", "cannot write " + words.file + ": " + strerror(errno) + more, "a file that can be written", "--file"});
  };
  // Nobody but its owner reads a file that this makes; an existing one keeps its rights.
  raster::Descriptor file(words.file.empty() ? -1 : ::open(words.file.c_str(), O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC, 0600));
  if (!words.file.empty() && !file.is_open()) return cannot_write("");
  std::cout << "token: " << made.token << "\n";
  if (words.file.empty()) std::cout << "line:  " << made.line << "\n";
  // A token that nobody has seen is not to be valid.
  if (!std::cout.flush()) return kFailed;  // with_output says why
  if (!words.file.empty() && !append(std::move(file), made.line)) return cannot_write("; the token is not valid");
  std::cerr << "The token is shown this once. "
            << (words.file.empty() ? "The line goes into the file of --tokens.\n"
                                   : "Its line was added to " + words.file + ".\n");
  return kDone;
}

}  // namespace cordillera::server
