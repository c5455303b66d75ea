#include "bridge/messages/convert/interface_binding.hpp"

#include <gmock/gmock.h>

#include "bridge/messages/types/parsers.hpp"
#include "bridge/messages/types/type_library.hpp"

namespace trestle::messages::interface_binding_test {
namespace {

// An interface description of one service, with its ids and the layout of its payloads.
class Description : public TypeSource {
 public:
  [[nodiscard]] tl::expected<std::optional<InterfaceMessages>, TypeError> find(
      const InterfaceName& interface) const override {
    if (interface.package != "car") {
      return std::nullopt;
    }
    return parse_interface("uint8 level\n---\n", interface, "car.description");
  }
  [[nodiscard]] std::shared_ptr<const InterfaceBinding> binding(const InterfaceName&) const override {
    InterfaceBinding said{.service = someip::ServiceId{0x1234}, .members = {{"Brake", someip::MethodId{1}}}};
    said.rules.payload.array_length = someip::FieldWidth::bits8;
    return std::make_shared<InterfaceBinding>(std::move(said));
  }
};

TEST(InterfaceBinding, ComesFromTheSourceThatDefinesTheInterface) {
  const TypeLibrary types =
      TypeLibrary::of({std::make_shared<BuiltinSource>(), std::make_shared<Description>()});
  const auto said = types.binding(*interface_name("car/srv/Brake"));
  ASSERT_NE(said, nullptr);
  EXPECT_EQ(said->service, someip::ServiceId{0x1234});
  EXPECT_EQ(said->members.at("Brake"), someip::MethodId{1});
  EXPECT_EQ(said->rules.payload.array_length, someip::FieldWidth::bits8);
  EXPECT_EQ(types.binding(*interface_name("std_srvs/srv/Trigger")), nullptr);
}

}  // namespace
}  // namespace trestle::messages::interface_binding_test
