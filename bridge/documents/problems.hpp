#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "bridge/documents/problem.hpp"

namespace YAML {
struct Mark;
}

namespace trestle::documents {

struct AskedKey;
/// Is told of each key that somebody asks a mapping for.
/// @param mapping  where it begins
using KeyListener = std::function<void(Mark mapping, const AskedKey& key)>;

/// A place in the file, counted from 1, from one of yaml-cpp's, which counts from 0.
[[nodiscard]] Mark to_mark(const YAML::Mark& mark);

/// Whether a character steers a terminal, ends a line or turns the direction of text.
[[nodiscard]] bool is_control(char32_t code) noexcept;
/// Whether there is one in a text, or something that is not UTF-8.
[[nodiscard]] bool has_control(std::string_view text) noexcept;
/// With control characters spelt out, so that a message stays one line and cannot steer a terminal.
[[nodiscard]] std::string printable(std::string_view text);
/// The same of a JSON text, which keeps its meaning: in its strings they become \uXXXX.
[[nodiscard]] std::string printable_json(std::string json);
/// A piece of the file, quoted for a message: short and printable whatever it holds.
[[nodiscard]] std::string quote(std::string_view text);

/// Gathers what is wrong with a file, or with several. The same thing at the same place is said once: an
/// anchored piece of YAML, or a type of a description, is judged wherever it is used.
class Problems {
 public:
  static constexpr std::size_t no_limit = std::numeric_limits<std::size_t>::max();

  /// @param most  so many problems are kept; warnings only as far as errors leave room.
  explicit Problems(std::string file, std::size_t most = no_limit) : file_{std::move(file)}, most_{most} {}
  /// Of several files, whose names take() is given.
  explicit Problems(std::size_t most) : most_{most} {}

  void error(const Place& place, std::string text) { add(errors_, place, std::move(text)); }
  void error(Mark mark, std::string text) { error(Place{0, mark}, std::move(text)); }
  void warning(const Place& place, std::string text) { add(warnings_, place, std::move(text)); }
  void warning(Mark mark, std::string text) { warning(Place{0, mark}, std::move(text)); }
  /// A warning that is given once for each `key`.
  void warning_once(const std::string& key, const Place& place, std::string text);

  [[nodiscard]] bool has_errors() const noexcept { return !errors_.empty(); }
  /// No more errors are kept: reading on tells nothing.
  [[nodiscard]] bool full() const noexcept { return errors_.size() >= most_; }

  /// Has the Sections that report here tell which keys they are asked for, whether these are there or not.
  void listen(KeyListener listener) { listener_ = std::move(listener); }
  [[nodiscard]] const KeyListener& listener() const noexcept { return listener_; }

  /// Everything gathered, in the order of the files and of the places in them.
  /// @param files  their names.
  [[nodiscard]] std::vector<Problem> take(const std::vector<std::string>& files);
  [[nodiscard]] std::vector<Problem> take() { return take({file_}); }

 private:
  struct Found {
    Place place;
    std::string text;
  };
  void add(std::vector<Found>& list, const Place& place, std::string text);

  std::string file_;
  std::size_t most_;
  std::vector<Found> errors_;
  std::vector<Found> warnings_;
  std::set<std::tuple<std::uint32_t, int, int, std::string>> said_;
  std::set<std::string, std::less<>> keys_;
  KeyListener listener_;
};

}  // namespace trestle::documents
