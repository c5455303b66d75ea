// Enumerators and constants, as constants of messages.
#include <fmt/format.h>

#include <string_view>
#include <utility>

#include "bridge/describe/lower_types.hpp"
#include "bridge/describe/marks.hpp"
#include "bridge/describe/ros_names.hpp"
#include "bridge/describe/units.hpp"
#include "bridge/messages/types/characters.hpp"

namespace trestle::describe {
namespace {

using messages::Primitive;
using messages::TypeRules;

std::string number_text(std::int64_t value, Primitive type) {
  return type == Primitive::uint64 ? fmt::format("{}", static_cast<std::uint64_t>(value))
                                   : fmt::format("{}", value);
}

/// Whether an enumerator can be a constant of that type.
bool has_room(Primitive type, std::int64_t value) {
  const int bits = static_cast<int>(messages::width(type)) * 8;
  if (bits == 64) {
    return true;
  }
  const bool is_signed = type == Primitive::int8 || type == Primitive::int16 || type == Primitive::int32;
  const std::int64_t most = (std::int64_t{1} << (is_signed ? bits - 1 : bits)) - 1;
  return value <= most && value >= (is_signed ? -most - 1 : 0);
}

/// A line about enumerators that are called otherwise as constants.
class NewNames {
 public:
  /// @param what  "names of enumerators, which as constants are in capitals"
  explicit NewNames(std::string_view what) : what_{what} {}
  void add(const std::string& was, const std::string& is) {
    constexpr std::size_t most = 20;  // in one line
    if (++count_ <= most) {
      text_ += fmt::format("{}{} is {}", count_ == 1 ? "" : ", ", was, is);
    } else {
      more_ = fmt::format(" and {} more", count_ - most);
    }
  }
  [[nodiscard]] bool empty() const { return count_ == 0; }
  [[nodiscard]] std::string text() const { return fmt::format("{}: {}{}", what_, text_, more_); }

 private:
  std::string_view what_;
  std::size_t count_ = 0;
  std::string text_{};
  std::string more_{};
};

}  // namespace

/// Each enumeration's once, however many fields use it.
std::shared_ptr<const messages::Enumerators> TypeLowering::enumerators_of(const Type& type) {
  auto& known = enumerators_[&type];
  if (known == nullptr) {
    std::vector<std::pair<std::string, std::int64_t>> all;
    for (Enumerator& one : all_enumerators(model_, type)) {
      all.emplace_back(std::move(one.name), one.value);
    }
    known = std::make_shared<const messages::Enumerators>(std::move(all));
  }
  return known;
}

/// The values of an enumeration become constants of the message that uses it.
void TypeLowering::add_enumerators(Shape& shape, Shape::Use& use, const Value& value) {
  const Type* type = &resolved(model_, value.type);
  while (type->kind == Kind::array) {
    if (type->element.type == no_type) {
      return;
    }
    const Type* const inner = &resolved(model_, type->element.type);
    if (inner->kind == Kind::array) {
      return;  // those of the message between them
    }
    type = inner;
  }
  if (type->kind != Kind::enumeration) {
    return;
  }
  if (use.field.type.primitive) {  // else those of a message for the array
    use.words.enumerators = enumerators_of(*type);
    use.field.mark = marks::enumeration;
    if (!type->name.empty()) {
      use.field.mark +=
          " " + (messages::is_identifier(type->name) ? type->name : ros_constant_name(type->name));
    }
  }
  const std::string prefix = marks::prefix_of(type->name, use.field.name);
  if (!shape.enumerations.emplace(type, prefix).second) {
    return;
  }
  const std::vector<Enumerator> all = all_enumerators(model_, *type);
  constant_count_ += all.size();
  if (constant_count_ > options_.max_constants) {
    complain(shape.source,
             fmt::format("the enumerators of {} as constants: there are more than {}", type->name,
                         options_.max_constants),
             type->place);
    return;
  }
  NewNames names{"names of enumerators, which as constants are in capitals"};
  for (const Enumerator& one : all) {
    if (!has_room(type->primitive, one.value)) {
      if (enumerators_told_.insert({type, one.name}).second) {
        complain((type->name.empty() ? shape.source + "." + value.name : full_name(type->scope, type->name)) +
                     "." + one.name,
                 fmt::format("its value {}, which {} has no room for", one.value, to_string(type->primitive)),
                 one.place);
      }
      continue;
    }
    messages::Constant constant{.name = prefix + ros_constant_name(one.name),
                                .type = type->primitive,
                                .value = number_text(one.value, type->primitive)};
    const auto same = shape.constant_at.find(constant.name);
    if (same != shape.constant_at.end()) {
      const messages::Constant& there = shape.definition.constants[same->second];
      if (there.value == constant.value && there.type == constant.type) {
        if (there.name.substr(prefix.size()) != one.name) {
          names.add(one.name, there.name);
        }
        continue;
      }
    }
    const std::string& name =
        add_constant(shape, std::move(constant), type->name + "." + one.name, one.notes);
    if (name.substr(prefix.size()) != one.name) {
      names.add(one.name, name);
    }
  }
  if (!names.empty() && enumerations_told_.insert(type).second) {
    into_.renamed.push_back(
        {type->name.empty() ? shape.source + "." + value.name : full_name(type->scope, type->name),
         names.text(), type->place});
  }
}

const std::string& TypeLowering::add_constant(Shape& shape, messages::Constant constant, std::string source,
                                              const Notes& notes) {
  constant.name = shape.constant_names.take(constant.name, "_");
  shape.constants.emplace(constant.name, std::move(source));
  if (notes != Notes{}) {
    shape.constant_notes.emplace(constant.name, notes);
  }
  shape.constant_at.emplace(constant.name, shape.definition.constants.size());
  shape.definition.constants.push_back(std::move(constant));
  return shape.definition.constants.back().name;
}

void TypeLowering::constants_of(Shape& shape, std::string_view scope, bool keeps_names) {
  const auto all = constants_.find(scope);
  if (all == constants_.end()) {
    return;
  }
  NewNames names{"names of constants, which are in capitals"};
  for (const Constant* const one : all->second) {
    const Constant& constant = *one;
    if (constant.type == no_type) {
      continue;
    }
    const Type& type = resolved(model_, constant.type);
    const bool is_number = type.kind == Kind::primitive || type.kind == Kind::enumeration;
    if (!is_number && type.kind != Kind::string) {
      complain(full_name(constant.scope, constant.name), "a constant that is no number or text",
               constant.place);
      continue;
    }
    Notes notes = constant.notes;
    notes.unit = measured_in(model_, {.type = constant.type, .notes = notes});
    const std::string& name =
        add_constant(shape,
                     {.name = keeps_names ? constant.name : ros_constant_name(constant.name),
                      .type = !is_number ? type.ros_name == "wstring" ? Primitive::wstring : Primitive::string
                                         : type.primitive,
                      .value = constant.value},
                     full_name(constant.scope, constant.name), notes);
    if (name != constant.name) {
      names.add(constant.name, name);
    }
  }
  if (!names.empty()) {
    const Constant& first = *all->second.front();
    into_.renamed.push_back({scope.empty() ? first.name : std::string{scope}, names.text(), first.place});
  }
}

void TypeLowering::add_constants() {
  std::set<std::string_view> of_types;
  for (const Type& type : model_.types) {
    of_types.insert(type.ros_name);
  }
  of_types.erase("");
  for (const auto& [scope, all] : constants_) {
    if (of_types.contains(scope)) {
      continue;
    }
    Shape shape;
    const std::size_t last = scope.find_last_of("./");
    const std::string part = last == std::string::npos ? scope : scope.substr(last + 1);
    shape.source = scope;
    shape.form = TypeRules::Form::empty;
    shape.definition.name =
        fit(package_of(scope) + "/msg/" + (part.empty() ? "" : ros_type_name(part)), scope) + "Constants";
    constants_of(shape, scope, false);
    if (!shape.definition.constants.empty()) {
      const Owner owner{shape.definition.name, scope};
      made(std::move(shape), owner, false);
    }
  }
}

}  // namespace trestle::describe
