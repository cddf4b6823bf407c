#pragma once
// What a client gets.
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

namespace cordillera::pipeline::faces {

/// Bytes that many hold and nobody changes: a copy costs a pointer. Never null.
class SharedBytes {
 public:
  SharedBytes() : SharedBytes(std::string()) {}
  SharedBytes(std::string bytes)
      : held_(std::make_shared<const std::string>(std::move(bytes))) {}  // from any string: it becomes one of these
  operator const std::string&() const { return *held_; }
  operator std::string_view() const { return *held_; }
  std::size_t size() const { return held_->size(); }
  auto begin() const { return held_->begin(); }
  auto end() const { return held_->end(); }
  bool empty() const { return held_->empty(); }
  const std::shared_ptr<const std::string>& held() const { return held_; }
  friend bool operator==(const SharedBytes& a, const SharedBytes& b) { return *a.held_ == *b.held_; }

 private:
  std::shared_ptr<const std::string> held_;
};

struct Document {
  SharedBytes bytes;
  std::string etag;  ///< hex, without quotes; a function of the bytes
};

/// The tag is a hash of the bytes.
Document document(std::string bytes);

}  // namespace cordillera::pipeline::faces
