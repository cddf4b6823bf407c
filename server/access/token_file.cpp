#include "server/access/token_file.h"

#include "proto/files.h"
#include "server/log/log.h"

namespace cordillera::server::access {

using proto::Problem;

namespace {

constexpr const char* kNobody = " has 0 tokens: nobody can write";

}  // namespace

proto::Result<std::unique_ptr<TokenFile>> TokenFile::open(const std::string& path, const std::string& lines) {
  std::unique_ptr<TokenFile> file(new TokenFile);
  auto fixed = read_tokens(lines, "token-lines");
  if (!fixed) return fixed.problem();
  file->fixed_ = std::move(*fixed);
  file->path_ = path;
  file->lines_ = std::make_shared<const std::vector<TokenLine>>(file->fixed_);
  file->configured_ = !path.empty() || !file->fixed_.empty();
  if (path.empty()) return file;
  if (const auto read = file->read(file->stamp()); !read) return read.problem();
  if (file->lines_->empty()) log_warning(path + kNobody);
  return file;
}

TokenFile::Stamp TokenFile::stamp() const {
  std::error_code error;
  Stamp stamp;
  stamp.changed = std::filesystem::last_write_time(path_, error);
  stamp.bytes = std::filesystem::file_size(path_, error);
  return stamp;
}

proto::Result<void> TokenFile::read(const Stamp& stamp) {
  const auto text = proto::bytes_of_file(path_);
  if (!text) return Problem{"tokens-invalid", "cannot read the token file " + path_.string(), "a readable file", "--tokens"};
  auto lines = read_tokens(*text, path_.string());
  if (!lines) return lines.problem();
  lines->insert(lines->end(), fixed_.begin(), fixed_.end());
  lines_ = std::make_shared<const std::vector<TokenLine>>(std::move(*lines));
  seen_ = stamp;
  return {};
}

void TokenFile::refresh() {
  const Stamp now = stamp();
  if (now == seen_) return;
  // A file that cannot be read, or is half written, leaves the former tokens in effect: an editor's slip must not lock everybody
  // out, and must not let anybody in.
  if (const auto again = read(now); !again) {
    log_warning(again.problem().line() + "; the tokens of before stay in effect");
    seen_ = now;
    return;
  }
  if (lines_->empty()) return log_warning(path_.string() + kNobody);
  log_info("the token file was read again: " + std::to_string(lines_->size()) + " tokens");
}

Identity TokenFile::find(std::string_view token) {
  std::shared_ptr<const std::vector<TokenLine>> lines;
  {
    const std::lock_guard lock(mutex_);
    if (!path_.empty()) refresh();
    lines = lines_;
  }
  return find_token(*lines, token);
}

}  // namespace cordillera::server::access
