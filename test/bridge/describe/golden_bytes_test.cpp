// The bytes of CommonAPI's runtime come out of models.
#include "bridge/describe/raise.hpp"
#include "test/bridge/describe/golden.hpp"

namespace trestle::describe::golden_bytes_test {
namespace {

using lowered::array_of;
using lowered::event;
using lowered::number;
using lowered::structure;
using lowered::text;
using lowered::value;

using golden::json;
using golden::number_behind;
using messages::Primitive;
using someip::FieldWidth;
using someip::StringEncoding;

FieldWidth width_of(std::uint32_t bytes) {
  return FieldWidth{static_cast<std::uint8_t>(bytes)};
}

std::optional<Primitive> primitive_of(const std::string& name) {
  for (int i = 0; i <= static_cast<int>(Primitive::float64); ++i) {
    if (to_string(Primitive{static_cast<std::uint8_t>(i)}) == name) {
      return Primitive{static_cast<std::uint8_t>(i)};
    }
  }
  return std::nullopt;
}

Value use_of(Model& model, const std::string& type, const std::string& deployment);

Value array_use(Model& model, const std::string& type, const std::string& deployment) {
  const std::size_t bracket = type.find('[');
  Value element = use_of(model, type.substr(0, bracket), "default");
  element.name.clear();
  const TypeIndex index = array_of(model, element);
  model.at(index).min_size = number_behind(deployment, "min ").value_or(0);
  model.at(index).max_size = number_behind(deployment, "max ").value_or(0);
  Value use = value(model, "value", index);
  use.wire.length = width_of(number_behind(deployment, "width ").value_or(4));
  model.at(index).fixed_size = use.wire.length == FieldWidth::none;
  return use;
}

Value use_of(Model& model, const std::string& type, const std::string& deployment) {
  if (type.ends_with("]")) {
    return array_use(model, type, deployment);
  }
  if (type == "string") {
    Value use = value(model, "value", text(model));
    use.wire.length = width_of(number_behind(deployment, "width ").value_or(4));
    use.wire.fixed_bytes = number_behind(deployment, "fixed length ").value_or(0);
    use.wire.encoding = deployment.starts_with("utf16le")   ? StringEncoding::utf16le
                        : deployment.starts_with("utf16be") ? StringEncoding::utf16be
                                                            : StringEncoding::utf8;
    return use;
  }
  if (type.starts_with("enum:")) {
    Type kind{.kind = Kind::enumeration, .name = "Level", .primitive = *primitive_of(type.substr(5))};
    const auto width = number_behind(deployment, "width ");
    kind.primitive = !width        ? kind.primitive
                     : *width == 1 ? Primitive::uint8
                     : *width == 2 ? Primitive::uint16
                                   : Primitive::uint32;
    kind.enumerators = {{.name = "LOW", .value = 1}, {.name = "HIGH", .value = 3}};
    return value(model, "value", model.add(std::move(kind)));
  }
  if (type.starts_with("struct{")) {
    const TypeIndex index = structure(model, "Pair",
                                      {value(model, "a", number(model, Primitive::uint8)),
                                       value(model, "b", number(model, Primitive::uint32))});
    Value use = value(model, "value", index);
    use.wire.length = width_of(number_behind(deployment, "width ").value_or(0));
    return use;
  }
  if (type.starts_with("union")) {
    const TypeIndex index =
        structure(model, "Choice",
                  {value(model, "a", number(model, Primitive::uint8)),
                   value(model, "b", number(model, Primitive::uint32)), value(model, "c", text(model))});
    model.at(index).kind = Kind::choice;
    Value use = value(model, "value", index);
    use.wire.length = width_of(number_behind(deployment, "length width ").value_or(4));
    use.wire.selector = width_of(number_behind(deployment, "type width ").value_or(4));
    use.wire.length_first = deployment.find("type-length") == std::string::npos;
    // That runtime does not fill up to the maximum length.
    return use;
  }
  if (const auto primitive = primitive_of(type)) {
    return value(model, "value", number(model, *primitive));
  }
  messages::TypeLibrary library;
  const auto tree = library.resolve(type);
  if (!tree) {
    throw std::invalid_argument{to_string(tree.error())};
  }
  RaisedTypes types{model};
  const TypeIndex index = raise(types, *tree);
  if (deployment.find("covariance as array") != std::string::npos) {
    Type& message = model.at(index);
    message.ros_name.clear();
    for (Value& member : message.members) {
      if (member.name == "position_covariance") {
        model.at(member.type).fixed_size = false;
        model.at(member.type).max_size = 0;
        member.wire = default_wire(Kind::array);
      }
    }
  }
  return value(model, "value", index);
}

/// A model with an event that carries the type of a line.
Model model_of(const json& line) {
  Model model;
  const Value use = use_of(model, line["type"], line["deployment"]);
  event(model, {use}).payload.byte_order =
      line["endianness"] == "le" ? std::endian::little : std::endian::big;
  return model;
}

TEST(GoldenBytes, OfCommonApiComeOutOfModels) {
  const auto all = golden::lines();
  ASSERT_GT(all.size(), 100U);
  std::size_t compared = 0;
  for (const json& line : all) {
    SCOPED_TRACE(line.dump());
    if (!golden::is_exception(line)) {
      golden::compare(line, model_of(line));
      ++compared;
    }
  }
  EXPECT_GE(compared, all.size() - 3);
}

}  // namespace
}  // namespace trestle::describe::golden_bytes_test
