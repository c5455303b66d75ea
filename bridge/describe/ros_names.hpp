#pragma once
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>

/// Names of interface descriptions as ROS 2 allows them. A name that is allowed stays as it is.
namespace trestle::describe {

struct Type;

/// "byte", "char" or "wstring": a type of ROS that other languages take for another one; empty: none of them.
[[nodiscard]] std::string_view ros_only_name(const Type& type);

/// "CurveProfile" of "curve_profile": letters and digits, the first one a capital.
[[nodiscard]] std::string ros_type_name(std::string_view name);
/// "curve_profile" of "CurveProfile"; "class_value" of "class": lower case, no word that C++, Python or IDL
/// keep for themselves.
[[nodiscard]] std::string ros_field_name(std::string_view name);
/// "CURVE_PROFILE" of "CurveProfile".
[[nodiscard]] std::string ros_constant_name(std::string_view name);
/// As of a field, of the last part of "org.example.Types" or "/Types/Body".
[[nodiscard]] std::string ros_package_name(std::string_view scope);

/// What a type or package may have: files are named after it, with up to 50 characters behind it, and
/// with an underscore before each word.
inline constexpr std::size_t max_ros_file_name = 128;
/// The name, or where it is longer than max_ros_file_name its first 119 characters, `between` and a checksum
/// of the whole name of 8 hexadecimal digits.
/// @param between  "H" of a type, "h" of a package; the digits are as it is.
[[nodiscard]] std::string short_name(const std::string& name, char between);

/// The name, or the first of name2, name3 … (with `between` before the number) that is not taken.
[[nodiscard]] std::string first_free(const std::string& name, std::string_view between,
                                     const std::function<bool(const std::string&)>& is_taken);

/// Names of which each is given once. first_free() asks for each number again; this remembers.
class FreeNames {
 public:
  /// The name, or the first of name2, name3 … (with `between` before the number) that was not given yet.
  std::string take(const std::string& name, std::string_view between);
  [[nodiscard]] bool contains(std::string_view name) const { return taken_.contains(name); }
  void insert(const std::string& name) { taken_.insert(name); }

 private:
  std::set<std::string, std::less<>> taken_;
  std::map<std::string, unsigned, std::less<>> next_;  ///< numbers below are taken
};

}  // namespace trestle::describe
