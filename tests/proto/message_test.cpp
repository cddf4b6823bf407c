// The messages: what their JSON promises, and the program's name in them.
#include <gtest/gtest.h>

#include <string>

#include "cordillera.pb.h"
#include "proto/version.h"

namespace cordillera::proto {
namespace {

using google::protobuf::FieldDescriptor;

TEST(Messages, HaveNo64BitIntegers) {
  // JSON would make strings of them, and clients would compare those as text.
  const auto* file = Manifest::descriptor()->file();
  int fields = 0;
  for (int m = 0; m < file->message_type_count(); ++m) {
    const auto* message = file->message_type(m);
    EXPECT_EQ(message->nested_type_count(), 0) << message->name() << ": look into its nested messages here too";
    for (int f = 0; f < message->field_count(); ++f, ++fields) {
      const auto type = message->field(f)->cpp_type();
      EXPECT_TRUE(type != FieldDescriptor::CPPTYPE_INT64 && type != FieldDescriptor::CPPTYPE_UINT64)
          << message->field(f)->full_name();
    }
  }
  EXPECT_GT(fields, 100);
}

TEST(Messages, KnowAnOptionThatWasNotGiven) {
  // error=0 is bad input, no error= is the default: the message must tell them apart.
  BuildOptions options;
  EXPECT_FALSE(options.has_error());
  options.set_error(0);
  EXPECT_TRUE(options.has_error());
  EXPECT_FALSE(options.has_min_level());
  EXPECT_FALSE(options.has_max_level());
  EXPECT_FALSE(options.has_z_scale());
  EXPECT_FALSE(options.has_z_offset());
}

TEST(Version, IsTheProjects) { EXPECT_EQ(std::string(kProgram), "cordillera " CORDILLERA_VERSION); }

}  // namespace
}  // namespace cordillera::proto
