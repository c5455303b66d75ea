#pragma once
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bridge/describe/change_log.hpp"
#include "bridge/describe/compare_bytes.hpp"

namespace trestle::describe::comparing {

/// Compares payloads, and the types that they are made of.
class PayloadComparison {
 public:
  /// All of these outlive it.
  PayloadComparison(const Model& before, const Model& after, ChangeLog& log)
      : before_{before}, after_{after}, log_{log} {}

  /// Whether what one side alone says of values, such as limits and units, is a difference.
  void be_strict(bool is_strict) { is_strict_ = is_strict; }

  void payloads(const std::string& element, const Payload& old, const Payload& now, Place old_place,
                Place new_place);

  /// @param behind_length  a length field of the use tells where the type ends.
  void types(const std::string& element, const Value& old_use, const Value& new_use, bool behind_length);

 private:
  /// @param behind_length  a length field tells where the values end.
  void values(const std::string& element, const std::vector<Value>& old, const std::vector<Value>& now,
              bool behind_length, Place old_place, Place new_place);
  void appended(const std::string& element, const std::vector<Value>& old, const std::vector<Value>& now,
                bool behind_length, Place old_place);
  void tagged(const std::string& element, const std::vector<Value>& old, const std::vector<Value>& now,
              Place new_place);
  /// One use of a type, and another.
  void uses(const std::string& element, const Value& old, const Value& now);
  /// What is beside the bytes: unit and default value.
  void said_of_use(const std::string& element, const Value& old, const Value& now);
  void inside(const std::string& element, const Type& old, const Type& now, bool behind_length,
              Place old_place, Place new_place);
  void sizes(const std::string& element, const Type& old, const Type& now, Place old_place, Place new_place);
  void limits(const std::string& element, const Type& old, const Type& now, Place old_place, Place new_place);
  void enumerators(const std::string& element, const Type& old, const Type& now);
  void alternatives(const std::string& element, const Type& old, const Type& now, Place old_place,
                    Place new_place);

  /// Two types that were compared already.
  struct Seen {
    bool is_behind_length = false;  ///< always, so far
    bool is_done = false;           ///< else they are being compared
    std::string element{};          ///< that had them first
    /// Their changes, those of types in them included, and what stands behind the element.
    std::vector<std::pair<std::size_t, std::string>> changes{};
    std::size_t uses = 0;  ///< others that were told
  };
  /// Notes a change for further uses of two types; false: there are enough.
  static bool keep(Seen& seen, std::size_t change, const std::string& element);
  /// Tells that what changed in two types is true of another element, too.
  void tell_again(Seen& seen, const std::string& element);

  const Model& before_;
  const Model& after_;
  ChangeLog& log_;
  bool is_strict_ = true;
  Side old_side_{before_};  ///< of the payloads that are compared
  Side new_side_{after_};
  std::map<std::pair<TypeIndex, TypeIndex>, Seen> seen_{};
  std::vector<Seen*> open_{};  ///< each in the one before
  std::size_t uses_ = 0;
};

}  // namespace trestle::describe::comparing
