#pragma once
#include <string>
#include <vector>

#include "bridge/describe/write/fidl/plan.hpp"

namespace trestle::describe::fidl_writing {

/// Lines of a FDEPL file: an element, its settings, and what stands in it.
struct Block {
  std::string head{};
  std::vector<std::string> settings{};
  std::vector<Block> children{};
  [[nodiscard]] bool is_empty() const noexcept { return settings.empty() && children.empty(); }
  /// Adds a child, unless it says nothing.
  void add(Block child) {
    if (!child.is_empty()) {
      children.push_back(std::move(child));
    }
  }
};

[[nodiscard]] std::string text_of(const Block& block, int indent = 0);

/// Structures and unions that are looked at for rules of one use in a package. A structure of two structures
/// of two structures … has twice as many at each level.
inline constexpr std::size_t max_overwrites = 200'000;

/// Writes what deployment says: only what differs from the defaults of version 2, and ids.
class Deployment {
 public:
  Deployment(const Model& model, const Plan& plan, std::vector<NotCarried>& lost)
      : model_{model}, plan_{plan}, lost_{lost} {}

  [[nodiscard]] Block interface(const Container& container);
  /// Empty when there is nothing to say.
  [[nodiscard]] Block collection(const Container& container);
  [[nodiscard]] Block provider(const Instance& instance, const std::string& name);

 private:
  enum class User : std::uint8_t { field, attribute, argument, map_part };
  void types(Block& block, const Container& container);
  [[nodiscard]] Block type(TypeIndex index);
  [[nodiscard]] Block attribute(const Service& service, const Field& field);
  [[nodiscard]] Block method(const Service& service, const Method& method);
  [[nodiscard]] Block event(const Service& service, const Event& event);
  void lose_what_differs(const Service& service, const Service& base);
  void arguments(Block& block, const char* head, const Payload& payload,
                 const std::vector<std::string>& names, const std::string& owner);
  /// What a use says besides its type. `before`: as which it is known without that; null: as the type is
  /// declared.
  void use(Block& block, const Value& now, const Value* before, User user, const std::string& owner);
  void array(Block& block, const Type& now, const Wire& wire, const Type& before, const Wire& wire_before,
             const std::string& owner);
  /// What an array's elements need besides their type.
  void elements(Block& block, const Value& now, const Value* before, User user, const std::string& owner);
  void basic(Block& block, const Value& now, const Value* before, const std::string& owner);
  void named(Block& block, const Value& now, const Value* before, User user, const std::string& owner);
  void rules(Block& block, const Payload& payload, const char* stem, const std::string& owner);
  void transfer(Block& block, const Transfer& transfer, const std::string& segment,
                const std::string& separation, const std::string& debounce, const std::string& retention,
                int retention_ms, const std::string& owner);
  void kept(Block& block, const Notes& notes, std::initializer_list<const char*> keys,
            const std::string& owner);
  /// "car.Door.open": what a member of the service is called in what is lost. Its place is that of what
  /// follows.
  std::string member(const std::string& key, Place place) {
    place_ = place;
    return service_ + "." + key;
  }
  void lose(const std::string& element, std::string what) { lose(element, std::move(what), place_); }
  void lose(const std::string& element, std::string what, Place place) {
    lost_.push_back({element, std::move(what), place.mark.line == 0 ? place_ : place});
  }

  const Model& model_;
  const Plan& plan_;
  std::vector<NotCarried>& lost_;
  std::size_t overwrites_ = 0;
  std::string service_{};  ///< that is written, by its full name
  Place place_{};          ///< of the element that is written
};

}  // namespace trestle::describe::fidl_writing
