// Pages of docs/ that repeat a table of the program: options, titles of problems, formats. What a page lacks, or has otherwise,
// is told as the row that belongs there.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <sstream>

#include "fixture.h"
#include "pipeline/faces/face.h"
#include "server/http/problems.h"
#include "server/options/options.h"

namespace cordillera::server {
namespace {

using Cells = std::vector<std::string>;

const std::filesystem::path kDocs = std::filesystem::path(CORDILLERA_SOURCE_DIR) / "docs";

/// The cells of a row of a Markdown table; nothing if the line is none. "\|" is a bar within a cell.
Cells cells_of(const std::string& line) {
  Cells cells;
  if (line.size() < 2 || line[0] != '|') return cells;
  std::string cell;
  for (std::size_t i = 1; i < line.size(); ++i) {
    if (line[i] == '\\' && i + 1 < line.size() && line[i + 1] == '|') {
      cell += line[++i];
    } else if (line[i] == '|') {
      const auto first = cell.find_first_not_of(' ');
      cells.push_back(first == std::string::npos ? "" : cell.substr(first, cell.find_last_not_of(' ') - first + 1));
      cell.clear();
    } else {
      cell += line[i];
    }
  }
  return cells;
}

/// Rows of the table below a heading, without its head; of the whole page for an empty heading.
std::vector<Cells> rows_of(const std::filesystem::path& page, const std::string& heading = "") {
  const std::string text = file_text(page);
  const auto start = heading.empty() ? 0 : text.find("\n## " + heading + "\n");
  EXPECT_NE(start, std::string::npos) << page << " has no heading " << heading;
  if (start == std::string::npos) return {};
  const auto end = heading.empty() ? std::string::npos : text.find("\n## ", start + 1);
  std::istringstream lines(text.substr(start, end == std::string::npos ? end : end - start));
  std::vector<Cells> rows;
  bool below_the_rule = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("|---", 0) == 0) {
      below_the_rule = true;
    } else if (line.rfind('|', 0) != 0) {
      below_the_rule = false;
    } else if (below_the_rule) {
      rows.push_back(cells_of(line));
    }
  }
  return rows;
}

std::string row(const Cells& cells) {
  std::string line = "|";
  for (const std::string& cell : cells) line += " " + cell + " |";
  return line;
}

/// "16384": what a limit is unless told otherwise; nothing for other options.
std::string default_of(const std::string& name) {
  for (const auto& [option, field, unit] : limit_options()) {
    if (option.name == name) return std::to_string(Limits{}.*field);
  }
  return "";
}

/// The table below a heading has these options, in this order, in the words of their help; the column of defaults is the page's
/// own but for limits.
void expect_options(const std::string& heading, const std::vector<OptionSpec>& options) {
  const auto rows = rows_of(kDocs / "reference" / "options.md", heading);
  for (std::size_t i = 0; i < std::max(rows.size(), options.size()); ++i) {
    if (i >= options.size()) {
      ADD_FAILURE() << heading << ": no such option any more: " << row(rows[i]);
      continue;
    }
    const OptionSpec& option = options[i];
    const bool is_there = i < rows.size() && rows[i].size() == 4;
    const std::string own = is_there && rows[i][0] == "`" + option.name + "`" ? rows[i][2] : "DEFAULT";
    const std::string fixed = default_of(option.name);
    EXPECT_EQ(is_there ? row(rows[i]) : "",
              row({"`" + option.name + "`", option.help, fixed.empty() ? own : fixed, option.accepted}))
        << heading;
    EXPECT_NE(own, "") << option.name << " has no default in the page";
  }
}

TEST(Pages, OptionsAreThoseOfTheTable) {
  std::vector<OptionSpec> service, limits;
  for (const OptionSpec& option : serve_options()) (default_of(option.name).empty() ? service : limits).push_back(option);
  EXPECT_GT(build_options().size(), 20u);
  EXPECT_GT(limits.size(), 15u);
  expect_options("Build", build_options());
  expect_options("Posting", posting_options());
  expect_options("Service", service);
  expect_options("Limits of the service", limits);
}

TEST(Pages, ProblemsHaveTheTitlesOfTheTable) {
  std::map<std::string, std::string> listed;
  for (const Cells& cells : rows_of(kDocs / "reference" / "errors.md", "Over HTTP")) listed[row(cells)] = "";
  for (const ProblemKind& kind : all_problem_kinds()) {
    EXPECT_EQ(listed.count(row({std::to_string(kind.status), "`" + kind.slug + "`", kind.title})), 1u)
        << "docs/reference/errors.md lacks\n"
        << row({std::to_string(kind.status), "`" + kind.slug + "`", kind.title});
  }
  EXPECT_EQ(listed.size(), all_problem_kinds().size());
}

TEST(Pages, FormatsAreThoseOfTheTable) {
  const auto faces = pipeline::faces::all_faces();
  const auto rows = rows_of(kDocs / "formats" / "formats.md", "Formats of a dataset");
  ASSERT_EQ(rows.size(), faces.size());
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const auto& face = *faces[i];
    EXPECT_EQ(row({rows[i][0], rows[i][1], rows[i][2]}),
              row({"`" + std::string(face.name) + "`", "`" + std::string(face.entry) + "`", std::string(face.about)}));
  }
}

}  // namespace
}  // namespace cordillera::server
