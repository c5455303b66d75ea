// bridge/documents: YAML documents with errors that name line and column.
//
//   document.hpp  reads a file or a text; utf8.hpp: texts that are not UTF-8
//   replace_file.hpp  writes a file as a whole or not at all
//   section.hpp   one mapping, read key by key; unknown keys are errors
//   format.hpp    what a value may look like: numbers, ids, durations, names; host_and_port.hpp
//   problems.hpp  errors and warnings with their places
//   hex_line.hpp  bytes as hexadecimal text; xml_text.hpp: text within XML
//
// Knows nothing of SOME/IP, DDS or bridges.
#pragma once
#include <yaml-cpp/yaml.h>

#include <map>
#include <string>
#include <vector>

#include "bridge/documents/format.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::documents {

/// A key that a mapping may have, as whoever reads it asks for it.
struct AskedKey {
  enum class Kind : std::uint8_t {
    value,
    values,  ///< a list of them
    mapping,
    mappings,  ///< a list of them
    any_name,  ///< not one key: the user chooses the names of all
  };
  std::string name{};
  Kind kind = Kind::value;
  bool required = false;
  std::string expected{};  ///< of a value, Format
  Shape shape{};           ///< likewise
};

/// One mapping of the file, read key by key. What is wrong goes to the problems, with its place:
///
///     Section qos{node, "qos", problems};
///     qos.read("depth", as<std::uint32_t>(whole_number(1, 10'000)), into.depth);
///     qos.finish();  // whatever was not asked for is an unknown key
///
/// Merge keys ("<<: *other") are resolved here, as yaml-cpp does not.
class Section {
 public:
  /// @param name  what messages call it: "qos"; empty for the file as a whole.
  Section(const YAML::Node& node, std::string name, Problems& problems);

  /// Reads a value that may be missing. True when it was there and good; else `into` stays as it is.
  template <typename T>
  bool read(const char* key, const Format<T>& format, T& into) {
    tell(key, AskedKey::Kind::value, false, format);
    const Entry* entry = use(key);
    return entry != nullptr && read_value(key, entry->value, place_of(*entry), format, into);
  }

  /// Reads a value that must be there.
  template <typename T>
  bool require(const char* key, const Format<T>& format, T& into) {
    tell(key, AskedKey::Kind::value, true, format);
    const Entry* entry = use(key);
    if (entry == nullptr) {
      missing(key, format.expected);
      return false;
    }
    return read_value(key, entry->value, place_of(*entry), format, into);
  }

  /// Reads a list of values that may be missing; single values are no list.
  template <typename T>
  void read_list(const char* key, const Format<T>& format, std::vector<T>& into, std::vector<Mark>& marks) {
    tell(key, AskedKey::Kind::values, false, format);
    const Entry* entry = use(key);
    if (entry == nullptr || !is_list(key, *entry)) {
      return;
    }
    for (const YAML::Node& element : entry->value) {
      T value{};
      if (read_value(key, element, mark_of(element, place_of(*entry)), format, value)) {
        into.push_back(std::move(value));
        marks.push_back(mark_of(element, place_of(*entry)));
      }
    }
  }

  /// True if this is a mapping without such a key.
  [[nodiscard]] bool is_missing(const char* key) const { return is_mapping_ && find(key) == nullptr; }
  /// Whether the key is there. Nobody is told that it was asked for.
  [[nodiscard]] bool has(const char* key) const { return find(key) != nullptr; }
  /// The keys there are, where they are names that the user chose.
  [[nodiscard]] std::vector<std::string> keys() const;
  /// Tells the listener that a list or mapping must be there. That it is not, the caller reports itself.
  void note_required(const char* key, AskedKey::Kind kind) const { tell(key, kind, true); }
  /// The node under a key, for a section or list within this one; an undefined one when the key is missing.
  [[nodiscard]] YAML::Node child(const char* key);
  /// The elements of a list that may be missing but not be empty.
  [[nodiscard]] std::vector<YAML::Node> list(const char* key, const std::string& expected);
  /// As above; it must be there.
  [[nodiscard]] std::vector<YAML::Node> required_list(const char* key, const std::string& expected);

  /// Reports every key that nobody asked for.
  void finish();

  [[nodiscard]] Mark mark() const { return mark_; }
  /// Where a value stands; the section itself when it is missing.
  [[nodiscard]] Mark value_mark(const char* key) const;
  /// Where a key stands; the section itself when it is missing.
  [[nodiscard]] Mark key_mark(const char* key) const;
  /// Where this section says so: as above, but where it is merged in for a merged value.
  [[nodiscard]] Mark use_mark(const char* key) const;

 private:
  struct Entry {
    std::string key;
    Mark key_mark;
    YAML::Node value;
    bool merged = false;
    Mark merge_mark;  ///< of the "<<" that brought it in
    bool used = false;
  };

  void gather(const YAML::Node& node, const Mark* merge_mark, int depth);
  void merge(const YAML::Node& sources, Mark merge_mark, int depth);
  const Entry* use(const char* key);
  [[nodiscard]] const Entry* find(std::string_view key) const;
  template <typename T>
  void tell(const char* key, AskedKey::Kind kind, bool required, const Format<T>& format) const {
    if (problems_.listener()) {
      problems_.listener()(mark_, {key, kind, required, format.expected, format.shape});
    }
  }
  void tell(const char* key, AskedKey::Kind kind, bool required = false) const;
  void missing(const char* key, const std::string& expected);
  [[nodiscard]] bool is_list(const char* key, const Entry& entry);
  /// The place of a node; that of the token before it if it is empty, because YAML then places it further on.
  [[nodiscard]] static Mark mark_of(const YAML::Node& node, Mark otherwise);
  [[nodiscard]] static Mark place_of(const Entry& entry) { return mark_of(entry.value, entry.key_mark); }

  template <typename T>
  bool read_value(const char* key, const YAML::Node& node, Mark place, const Format<T>& format, T& into) {
    if (node.IsScalar()) {
      if (std::optional<T> value = format.read(node.Scalar())) {
        into = std::move(*value);
        return true;
      }
    }
    unexpected(key, node, place, format.expected);
    return false;
  }
  void unexpected(const char* key, const YAML::Node& node, Mark place, const std::string& expected);

  std::string name_;
  Problems& problems_;
  Mark mark_;
  bool is_mapping_ = true;
  int sources_left_;  ///< mappings that may still be merged in
  std::vector<Entry> entries_;
  std::vector<std::string> asked_;
};

/// The word of `words` that `word` is most likely a slip of; empty when none comes near.
[[nodiscard]] std::string nearest(std::string_view word, const std::vector<std::string>& words);

}  // namespace trestle::documents
