#pragma once
// A multipart form as text, as curl -F or a page sends it.
#include <string>

namespace cordillera::server {

inline constexpr const char* kForm = "multipart/form-data; boundary=\"b o\"";

inline std::string form_part(const std::string& disposition, const std::string& value) {
  return "--b o\r\nContent-Disposition: form-data; " + disposition + "\r\nX-Other: yes\r\n\r\n" + value + "\r\n";
}
inline std::string form_file(const std::string& value, const std::string& name = "dem.tif") {
  return form_part("name=\"file\"; filename=\"" + name + "\"", value);
}
inline const std::string kFormEnd = "--b o--\r\n";

}  // namespace cordillera::server
