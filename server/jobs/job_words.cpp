#include "server/jobs/job_words.h"

#include <algorithm>

#include "proto/utf8.h"
#include "server/log/log.h"

namespace cordillera::server {

void JobWords::take(const char* bytes, std::size_t count) {
  const std::size_t room = std::min(count, kMostBytes - taken_);
  taken_ += room;
  for (const char* at = bytes; at != bytes + room; ++at) {
    if (*at == '\n')
      say();
    else if (line_.size() < kLongestLine)
      line_ += *at;
  }
  if (room == count || too_many_) return;
  too_many_ = true;
  say();
  log_warning("job " + job_ + " says more than " + std::to_string(kMostBytes) + " bytes; the rest is left out");
}

void JobWords::end() { say(); }

void JobWords::say() {
  if (!line_.empty()) log_warning("job " + job_ + " says: " + printable(line_));
  line_.clear();
}

}  // namespace cordillera::server
