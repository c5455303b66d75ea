// Property: whatever the input is, read_fidl() ends, with at most 100 problems; and what it reads without
// errors is, when it is written and nothing is lost, read as the same model. The input is a FIDL file, and
// behind a line "====" a FDEPL file that imports it as "I.fidl".
#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/describe/model_json.hpp"
#include "bridge/describe/read/fidl/read_fidl.hpp"
#include "bridge/describe/write/fidl/write_fidl.hpp"

using namespace trestle;

namespace {

void require(bool truth) {
  if (!truth) {
    std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string text(size, '\0');
  std::copy_n(data, size, text.begin());
  constexpr std::string_view border = "\n====\n";
  const std::size_t end = std::min(text.find(border), text.size());
  const std::size_t next = std::min(end + border.size(), text.size());
  const std::array<describe::SourceText, 2> sources{
      {{"I.fidl", text.substr(0, end)}, {"I.fdepl", text.substr(next)}}};
  const describe::Reading reading = describe::read_fidl(sources);
  require(reading.problems.size() <= 100);
  if (!reading.ok()) {
    return 0;
  }
  const describe::Written written = describe::write_fidl(reading.model);
  std::vector<describe::SourceText> again;
  for (const describe::TextFile& file : written.files) {
    again.push_back({file.path, file.text});
  }
  const describe::Reading second = describe::read_fidl(again);
  if (written.not_carried.empty()) {
    require(second.ok());
    require(describe::canonical(second.model) == describe::canonical(reading.model));
  }
  return 0;
}
