#pragma once
// How messages are written as JSON, with any protobuf: version 26 gave an option another name.

namespace cordillera::pipeline {

/// options: a google::protobuf::util::JsonPrintOptions. Fields have the names of the schema, and those that are zero are written
/// too.
template <class Options>
void print_all_fields(Options& options) {
  options.preserve_proto_field_names = true;
  if constexpr (requires { options.always_print_fields_with_no_presence; })
    options.always_print_fields_with_no_presence = true;
  else
    options.always_print_primitive_fields = true;
}

}  // namespace cordillera::pipeline
