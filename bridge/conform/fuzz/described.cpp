#include "bridge/conform/fuzz/described.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>

#include "bridge/describe/layout.hpp"

namespace trestle::conform {
namespace {

using describe::Kind;
using fuzz::Shape;

/// Types in each other, of which nobody has so many; ends those that contain themselves.
constexpr int max_nesting = 48;
/// A structure of two structures of two structures … has twice as many at each level.
constexpr std::size_t max_shapes = 20'000;

std::uint8_t width_of(someip::FieldWidth width) {
  return static_cast<std::uint8_t>(someip::bytes(width));
}

class Shaper {
 public:
  Shaper(const describe::Model& model, const describe::Payload& payload) : model_{model}, payload_{payload} {}

  Shape root() {
    Shape whole;
    members(whole, payload_.values, payload_.byte_order, 0);
    return whole;
  }

 private:
  void members(Shape& into, const std::vector<describe::Value>& values, std::endian order, int nesting) {
    const bool tagged =
        std::ranges::any_of(values, [](const describe::Value& one) { return one.tag.has_value(); });
    for (const describe::Value& value : values) {
      if (tagged == value.tag.has_value()) {
        into.parts.push_back(value.tag ? tagged_value(value, order, nesting)
                                       : value_of(value, order, nesting));
      }
    }
  }

  Shape value_of(const describe::Value& value, std::endian order, int nesting) {
    return use(value.type, value.wire, value.wire.byte_order.value_or(order), nesting + 1);
  }

  /// Its length field is that which its tag announces.
  Shape tagged_value(const describe::Value& value, std::endian order, int nesting) {
    Shape shape = value_of(value, order, nesting);
    const bool is_number = shape.kind == Shape::Kind::number;
    const auto width = payload_.smallest_tagged_length ? someip::FieldWidth::bits32 : payload_.tagged_length;
    const someip::WireType type = is_number                         ? someip::number_type(shape.bytes)
                                  : payload_.smallest_tagged_length ? someip::length_type(width)
                                                                    : someip::WireType::configured_length;
    if (!is_number) {
      shape.length = width_of(width);
      shape.length_first = true;
      shape.length_counts_selector = shape.kind == Shape::Kind::choice;
    }
    shape.tag = someip::to_number({type, *value.tag});
    shape.optional = value.optional;
    return shape;
  }

  Shape use(describe::TypeIndex index, const describe::Wire& wire, std::endian order, int nesting) {
    Shape shape{.order = order,
                .length_order = payload_.length_fields_always_big ? std::endian::big : payload_.byte_order,
                .length = width_of(wire.length),
                .alignment = payload_.alignment};
    if (static_cast<std::size_t>(index) >= model_.types.size() || nesting > max_nesting ||
        ++shapes_ > max_shapes) {
      return shape;
    }
    const describe::Type& type = model_.at(index);
    switch (type.kind) {
      case Kind::primitive:
      case Kind::enumeration:
        number(shape, type, wire);
        break;
      case Kind::string:
        text(shape, type, wire);
        break;
      case Kind::bytes:
      case Kind::array:
      case Kind::map:
        list(shape, type, order, nesting);
        break;
      case Kind::structure:
        shape.kind = Shape::Kind::structure;
        members(shape, describe::all_members(model_, type), order, nesting);
        break;
      case Kind::choice:
        choice(shape, type, wire, order, nesting);
        break;
      case Kind::alias:
        return use(type.element.type, wire, order, nesting + 1);
    }
    return shape;
  }

  void number(Shape& shape, const describe::Type& type, const describe::Wire& wire) const {
    using messages::Primitive;
    shape.kind = Shape::Kind::number;
    shape.length = 0;
    shape.bytes = messages::width(type.primitive);
    shape.bits = wire.bits;
    shape.is_float = type.primitive == Primitive::float32 || type.primitive == Primitive::float64;
    if (type.kind == Kind::primitive && type.primitive == Primitive::boolean) {
      shape.known = {0, 1};
    }
    if (type.kind == Kind::enumeration) {
      for (const describe::Enumerator& one : describe::all_enumerators(model_, type)) {
        shape.known.push_back(static_cast<std::uint64_t>(one.value));
      }
    } else if (type.minimum && type.maximum) {
      // The ends and what lies between them.
      shape.known = {static_cast<std::uint64_t>(*type.minimum), static_cast<std::uint64_t>(*type.maximum),
                     static_cast<std::uint64_t>(*type.minimum / 2 + *type.maximum / 2)};
    }
  }

  static void text(Shape& shape, const describe::Type& type, const describe::Wire& wire) {
    shape.kind = Shape::Kind::text;
    shape.fixed_bytes = wire.length == someip::FieldWidth::none ? wire.fixed_bytes : 0;
    shape.encoding = wire.encoding == someip::StringEncoding::utf8      ? Shape::Encoding::utf8
                     : wire.encoding == someip::StringEncoding::utf16le ? Shape::Encoding::utf16le
                                                                        : Shape::Encoding::utf16be;
    shape.bom = wire.bom;
    shape.terminator = wire.terminator;
    if (type.max_size != 0) {
      shape.most = type.max_size;
    }
  }

  void list(Shape& shape, const describe::Type& type, std::endian order, int nesting) {
    shape.kind = Shape::Kind::list;
    shape.fewest = type.fixed_size ? type.max_size : type.min_size;
    if (type.max_size != 0 || type.fixed_size) {
      shape.most = type.max_size;
    }
    if (type.kind == Kind::bytes) {
      shape.parts.push_back({.kind = Shape::Kind::number});
    } else if (type.kind == Kind::map) {
      Shape entry;
      entry.parts = {value_of(type.key, order, nesting), value_of(type.element, order, nesting)};
      shape.parts.push_back(std::move(entry));
    } else {
      shape.parts.push_back(value_of(type.element, order, nesting));
    }
  }

  void choice(Shape& shape, const describe::Type& type, const describe::Wire& wire, std::endian order,
              int nesting) {
    shape.kind = Shape::Kind::choice;
    shape.selector = width_of(wire.selector);
    shape.length_first = wire.length_first;
    shape.fixed_bytes = wire.length == someip::FieldWidth::none ? wire.fixed_bytes : 0;
    for (const describe::Value& member : describe::all_members(model_, type)) {
      const auto at = shape.parts.size();
      shape.parts.push_back(value_of(member, order, nesting));
      shape.selectors.push_back(at < type.selectors.size() ? type.selectors[at]
                                                           : static_cast<std::uint32_t>(at + 1));
    }
    if (shape.parts.empty()) {
      shape.kind = Shape::Kind::structure;
    }
  }

  const describe::Model& model_;
  const describe::Payload& payload_;
  std::size_t shapes_ = 0;
};

void add(std::vector<std::uint16_t>& to, std::uint16_t id) {
  if (std::ranges::find(to, id) == to.end()) {
    to.push_back(id);
  }
}

/// Collects what one service has.
class Described {
 public:
  Described(fuzz::KnownService& into, const describe::Model& model) : into_{into}, model_{model} {}

  void add_all_of(const describe::Service& service) {
    for (const describe::Method& method : service.methods) {
      add_element(into_.methods, method.id, &method.request, method.e2e);
    }
    for (const describe::Event& event : service.events) {
      add_element(into_.events, event.id, &event.payload, event.e2e);
      add_groups(event.eventgroups);
    }
    for (const describe::Field& field : service.fields) {
      add_element(into_.methods, field.getter, nullptr, field.getter_e2e);
      add_element(into_.methods, field.setter, &field.payload, field.setter_e2e);
      add_element(into_.events, field.notifier, &field.payload, field.e2e);
      add_groups(field.eventgroups);
    }
  }

 private:
  /// @param payload  null: it has none.
  void add_element(std::vector<std::uint16_t>& to, const std::optional<someip::MethodId>& id,
                   const describe::Payload* payload, const describe::Protection& e2e) {
    if (!id) {
      return;
    }
    add(to, value(*id));
    if (e2e.empty() && (payload == nullptr || payload->known)) {
      into_.payloads[value(*id)] = payload == nullptr ? Shape{} : shape_of(model_, *payload);
    }
  }
  void add_groups(const std::vector<someip::EventgroupId>& groups) {
    for (const someip::EventgroupId group : groups) {
      add(into_.eventgroups, value(group));
    }
  }

  fuzz::KnownService& into_;
  const describe::Model& model_;
};

}  // namespace

Shape shape_of(const describe::Model& model, const describe::Payload& payload) {
  return Shaper{model, payload}.root();
}

bool add_described(fuzz::KnownService& service, const describe::Model& model) {
  const auto has_id = [&](const describe::Service& one) {
    return one.id && value(*one.id) == service.service;
  };
  auto found = std::ranges::find_if(model.services, [&](const describe::Service& one) {
    return has_id(one) && one.major == service.major;
  });
  if (found == model.services.end()) {
    found = std::ranges::find_if(model.services, has_id);
  }
  if (found == model.services.end()) {
    return false;
  }
  Described{service, model}.add_all_of(*found);
  return true;
}

}  // namespace trestle::conform
