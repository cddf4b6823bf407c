// The page of errors against the sources: a slug that the code can say stands there with its status, and no other does.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <set>
#include <utility>

#include "fixture.h"
#include "pipeline/faces/face.h"
#include "server/http/problems.h"
#include "server/options/options.h"

namespace cordillera::server {
namespace {

using Slugs = std::set<std::string>;

const std::filesystem::path kSource = CORDILLERA_SOURCE_DIR;

/// Words between parts of the program. Nobody outside hears them.
const Slugs kInternal = {
    "cancelled",    // ends a job whose dataset is being deleted, or a command line that prints it without its slug
    "device-lost",  // the service runs the job once more, on the CPU
    "no-data",  // a store without a tile, which the build calls raster-all-nodata; a plan without a vertex, which no source gives
    "unknown-device",  // the option table lets no such device through
    "bad-target",      // likewise, for simplify
    "paused",          // ends the job of a lazy build, which goes on with the next look
};

Slugs found_in(const std::string& text, const std::regex& what) {
  Slugs slugs;
  for (std::sregex_iterator at(text.begin(), text.end(), what), end; at != end; ++at) slugs.insert((*at)[1]);
  return slugs;
}

/// Words of the sources that look like slugs and are none; names of options are known from their table.
const Slugs kOtherWords = {"accept-encoding",
                           "if-match",
                           "content-encoding",
                           "content-length",
                           "content-type",
                           "cross-site",
                           "same-site",
                           "strict-origin-when-cross-origin",
                           "cordillera-data",
                           "my-dem",
                           "others-wait",
                           "all-wanted",
                           "cordillera-provisional",
                           "source-nodata",
                           "at-end",
                           "come-back",
                           "fisher-yates",
                           "lock-down",
                           "lock-first",
                           "most-triangles",
                           "qem-best",
                           "super-independent",
                           "test-first",
                           "vertex-best",
                           "data-not-writable",
                           "looked-at",
                           "date-time",
                           "disk-full",
                           "idempotency-key",
                           "last-event-id",
                           "if-none-match",
                           "if-range",
                           "keep-alive",
                           "no-cache",
                           "no-store",
                           "sec-fetch-site",
                           "service-desc",
                           "service-doc",
                           "transfer-encoding",
                           "user-defined",
                           "cdn-loop",
                           "cf-connecting-ip",
                           "client-ip",
                           "fastly-client-ip",
                           "fly-client-ip",
                           "true-client-ip",
                           "x-client-ip",
                           "x-cluster-client-ip",
                           "x-envoy-external-address",
                           "x-forwarded",
                           "x-forwarded-for",
                           "xdg-open",
                           "retry-after",
                           "tus-resumable",
                           "upload-length",
                           "upload-metadata",
                           "under-way",
                           "upload-offset",
                           "x-forwarded-host",
                           "x-forwarded-prefix",
                           "x-forwarded-proto",
                           "x-gzip",
                           "x-real-ip",
                           "x-request-id"};

/// Lines with a word in quotation marks, and the two before each: what a slug is said in may begin there. A regular expression
/// takes long for all.
std::string lines_with_words(const std::string& text) {
  static const std::regex kWord("\"[a-z]");
  std::string kept, line, before[2];
  for (std::istringstream lines(text); std::getline(lines, line);) {
    line += '\n';
    const auto quoted = line.find('"');
    if (quoted != std::string::npos && std::regex_search(line.begin() + std::ptrdiff_t(quoted), line.end(), kWord)) {
      kept += before[0] + before[1] + line;
      before[0] = before[1] = line = "";
    }
    before[0] = std::exchange(before[1], line);
  }
  return kept;
}

/// Of all sources, read once.
const std::string& source_text() {
  static const std::string kText = [] {
    std::string text;
    for (const char* floor : {"proto", "raster", "gpu", "pipeline", "server"}) {
      for (const auto& entry : std::filesystem::recursive_directory_iterator(kSource / floor)) {
        const auto suffix = entry.path().extension();
        if (suffix == ".cpp" || suffix == ".h" || suffix == ".cu" || suffix == ".inl")
          text += lines_with_words(file_text(entry.path()));
      }
    }
    return text;
  }();
  return kText;
}

/// The slug is the first thing in a Problem's braces. Rows of other tables begin a line instead.
Slugs found_in_sources() {
  static const std::regex kProblem(R"re((?:Problem(?: \w+)?|return|\()\s*\{\s*"([a-z]+(?:-[a-z]+)*)",)re");
  static const std::regex kRefused(R"re(refused\("([a-z]+(?:-[a-z]+)*)",)re");
  // Stages of a report and operations of a document begin as a problem does.
  const std::string text = std::regex_replace(source_text(), std::regex(R"((stages\.push_back|=\s*operation)\(\s*\{)"), "other ");
  Slugs slugs = found_in(text, kProblem);
  slugs.merge(found_in(text, kRefused));
  return slugs;
}
Slugs in_sources() {
  static const Slugs kFound = found_in_sources();
  return kFound;
}

/// Rows of the page: | status | slugs |.
std::map<std::string, int> in_page() {
  std::istringstream lines(file_text(kSource / "docs" / "reference" / "errors.md"));
  static const std::regex kRow(R"(\| *([0-9]{3}|command line only) *\|(.*)\|)"), kSlug("`([a-z-]+)`");
  std::map<std::string, int> statuses;
  std::smatch row;
  for (std::string line; std::getline(lines, line);) {
    if (!std::regex_match(line, row, kRow)) continue;
    const std::string status = row[1];
    for (const std::string& slug : found_in(row[2], kSlug)) {
      EXPECT_TRUE(statuses.emplace(slug, std::atoi(status.c_str())).second) << slug << " stands there twice";
    }
  }
  return statuses;
}

TEST(Problems, WhatEndsByItselfSaysWhenToAskAgain) {
  const auto retry_after = [](const std::string& slug) {
    return problem_response({slug, "", "", "parameter"}).header("Retry-After");
  };
  for (const ProblemKind& kind : all_problem_kinds()) {
    const bool ends = kind.status == 429 || kind.status == 503 || kind.slug == "dataset-not-ready" ||
                      kind.slug == "dataset-changing" || kind.slug == "idempotency-key-in-use";
    EXPECT_EQ(!retry_after(kind.slug).empty(), ends) << kind.slug;
  }
}

TEST(Problems, ThePageListsWhatTheSourcesSay) {
  Slugs said = in_sources();
  for (const std::string& word : kInternal) EXPECT_EQ(said.erase(word), 1u) << word << " is said nowhere any more";
  EXPECT_GT(said.size(), 60u);
  const auto listed = in_page();
  for (const std::string& slug : said) EXPECT_EQ(listed.count(slug), 1u) << "docs/reference/errors.md lacks " << slug;
  for (const auto& [slug, status] : listed)
    EXPECT_EQ(said.count(slug), 1u) << "docs/reference/errors.md lists " << slug << ", which no source says";
}

/// A slug that is said in another way than the two above would be overlooked.
TEST(Problems, EveryWordWithADashIsASlugOrSomethingElse) {
  Slugs words = found_in(source_text(), std::regex(R"re("([a-z]+(?:-[a-z]+)+)")re"));
  for (const std::string& slug : in_sources()) words.erase(slug);
  for (const OptionSpec& option : all_options()) words.erase(option.name);
  for (const pipeline::faces::Face* face : pipeline::faces::all_faces()) words.erase(std::string(face->name));
  for (const std::string& word : kOtherWords) EXPECT_EQ(words.erase(word), 1u) << word << " is nowhere any more";
  EXPECT_THAT(words, testing::IsEmpty())
      << "say a slug as the first word of a Problem's braces; list anything else in kOtherWords";
}

TEST(Problems, StatusesAreThoseOfThePage) {
  int over_http = 0;
  for (const auto& [slug, status] : in_page()) {
    if (status == 0) continue;
    EXPECT_EQ(problem_kind(slug).status, status) << slug;
    ++over_http;
  }
  EXPECT_GT(over_http, 45);
}

TEST(Problems, TheTableOfStatusesNamesNoOther) {
  const std::string text = file_text(kSource / "server" / "http" / "problems.cpp");
  const Slugs rows = found_in(text, std::regex(R"re(\n +\{"([a-z-]+)", [0-9]+, ")re"));
  const Slugs said = in_sources();
  EXPECT_GT(rows.size(), 20u);
  for (const std::string& slug : rows) EXPECT_EQ(said.count(slug), 1u) << slug;
}

}  // namespace
}  // namespace cordillera::server
