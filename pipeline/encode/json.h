#pragma once
// JSON with members in the order they were added, so that documents are the same bytes every time and read well.
#include <nlohmann/json.hpp>
#include <utility>

namespace cordillera::pipeline {

using Json = nlohmann::ordered_json;

/// The last item of an array, or the value of the last member of an object; null: there is none. An array or object that was to
/// be begun when no memory was left is one without a container.
inline Json* last_child(Json& json) {
  if (auto* const items = json.get_ptr<Json::array_t*>()) return items->empty() ? nullptr : &items->back();
  if (auto* const members = json.get_ptr<Json::object_t*>()) return members->empty() ? nullptr : &members->back().second;
  return nullptr;
}

inline void drop_last_child(Json& json) {
  json.is_array() ? json.get_ref<Json::array_t&>().pop_back() : json.get_ref<Json::object_t&>().pop_back();
}

/// Takes everything out of it, however deep it nests, without recursion and without memory: on the way down each parent waits in
/// the place of the child that was taken out of it.
inline void empty_json(Json& json) noexcept {
  Json here = std::move(json), above;
  while (true) {
    if (Json* const child = last_child(here); child == nullptr) {
      if (above.is_null()) return;
      here = std::move(above);
      above = std::move(*last_child(here));
      drop_last_child(here);
    } else if (last_child(*child) == nullptr) {
      drop_last_child(here);
    } else {
      std::swap(above, *child);
      std::swap(above, here);
    }
  }
}

}  // namespace cordillera::pipeline

/// What destroys every value. The library's own lists the children in a std::vector first: a destructor that finds no memory for
/// it ends the program. Nor does it expect what operator[] leaves where it finds none: the type of an object, and no object.
template <>
inline void nlohmann::ordered_json::json_value::destroy(value_t type) {
  if (type == value_t::array && array != nullptr) {
    for (ordered_json& item : *array) cordillera::pipeline::empty_json(item);
    delete array;
  } else if (type == value_t::object && object != nullptr) {
    for (auto& [name, value] : *object) cordillera::pipeline::empty_json(value);
    delete object;
  } else if (type == value_t::string) {
    delete string;
  } else if (type == value_t::binary) {
    delete binary;
  }
}
