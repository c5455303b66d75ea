#pragma once
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/describe/read/source_text.hpp"
#include "bridge/describe/system.hpp"

namespace trestle::generate {

/// What the page asks, the same for all questions: all files and edits each time, so that the program keeps
/// nothing of a page. What a question does not need is empty.
struct PageQuestion {
  std::vector<describe::SourceText> files{};
  describe::Edits edits{};
  std::string target{};   ///< "fidl"
  std::string service{};  ///< full name: "car.Door"
  std::string kind{};     ///< "methods", "events", "fields": as in the JSON of a model
  std::string member{};   ///< describe::member_key()
  std::string part{};     ///< "request", "response" of a method; else "payload"
  std::string access{};   ///< of a field: "getter", "setter"
  std::string values{};   ///< of the part, as JSON with the names of ROS; empty: none
};

/// More values, and deeper ones, no question of our page has.
inline constexpr std::size_t max_question_values = 200'000;
inline constexpr int max_question_depth = 8;

/// Reads the JSON of a question.
/// @return the question, or one line that says what is wrong with it.
[[nodiscard]] tl::expected<PageQuestion, std::string> read_question(std::string_view json);

}  // namespace trestle::generate
