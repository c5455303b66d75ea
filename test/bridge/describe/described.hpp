#pragma once
#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// As a FIDL file tells of it.
inline Model described() {
  Model model{.files = {"Door.fidl"}};
  const TypeIndex number = model.add({.primitive = messages::Primitive::uint8});
  Service door{.name = "Door", .scope = "car", .id = someip::ServiceId{0x1234}};
  door.events = {{.name = "moved",
                  .id = someip::MethodId{0x8001},
                  .payload = {.values = {{.name = "x", .type = number}}}}};
  door.fields = {
      {.name = "angle", .payload = {.values = {{.type = number}}}, .notifier = someip::MethodId{0x8002}}};
  door.place = {.file = 0, .mark = {3, 1}};
  model.services = {door};
  model.instances = {{.service = "car.Door", .id = someip::InstanceId{1}}};
  return model;
}

}  // namespace trestle::describe
