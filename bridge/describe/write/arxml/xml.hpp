#pragma once
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace trestle::describe::arxml_writer {

/// As documents::xml_text(), with line ends and tabs as references, so that they survive.
[[nodiscard]] std::string escaped(std::string_view text);

/// A short name as the schema asks for: letters, digits and single '_', a letter first, 127 at most.
[[nodiscard]] std::string short_name(std::string_view name);

/// Text of elements, indented.
class Xml {
 public:
  void open(std::string_view tag);
  void close();
  void leaf(std::string_view tag, std::string_view text);
  /// Before the next element.
  /// @param text  without "--".
  void comment(std::string_view text);
  /// <TAG DEST="dest">path</TAG>
  void reference(std::string_view tag, std::string_view dest, std::string_view path);
  /// As it is: an element that another Xml made.
  void raw(std::string_view text) { text_ += text; }
  [[nodiscard]] const std::string& text() const noexcept { return text_; }

 private:
  void indent() { text_.append(open_.size() * 2, ' '); }
  std::string text_{};
  std::vector<std::string> open_{};
};

/// Packages by path, with their elements in the order of their names.
class Packages {
 public:
  /// A short name that nothing else in the package has; made from `name`.
  [[nodiscard]] std::string unique(std::string_view package, std::string_view name);
  void add(std::string_view package, std::string_view name, std::string element);
  [[nodiscard]] bool has(std::string_view package, std::string_view name) const;
  [[nodiscard]] std::string text() const;

 private:
  struct Package {
    std::map<std::string, std::string> elements{};
    std::set<std::string> names{};
    std::map<std::string, int> next{};  ///< by name: numbers below stand behind it already
    std::map<std::string, Package> inner{};
  };
  [[nodiscard]] Package& at(std::string_view path);
  static void write(const Package& package, Xml& xml);
  Package root_{};
};

}  // namespace trestle::describe::arxml_writer
