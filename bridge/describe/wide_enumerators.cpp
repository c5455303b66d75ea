#include "bridge/describe/wide_enumerators.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "bridge/messages/map/number_map.hpp"

namespace trestle::describe {
namespace {

/// What an enumeration is carried in.
struct Room {
  bool is_signed = false;
  unsigned bits = 0;  ///< 0: no number

  [[nodiscard]] std::int64_t least() const {
    return is_signed ? -static_cast<std::int64_t>(std::uint64_t{1} << (bits - 1)) : 0;
  }
  /// Of 64 bits without a sign, all values fit.
  [[nodiscard]] std::int64_t most() const {
    return static_cast<std::int64_t>((std::uint64_t{1} << (is_signed ? bits - 1 : bits)) - 1);
  }
  [[nodiscard]] bool holds(std::int64_t value) const {
    return bits == 0 || bits >= 64 || (value >= least() && value <= most());
  }
  [[nodiscard]] std::string shown() const {
    return fmt::format("{} bits, from {} to {}", bits, least(), most());
  }
};

class WideEnumerators {
 public:
  WideEnumerators(const Model& model, documents::Problems& problems) : model_{model}, problems_{problems} {}

  void run() {
    for (std::size_t at = 0; at < model_.types.size(); ++at) {
      const Type& type = model_.types[at];
      if (type.kind == Kind::enumeration) {
        declaration(type);
      }
      use(type.element, type.place);
      use(type.key, type.place);
      uses(type.members);
    }
    for (const Service& service : model_.services) {
      for (const Event& event : service.events) {
        uses(event.payload.values);
      }
      for (const Method& method : service.methods) {
        uses(method.request.values);
        uses(method.response.values);
      }
      for (const Field& field : service.fields) {
        for (const Value& value : field.payload.values) {
          use(value, field.place);
        }
      }
    }
  }

 private:
  static Room room_of(const Type& type, unsigned bits) {
    const unsigned all = messages::width(type.primitive) * 8U;
    return {messages::is_signed_whole(type.primitive), bits == 0 ? all : std::min(bits, all)};
  }

  void declaration(const Type& type) {
    const Room room = room_of(type, type.wire.bits);
    for (const Enumerator& one : type.enumerators) {
      if (!room.holds(one.value)) {
        problems_.error(one.place,
                        fmt::format("the enumerator {} = {} does not fit into the {}, that {} has on "
                                    "the wire: make it wider, or the value another one",
                                    one.name, one.value, room.shown(), name_of(type)));
      }
    }
    if (type.base == no_type) {
      return;
    }
    const Type& base = resolved(model_, type.base);
    if (const auto wide = too_wide(base, room)) {
      problems_.error(type.place,
                      fmt::format("the enumerator {} = {} of {}, which {} extends, does not fit into "
                                  "the {}, that this one has on the wire: make it wider",
                                  wide->name, wide->value, name_of(base), name_of(type), room.shown()));
    }
  }

  void uses(const std::vector<Value>& values) {
    for (const Value& value : values) {
      use(value, value.place);
    }
  }

  /// @param otherwise  where it is, if the value has no place of its own.
  void use(const Value& value, const Place& otherwise) {
    const Type& type = resolved(model_, value.type);
    if (value.wire.bits == 0 || type.kind != Kind::enumeration) {
      return;
    }
    const std::pair key{&type, value.wire.bits};
    auto known = known_.find(key);
    if (known == known_.end()) {
      known = known_.emplace(key, too_wide(type, room_of(type, value.wire.bits))).first;
    }
    if (const std::optional<Enumerator>& wide = known->second) {
      problems_.error(
          place_of_id(value.place, otherwise),
          fmt::format("the enumerator {} = {} of {} does not fit into the {}, that it has here", wide->name,
                      wide->value, name_of(type), room_of(type, value.wire.bits).shown()));
    }
  }

  [[nodiscard]] std::optional<Enumerator> too_wide(const Type& type, const Room& room) const {
    const std::vector<Enumerator> all = all_enumerators(model_, type);
    const auto wide =
        std::ranges::find_if(all, [&](const Enumerator& one) { return !room.holds(one.value); });
    return wide == all.end() ? std::nullopt : std::optional{*wide};
  }

  static std::string name_of(const Type& type) {
    return type.name.empty() ? std::string{"the enumeration"} : type.name;
  }

  const Model& model_;
  documents::Problems& problems_;
  std::map<std::pair<const Type*, std::uint8_t>, std::optional<Enumerator>> known_{};
};

}  // namespace

void tell_of_wide_enumerators(const Model& model, documents::Problems& problems) {
  WideEnumerators{model, problems}.run();
}

}  // namespace trestle::describe
