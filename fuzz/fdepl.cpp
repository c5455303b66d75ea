// Property: whatever the deployment of a given FIDL file is, read_fidl() ends, with at most 100 problems; and
// what it reads without errors is, when it is written and nothing is lost, read as the same model. The FIDL
// file has every kind of type and member, so that the deployment of each is reached.
#include <array>
#include <cstdlib>
#include <string>
#include <vector>

#include "bridge/describe/model_json.hpp"
#include "bridge/describe/read/fidl/read_fidl.hpp"
#include "bridge/describe/write/fidl/write_fidl.hpp"

using namespace trestle;

namespace {

constexpr const char* interface_text = R"(package p
interface I {
  version { major 1 minor 0 }
  attribute UInt8 number
  attribute String text readonly
  attribute T.List list noSubscriptions
  method call { in { T.Position position String text } out { T.Choice choice } error { BAD } }
  method tell fireAndForget { in { T.Map map ByteBuffer bytes } }
  broadcast event { out { T.Side side UInt16[] numbers } }
  broadcast other selective { out { Boolean is } }
}
typeCollection T {
  enumeration Side { LEFT = 0 RIGHT = 1 }
  struct Position { Int16 x Int16 y String name T.Side side }
  union Choice { UInt8 small String text Position position }
  map Map { String to UInt8 }
  array List of Position
  typedef Name is String
}
)";

void require(bool truth) {
  if (!truth) {
    std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::array<describe::SourceText, 2> sources{
      {{"I.fidl", interface_text}, {"I.fdepl", std::string(data, data + size)}}};
  const describe::Reading reading = describe::read_fidl(sources);
  require(reading.problems.size() <= 100);
  if (!reading.ok()) {
    return 0;
  }
  require(!reading.model.services.empty());
  const describe::Written written = describe::write_fidl(reading.model);
  std::vector<describe::SourceText> again;
  for (const describe::TextFile& file : written.files) {
    again.push_back({file.path, file.text});
  }
  if (written.not_carried.empty()) {
    const describe::Reading second = describe::read_fidl(again);
    require(second.ok());
    require(describe::canonical(second.model) == describe::canonical(reading.model));
  }
  return 0;
}
