#pragma once
// Names of datasets, uploads, sources and versions in addresses.
#include <string_view>

namespace cordillera::server {

/// Whether a text may name a dataset in an address.
inline bool is_id(std::string_view text) {
  if (text.empty() || text.size() > 80) return false;
  for (const char c : text) {
    if (!(c >= 'a' && c <= 'z') && !(c >= '0' && c <= '9') && c != '-') return false;
  }
  return true;
}

}  // namespace cordillera::server
