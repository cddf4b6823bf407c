#pragma once
// Escapes of addresses (RFC 3986, 2.1).
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace cordillera::server {

/// The byte that an escape means, "%41" -> 'A'; nullopt: at this place is none.
std::optional<char> escape_at(std::string_view text, std::size_t at);

enum class AddressPart : std::uint8_t { path, query };

/// Escapes as what they mean; what is none stays. Of a path %2F stays too: it is no "/" between two names. In a query + is
/// a blank.
std::string percent_decoded(std::string_view text, AddressPart part);

/// "Straße 1.tif" -> "Stra%C3%9Fe%201.tif": one part of a path, or a name or value of a query. Letters, digits, "-", ".", "_" and
/// "~" stand in every address as they are, and so do these others here.
std::string percent_encoded(std::string_view text, std::string_view others = "");

}  // namespace cordillera::server
