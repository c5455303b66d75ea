// Property: whatever the bytes of a device's profile, the answer is a profile, or errors whose places lie in
// the file and whose texts are single printable lines.
#include <algorithm>
#include <cstdlib>
#include <string>

#include "bridge/conform/profile.hpp"

using namespace trestle;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(data, data + size);
  const auto profile = conform::read_profile(text, "fuzz.yaml");
  if (profile) {
    const bool is_good = !profile->name.empty() && (!profile->services.empty() || !profile->uses.empty());
    if (!is_good) {
      std::abort();
    }
    return 0;
  }
  const bool any_error = std::ranges::any_of(profile.error(), [](const documents::Problem& one) {
    return one.severity == documents::Problem::Severity::error;
  });
  const bool all_readable = std::ranges::all_of(profile.error(), [&](const documents::Problem& one) {
    return one.mark.line >= 0 && one.mark.line <= static_cast<int>(size) + 1 && one.text.size() <= 1000 &&
           std::ranges::none_of(one.text, [](char c) { return static_cast<unsigned char>(c) < 0x20; });
  });
  if (!any_error || !all_readable) {
    std::abort();
  }
  return 0;
}
